#pragma once
#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "sim/world_definition.h"

namespace sim {

/// Exact state of one body.
struct WorldBodyState {
    Eigen::Vector3d position;          ///< of the centre of mass, world [m]
    Eigen::Quaterniond orientation;    ///< body to world
    Eigen::Vector3d velocity;          ///< [m/s]
    Eigen::Vector3d angular_momentum;  ///< about the centre of mass, world axes [kg m^2/s]
    Eigen::VectorXd q, q_dot;          ///< modal coordinates of mass-normalised modes [m kg^1/2], rates
};

/// Everything a body's next step depends on, apart from contacts and constraints.
struct WorldRecord {
    int body = 0;
    WorldBodyState state;
    bool asleep = false, quarantined = false;
    bool at_limit = false;          ///< its deformation was held in the last substep
    std::uint16_t still_steps = 0;  ///< since it was last faster than the sleep speed; saturates
    std::int32_t sleep_group = -1;  ///< first body of those that fell asleep together
};

/// State of a contact of bodies a < b (b >= kFirstPlane: a plane) that the next step starts from.
struct ContactRecord {
    struct Point {
        std::uint32_t feature = 0;                        ///< sample, the same from step to step
        Eigen::Vector3f arm_a = Eigen::Vector3f::Zero();  ///< [m]
        float normal_impulse = 0;                         ///< [N s]
        Eigen::Vector3f friction_impulse = Eigen::Vector3f::Zero();
    };
    int a = 0, b = 0;
    bool emerging = false;  ///< began deep inside each other, and still overlap
    int count = 0;          ///< of points, at most 4
    Point points[4];
};

/// State of a constraint that the next step starts from.
struct SpringRecord {
    int constraint = 0;
    bool holds = true;
    /// At its points, along their directions [N s]; zero of points that it has not.
    std::array<Eigen::Vector3f, kMostHeldPoints> impulses = {Eigen::Vector3f::Zero(), Eigen::Vector3f::Zero(),
                                                             Eigen::Vector3f::Zero()};
};

/// Complete state of a world at the end of step `step`, apart from its definition.
struct WorldSnapshot {
    std::uint64_t step = 0;
    std::vector<WorldRecord> bodies;
    std::vector<ContactRecord> contacts;
    std::vector<SpringRecord> springs;
    Eigen::Vector3d outside = Eigen::Vector3d::Zero();  ///< World::outside_impulse
};

struct QuarantinedBody {  ///< taken out of the world
    int body;
    std::uint64_t step;  ///< in which it was noticed
    std::string what;    ///< which value was not finite
};

/// When something first happened to a body or a constraint.
struct FirstStep {
    int number;          ///< of the body or constraint
    std::uint64_t step;  ///< that it happened in, counted from 1
};

/// Totals since the start, but where said otherwise.
struct WorldCounts {
    std::uint64_t steps = 0;              ///< done
    int contacts = 0;                     ///< points in the last step
    int pairs = 0;                        ///< of bodies and planes whose samples were tested in the last step
    int islands = 0;                      ///< awake, in the last step
    int asleep = 0;                       ///< bodies, now
    std::uint64_t inverse_fallbacks = 0;  ///< inverse mappings without convergence
    std::uint64_t deformations_limited = 0;  ///< bodies held at the limit of deformation, per substep
    std::uint64_t constraints_broken = 0;    ///< by their breaking force
    std::uint64_t impacts = 0;               ///< of fast bodies, found by their time of impact
    std::uint64_t solved_again = 0;  ///< rounds in which islands were solved once more: bodies met unforeseen
    std::uint64_t held_apart = 0;    ///< bodies held where they met, as those rounds did not suffice
};

/// What a world reports of its past; no step depends on it.
struct WorldPast {
    WorldCounts counts;
    std::vector<QuarantinedBody> quarantined;
    std::vector<FirstStep> limited, broken;
};

}  // namespace sim
