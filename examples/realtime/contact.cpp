// A patch that slides and turns at a held twist; a broken sensor does not break the contact.
#include "contact.hpp"

#include <cmath>
#include <cstdio>

int main()
{
    Contact contact;
    for (int i = 0; i < 100; ++i) {
        const double speed = i == 50 ? std::nan("") : 0.01;
        if (!contact.step({ speed, 0.0, 1.0 }, 2.0, 1e-3)) {
            std::printf("step %d: kept the last wrench\n", i);
        }
    }
    const auto &wrench = contact.wrench();
    std::printf("%.9f %.9f %.9f\n", wrench[0], wrench[1], wrench[2]);
    return 0;
}
