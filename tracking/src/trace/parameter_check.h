#pragma once
#include <stdexcept>
#include <string>

namespace tracking {

/// Refuses parameters by the name of what they are for: "sensor: found jitter_s 2, expected from 0 to 1".
struct ParameterCheck {
    const char* name;

    void require(bool holds, const std::string& found, const std::string& expected) const {
        if (!holds)
            throw std::invalid_argument(std::string(name) + ": found " + found + ", expected " + expected);
    }
    void require_within(double value, double least, double most, const std::string& what) const {
        require(value >= least && value <= most, what + " " + std::to_string(value),
                "from " + std::to_string(least) + " to " + std::to_string(most));
    }
};

}  // namespace tracking
