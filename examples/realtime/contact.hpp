// One friction contact of an exported library, as an object that holds its own state.
#pragma once

#include "friction.h"

#include <array>
#include <stdexcept>

class Contact {
public:
    using Three = std::array<friction_real, 3>;

    explicit Contact(const friction_params &params = friction_default) : params_(params)
    {
        if (friction_check(&params_) != FRICTION_OK) {
            throw std::invalid_argument("friction parameters are out of range");
        }
        rest();
    }

    void rest() { friction_rest(state_.data()); }

    // Step at a held twist; keeps the last wrench, and returns false, where a number is out of range.
    bool step(const Three &twist, friction_real normal_force, friction_real dt)
    {
        return friction_step(&params_, state_.data(), twist.data(), normal_force, dt, wrench_.data()) == FRICTION_OK;
    }

    const Three &wrench() const { return wrench_; }

private:
    friction_params params_;
    std::array<friction_real, FRICTION_STATES> state_{};
    Three wrench_{};
};
