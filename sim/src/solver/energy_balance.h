#pragma once
#include <vector>

#include "solver/island_rows.h"

namespace sim {

/// The energy of an island over a step, and the state that a solution is taken back to.
class EnergyBalance {
public:
    explicit EnergyBalance(IslandRows& rows) : rows_(rows) {}
    EnergyBalance(const EnergyBalance&) = delete;
    EnergyBalance& operator=(const EnergyBalance&) = delete;

    void note_start();                           ///< what a solution is measured by, and taken back to
    void go_back();                              ///< bodies to where they were then
    [[nodiscard]] double energy(bool directly);  ///< now, as of a direct solution or of sweeps [J]
    [[nodiscard]] double before() const noexcept { return before_; }  ///< at the start [J]
    [[nodiscard]] double scale() const noexcept {
        return scale_;
    }  ///< energies of motion and of weight times size [J]
    [[nodiscard]] double fastest() const noexcept { return fastest_; }  ///< body, at the start [m/s]
    [[nodiscard]] double smallest() const noexcept {
        return smallest_;
    }  ///< thickness of a body, at most 1 [m]
    /// Bodies that only contacts and joints hold have no more energy after a step than before it: contacts that are found anew, and
    /// overlaps that are taken back, would give some at each step, and what leans would start to slide. What they got beyond
    /// kMostGained is taken from their motion against the rigid motion of them all, so that linear and angular momentum are kept;
    /// where that is not enough, it came from outside, and is taken from all of it. Not called for islands with
    /// ghosts: their owners compute these bodies, too.
    void take_gain(double energy_now);

private:
    struct Before {
        WorldBodyState state;
        bool at_limit;
    };
    struct Measure {
        double energy, scale, speed, size;
    };
    [[nodiscard]] Measure measure(const MovingBody& body) const;
    [[nodiscard]] double energy_of(const MovingBody& body) const;
    [[nodiscard]] double energy_of(const SpringRows& spring, bool directly) const;

    IslandRows& rows_;
    std::vector<Before> states_;     // per world body, the last island's when the step began
    std::vector<Measure> measures_;  // per island body
    double before_ = 0, fastest_ = 0, smallest_ = 0, scale_ = 0;
    Eigen::Vector3d outside_ = Eigen::Vector3d::Zero();
    std::uint64_t limited_ = 0;
};

}  // namespace sim
