#pragma once
#include <cstdint>
#include <string>
#include <vector>

namespace app {

/// When something that a scene should not do first happened to a body or a constraint.
struct Mishap {
    std::string name;        ///< of the body or constraint
    std::uint64_t step = 0;  ///< in which it was noticed, counted from 1
    std::string what = {};   ///< of a body that was taken out: which value was not finite or out of range
};

/// What went wrong in a run, each list in order of steps, a name at most once.
struct Mishaps {
    std::vector<Mishap> quarantined;  ///< bodies that were taken out
    std::vector<Mishap> broken;       ///< constraints, by their breaking force
    std::vector<Mishap> limited;      ///< bodies whose deformation was held at its limit

    std::vector<Mishap> spun;  ///< bodies that centrifugal load, which is left out, would stretch by over 1 %

    /// A line for each list that is not empty: count, the first names, the first step.
    [[nodiscard]] std::vector<std::string> lines() const;
};

}  // namespace app
