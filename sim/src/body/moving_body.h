#pragma once
#include "body/free_rotation.h"
#include "body/posed_body.h"
#include "body/step_impulse.h"
#include "sim/world_state.h"

namespace sim {

/// A body of a World, with its state between steps.
struct MovingBody {
    // What every pass over all bodies asks for comes first, in one line of the cache.
    const BodyKind* kind = nullptr;
    bool fixed = false, quarantined = false, asleep = false;
    bool driven = false;   ///< by `motion`, in this step
    bool own = true;       ///< stepped here; else a copy of another world's body
    bool unposed = false;  ///< `posed` is older than `state`
    bool pushed = false;   ///< forces act in the next step: the user's, or of bodies elsewhere
    bool watched = false;  ///< impulses of other own bodies that move are summed in `given`
    bool was_given = false;
    bool arrived = false;   ///< pairs: became own after the last step
    bool at_limit = false;  ///< its deformation was held in the last substep: contacts find its modes stiff
    bool limited_now = false;  ///< in any substep of the step that is being done
    int still_steps = 0;       ///< since it was faster than the sleep speed, at most kMostStillSteps
    int sleep_group = -1;      ///< first body of those that fell asleep together
    float friction = 0, restitution = 0;
    double gravity_scale = 1;
    double work = 0;                 ///< see World::work
    std::uint64_t limited_step = 0;  ///< first step in which it was; 0: never

    WorldBodyState state;
    PosedBody posed;
    FreeRotation substep_rotation{Eigen::Vector3d::Ones(), 0}, step_rotation{Eigen::Vector3d::Ones(), 0};
    Eigen::Vector3d force = Eigen::Vector3d::Zero(), torque = Eigen::Vector3d::Zero();  ///< world axes
    Eigen::VectorXd modal_force;                                                        ///< [N kg^-1/2]
    StepImpulse given;
    std::vector<MotionKey> motion;  ///< prescribed; such a body counts as fixed, but for its velocity

    [[nodiscard]] bool moves() const noexcept { return !fixed && !quarantined; }  ///< takes part in steps
    void stop() { state.velocity.setZero(), state.angular_momentum.setZero(), state.q_dot.setZero(); }
};

constexpr int kMostStillSteps = 65535;

/// As defined, at rest in its modes, not yet posed. `kind`: of it; must stay.
[[nodiscard]] MovingBody moving_body(const WorldBody& definition, const BodyKind& kind,
                                     const WorldSettings& settings);

/// Free motion over a whole step: parabola, free rotation, exact modes. For bodies that touch nothing.
void move_freely(MovingBody& body, const WorldSettings& settings);

/// Brings a deformation that goes beyond the limit back to it: all coordinates are scaled, and the rates lose
/// what pointed outwards, so neither elastic nor kinetic energy rises. The limit: |du/dr| (Frobenius) at most
/// 0.5 at the 53 probes of the body (body_kind.h), so D's singular values lie within 0.5 to 1.5 there and it
/// has an inverse. Returns whether it acted.
bool limit_deformation(MovingBody& body);
constexpr double kGradientLimit = 0.5;

/// Radius of a ball about the centre that holds the body's samples and surface, however they are posed [m].
[[nodiscard]] double loose_radius(const BodyKind& kind, const Eigen::VectorXd& q);
/// An upper bound of the speed of the body's samples at rest shape [m/s].
[[nodiscard]] double point_speed(const MovingBody& body) noexcept;

}  // namespace sim
