/* A body on a friction patch, in a loop at 1 kHz: pushed harder and harder until it slides, then let go.
 *
 * Prints the time, the speed and the friction force every 0.1 s.
 */
#include "friction.h"

#include <stdio.h>

static const friction_body body = { 0.2, 1e-4, { { 0.0, 0.0, 0.0 } } };
static const double dt = 1e-3, load = 2.0;

int main(void)
{
    double state[FRICTION_STATES], twist[3] = { 0.0, 0.0, 0.0 }, wrench[3];
    int i;
    friction_rest(state);
    for (i = 0; i < 1000; ++i) {
        const double applied[3] = { i < 700 ? 4e-3 * i : 0.0, 0.0, 0.0 };
        if (friction_body_step(&friction_default, &body, state, twist, &load, dt, applied, wrench) != FRICTION_OK) {
            return 1;
        }
        if (i % 100 == 99) {
            printf("%.1f %.9f %.9f\n", (i + 1) * dt, twist[0], wrench[0]);
        }
    }
    return 0;
}
