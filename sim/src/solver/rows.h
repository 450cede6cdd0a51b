#pragma once
#include <cstdint>

#include "body/moving_body.h"
#include "contact/manifold.h"
#include "solver/held_constraint.h"

namespace sim {

/// Where the solver is within a step.
struct Substep {
    int number = 0;        ///< 0 to settings.substeps - 1
    int level = 0;         ///< how often it was halved (direct solutions)
    double h = 0;          ///< its length [s]
    double last_h = 0;     ///< of the one before [s]
    double begins = 0;     ///< since the step's start [s]
    double now = 0;        ///< time at which the bodies are, since the step's start [s]
    double remaining = 0;  ///< of the step after this substep [s]
    double first = 0;      ///< of the step's first one, since the start [substeps]
    double passed = 0;     ///< of the whole substep before this part of it [substeps]
    float inverse_h = 0;   ///< [1/s]
};

/// A body of an island.
struct BodyRows {
    MovingBody* body;
    std::uint32_t offset;             ///< where it begins in y, start, moved
    int width;                        ///< of a row, in floats
    double inverse_mass;              ///< [1/kg]
    Eigen::Vector3d place;            ///< of the centre, at which impulses act [m]
    double time = 0;                  ///< to which impacts have brought it, since the substep's start [s]
    bool in_impact = false;           ///< takes part in the impact that is being solved
    bool turned = false;              ///< its frame was, as the substep began
    bool stiff = false;               ///< its modes do not yield in this step, see IslandRows::stiffen
    Eigen::Matrix3d frame;            ///< body to world, in which angular rows are written
    Eigen::Matrix3f body_from_world;  ///< the same, turned round
    FreeRotation rotation{Eigen::Vector3d::Ones(), 0};  ///< over the substep, direct solutions
    std::uint32_t at;                                   ///< where it begins in vectors of direct solutions
    Eigen::Vector3d found_at;                           ///< its centre when contacts were last found [m]
    Eigen::Quaterniond found_turned;                    ///< its orientation, then
};

/// One body's part of a row triple.
struct RowSide {
    int body = -1;           ///< place in the island, -1: does not move
    int width = 0;           ///< of a row, in floats
    std::uint32_t rows = 0;  ///< where they begin in the Jacobian
    std::uint32_t y = 0;     ///< where the body begins in y, start, moved
};

/// Three rows of the Jacobian, scaled by the square root of the inverse mass: D = J M^-1/2, of the two bodies that they join.
struct Rows {
    RowSide side[2];
    std::uint32_t wide[2] = {0, 0};  ///< where the sides' rows begin in those of direct solutions
    float k[3][3];                   ///< K = D D^T: change of the three speeds for a unit of impulse [1/kg]
    Eigen::Vector3f drift = Eigen::Vector3f::Zero();  ///< speeds of bodies that move as prescribed [m/s]
    bool recorded = false;                            ///< its impulses are recorded, see CrossImpulses
};

/// A contact point: along the normal and two tangents.
struct ContactRows : Rows {
    ManifoldPoint* point;
    const Manifold* manifold;
    Eigen::Vector3f tangent[2];
    float separation;  ///< as the step began [m]
    float now;         ///< as the substep began, or is [m]
    float friction, restitution;
    float approach;  ///< speed along the normal before its first impulse, negative [m/s]
    // An impact (firm) is foreseen at a time within the step and acts in one substep; before that its rows do nothing. Then it is
    // a contact like others, unless it is over.
    bool firm;  ///< an impact; such a contact does not yield
    double
        starts;  ///< time at which it acts, since the step's start [s]; negative: no impact; infinite: it never acts
    int begins = -1;    ///< number of the substep in which it acts, -1: no impact
    bool over = false;  ///< it has acted, and its bodies part: no contact afterwards
    // While an impact is solved, of all contacts:
    bool in_impact = false;  ///< takes part in it
    bool striking = false;   ///< takes part in the reflection that is being solved
    float bias = 0;          ///< speed along the normal that this reflection leaves, negative [m/s]
    float drifted = 0;       ///< by `drift` along the normal, since the step's start [m]
    float taken;             ///< energy that its normal impulses have taken out of the bodies [J]
    float slide_mass;        ///< of K's tangents: 2 / (K11 + K22) [kg]
    float inverse_normal,
        inverse_tangent[3];  ///< of K: 1 / K00; entries 00, 01, 11 of the tangents' inverse [kg]
    float impulse[3];        ///< of the substep [N s]
    float kept[3];     ///< put aside: impulses, before a sweep that only positions see; in impacts speeds
    float at_move[3];  ///< part of `impulse` with which the bodies moved [N s]
    float largest;     ///< normal impulse in this step [N s]
    bool emerging;     ///< began deep inside each other, and still overlap
    int pair = -1;     ///< place among the recorded pairs, see CrossImpulses
};

/// A point that a constraint holds.
struct SpringRows : Rows {
    HeldConstraint* constraint;
    HeldPoint* point;        ///< of it
    Eigen::Matrix3d axes;    ///< rows: the point's directions, world; impulses, gap and offset are along them
    Eigen::Vector3d place;   ///< where the impulse acts, world [m]
    Eigen::Vector3d offset;  ///< of the ends, over h, less what the rows see of the velocities [m/s]
    double gamma;            ///< a unit of impulse lets the ends move by so much [1/kg]
    bool resolved;           ///< whether the substep follows its motion
    double lag;              ///< of their gap, what counts of the one before the substep
    Eigen::Vector3d gap;     ///< between the ends [m]
    Eigen::Vector3d impulse, moved;  ///< of the velocities' solution, of the positions' [N s]
    bool in_impact = false;          ///< holds in the impact that is being solved:
    float kept[3], strike[3];        ///< its speeds before [m/s], its impulse [N s]
};

/// At which bodies inside each other are moved apart at most [m/s]: faster, deep ones would be thrown.
constexpr float kPushSpeed = 3;

/// By how much a unit of impulse moves a spring's ends apart, mean over its directions [1/kg].
[[nodiscard]] inline double mobility_of(const SpringRows& s) noexcept {
    return static_cast<double>(s.k[0][0] + s.k[1][1] + s.k[2][2]) / s.point->held;
}

}  // namespace sim
