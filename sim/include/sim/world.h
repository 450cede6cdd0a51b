#pragma once
#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "sim/geometry.h"
#include "sim/modal_body.h"
#include "sim/modes.h"

namespace sim {

/// How much of a body is computed.
enum class Fidelity {
    rigid,
    linear,    ///< six uniform strains (2.12), inverse mapping in closed form
    modal,     ///< `modes` free vibration modes, polynomial mapping
    automatic  ///< the cheapest of these that meets `error` (choose_fidelity)
};

struct FidelityRequest {  ///< how much of one body to compute
    Fidelity fidelity = Fidelity::automatic;
    int modes = 12;                                ///< modal: the lowest of the non-rigid ones
    int elements = 1;                              ///< per side of the finite-element mesh
    ModeDomain domain = ModeDomain::superquadric;  ///< matter of the mass and stiffness integrals
    double error = 0.01;    ///< automatic: displacement error allowed, share of the largest extent
    double impact_mps = 5;  ///< automatic: the fastest impact expected [m/s]
};

struct FidelityChoice {        ///< see choose_fidelity
    Fidelity fidelity;         ///< rigid, linear or modal
    int modes;                 ///< number; 0 rigid, 6 linear
    double expected_error;     ///< share of the largest extent, see choose_fidelity
    GroupCut cut = {0, 0, 0};  ///< modal: whether `modes` cuts a group of equal frequencies
};

/// Where a prescribed motion has a body at a time.
struct MotionKey {
    double time_s = 0;                                                ///< since the start
    Eigen::Vector3d position = Eigen::Vector3d::Zero();               ///< [m]
    Eigen::Quaterniond orientation = Eigen::Quaterniond::Identity();  ///< body to world, unit
};

/// One body of a world.
struct WorldBody {
    std::string name;
    GeneralizedSuperquadric shape;
    Material material;
    /// C = damping_alpha M + damping_beta K (2.1): sigma = (alpha + beta omega^2) / 2 per mode, and rigid
    /// motion decays as e^(-alpha t), as by drag. Added for the modes: damping_ratio omega.
    double damping_alpha = 0, damping_beta = 0, damping_ratio = 0.05;
    FidelityRequest fidelity;
    int triangles = 360;     ///< of the sampled surface
    double friction = 0.5;   ///< Coulomb; of a pair: sqrt(a b)
    double restitution = 0;  ///< of a pair: the larger
    bool fixed = false;      ///< never moves, does not deform
    double gravity_scale = 1;
    Eigen::Isometry3d world_from_body = Eigen::Isometry3d::Identity();
    Eigen::Vector3d velocity = Eigen::Vector3d::Zero();          ///< of the centre of mass [m/s]
    Eigen::Vector3d angular_velocity = Eigen::Vector3d::Zero();  ///< world axes [rad/s]
    /// If not empty: the body moves as prescribed, by nothing else, and does not deform; pose and velocities
    /// above do not count. By ascending times; from key to key at a steady velocity and turn (the shorter way),
    /// at rest before the first and after the last. Its pose is exact at every time; contacts and joints see
    /// its mean velocity over a substep.
    std::vector<MotionKey> motion = {};
    [[nodiscard]] bool moves() const noexcept { return !fixed && motion.empty(); }  ///< by forces
};

/// Half-space normal . x <= offset is solid. Static.
struct WorldPlane {
    Eigen::Vector3d normal = Eigen::Vector3d::UnitY();  ///< unit
    double offset = 0;                                  ///< [m]
    double friction = 0.5, restitution = 0;
};

enum class Joint {
    ball,   ///< one point is held: three directions
    hinge,  ///< turns about the axis: five directions
    slider  ///< slides along the axis, and does not turn: five directions
};

/// Damped springs of rest length 0 between points of a body and places, or points of another body: the
/// thesis's energy constraint. Implicit in the step, so no stiffness is too large.
///
/// Points are held along some directions of b's frame (the world's without b) and free along the others:
///   gap = E (p_a - p_b),  E: rows are the directions, turning with b; the impulse acts at p_a
/// With x the axis, y and z square to it (frame_a and frame_b, which coincide where all gaps are zero), and L
/// the largest extent of the smaller body:
///   ball    the point                       x y z
///   hinge   the point + L/2 x               x y z,     the point - L/2 x    y z
///   slider  the point +- L/2 x              y z each,  the point + L/2 y    z
/// No row follows from the others. `stiffness` and `breaking_force` are of each point. Neither limits nor
/// motors.
struct PointConstraint {
    std::string name;
    int body_a = 0;
    Eigen::Vector3d point_a = Eigen::Vector3d::Zero();  ///< rest body frame of a
    int body_b = -1;                                    ///< -1: point_b is a place in the world
    Eigen::Vector3d point_b = Eigen::Vector3d::Zero();
    double stiffness = 1e4;                                           ///< [N/m]
    double damping_ratio = 1;                                         ///< against the effective mass
    double breaking_force = std::numeric_limits<double>::infinity();  ///< [N]; above it the constraint breaks
    Joint joint = Joint::ball;
    Eigen::Quaterniond frame_a = Eigen::Quaterniond::Identity();  ///< to a's rest frame; hinges and sliders
    Eigen::Quaterniond frame_b = Eigen::Quaterniond::Identity();  ///< likewise of b, or the world
    /// Whether a and b collide. Empty: unless the point lies within both, their surfaces included (rest shapes).
    std::optional<bool> collide = {};
};
constexpr int kMostHeldPoints = 3;  ///< of a constraint

/// A constant force on a body over a span of time; over none, an impulse. A force acts in each substep by the
/// share of it that it lasts, so with all of force x time; an impulse over the substep in which it falls. Both
/// act where the point is, and along the body's axes as they are, when a substep begins.
struct TimedForce {
    int body = 0;
    Eigen::Vector3d point = Eigen::Vector3d::Zero();  ///< rest frame of the body
    Eigen::Vector3d force = Eigen::Vector3d::Zero();  ///< [N]; of an impulse [N s]
    bool turns = false;              ///< `force` is given in the body's axes; else the world's
    double from_s = 0, until_s = 0;  ///< since the start; equal: an impulse
};

struct WorldSettings {                                       ///< of all bodies
    double dt = 1.0 / 60;                                    ///< [s]
    int substeps = 4;                                        ///< of each step
    Eigen::Vector3d gravity = Eigen::Vector3d(0, -9.81, 0);  ///< [m/s^2]
    bool sleeping = true;
    double sleep_speed = 0.02;  ///< [m/s], of any point of a body; half a second below it: asleep
};

struct WorldDefinition {  ///< numbers of bodies and constraints are their indices
    WorldSettings settings;
    std::vector<WorldBody> bodies;
    std::vector<WorldPlane> planes;
    std::vector<PointConstraint> constraints;
    std::vector<TimedForce> forces;  ///< also on bodies that are added later
};

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

/// Impulse that other moving bodies gave a body in one step.
struct StepImpulse {
    Eigen::Vector3d linear = Eigen::Vector3d::Zero();   ///< [N s]
    Eigen::Vector3d angular = Eigen::Vector3d::Zero();  ///< about its centre, world axes [N m s]
    Eigen::VectorXd modal;  ///< of the modal coordinates, spread over the step [N s kg^-1/2]

    void set_zero() { linear.setZero(), angular.setZero(), modal.setZero(); }
    [[nodiscard]] bool is_zero() const { return linear.isZero(0) && angular.isZero(0) && modal.isZero(0); }
};

/// Impulses that an own body and a ghost gave each other in one step.
struct CrossImpulse {
    int own, ghost;
    bool blow = false;                                 ///< they rebounded, or were stopped where they met
    Eigen::Vector3d linear = Eigen::Vector3d::Zero();  ///< on the own body; the ghost's is opposite [N s]
    Eigen::Vector3d angular_own = Eigen::Vector3d::Zero();    ///< about its centre, world axes [N m s]
    Eigen::Vector3d angular_ghost = Eigen::Vector3d::Zero();  ///< likewise of the ghost
};

/// A ball that holds a foreign body over the next step.
struct ForeignBall {
    int body;
    Eigen::Vector3d center;
    double radius;  ///< of the body, plus the distance it may travel [m]
};

/// How a world is shared with worlds of other processes that hold the same bodies.
enum class Sharing {
    alone,  ///< every body is stepped, whoever owns it
    pairs   ///< only own bodies are stepped, among ghosts that are placed for each step and move with them
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

/// What a world has told of its past; no step depends on it.
struct WorldPast {
    WorldCounts counts;
    std::vector<QuarantinedBody> quarantined;
    std::vector<FirstStep> limited, broken;
};

/// Many modal bodies that fall, touch, deform and hang together (thesis 2.2, 2.3.1, 2.6). See world.cpp and
/// the folder's README for the method. Called by one thread at a time. A step's result is a pure function of the
/// definition and the calls before it.
class World {
public:
    /// Throws std::invalid_argument naming the body or constraint, the value and what was expected.
    explicit World(const WorldDefinition& definition);
    ~World();
    World(World&&) noexcept;
    World& operator=(World&&) noexcept;

    void step();  ///< by settings().dt; allocates nothing once its buffers have grown
    /// So many threads share out the world's steps, at first one: this one and helpers that sleep between steps. No result
    /// depends on how many. Throws std::invalid_argument below 1.
    void use_threads(int threads);
    /// Instead, for benchmarks: this thread does alone what so many would share out, and times each piece of it. The
    /// processor time of steps less what saved_by_threads_s() grows by is then their critical path among so many
    /// threads, whatever else the machine does. Throws std::invalid_argument below 1.
    void plan_threads(int threads);
    [[nodiscard]] double saved_by_threads_s() const;  ///< since plan_threads [s]

    /// Ids are indices, never used again.
    int add_body(const WorldBody& body);
    int add_constraint(const PointConstraint& constraint);
    void remove_constraint(int id);                     ///< wakes its bodies
    [[nodiscard]] bool constraint_holds(int id) const;  ///< neither removed nor broken

    [[nodiscard]] const WorldSettings& settings() const noexcept;  ///< as constructed
    [[nodiscard]] int bodies() const noexcept;                     ///< number, quarantined ones included
    [[nodiscard]] const WorldBody& definition(int body) const;     ///< as added
    [[nodiscard]] FidelityChoice fidelity(int body) const;         ///< as used; rigid, linear or modal
    [[nodiscard]] RigidMass rigid_mass(int body) const;            ///< of the rest shape
    [[nodiscard]] const ModalBasis& basis(int body) const;         ///< no modes for a rigid body
    [[nodiscard]] WorldBodyState state(int body) const;            ///< at the end of the last step
    void set_state(int body, const WorldBodyState& state);         ///< wakes it; sizes of q must match
    void apply_force(int body, const Eigen::Vector3d& force,
                     const Eigen::Vector3d& point_body);  ///< [N],
                                                          ///< world axes, at a rest point, for the next step
    void wake(int body);                                  ///< and the bodies that fell asleep with it
    [[nodiscard]] bool asleep(int body) const;
    [[nodiscard]] bool all_asleep() const;         ///< fixed and quarantined bodies count as asleep
    [[nodiscard]] double time_s() const noexcept;  ///< steps done times dt

    struct Energy {
        double kinetic, potential, elastic, springs;  ///< [J]; potential of gravity against the origin
        [[nodiscard]] double total() const { return kinetic + potential + elastic + springs; }
    };
    [[nodiscard]] Energy energy() const;                       ///< of bodies that move
    [[nodiscard]] Eigen::Vector3d momentum() const;            ///< of bodies that are not fixed [kg m/s]
    [[nodiscard]] Eigen::Vector3d angular_momentum() const;    ///< about the origin [kg m^2/s]
    [[nodiscard]] const WorldCounts& counts() const noexcept;  ///< so far
    [[nodiscard]] const std::vector<QuarantinedBody>& quarantined() const noexcept;  ///< in order of steps
    /// Own bodies whose deformation was held at its limit, and constraints that broke by their breaking force
    /// where they were solved; in order of steps, each once. rewind takes back what it undoes.
    [[nodiscard]] const std::vector<FirstStep>& limited() const noexcept;
    [[nodiscard]] const std::vector<FirstStep>& broken() const noexcept;
    /// All impulse that came from planes, fixed bodies, places, gravity, drag, user forces and falling asleep onto own bodies
    /// since the start [kg m/s].
    [[nodiscard]] Eigen::Vector3d outside_impulse() const;

    // Sharing. At first alone, all bodies own.
    void share(Sharing sharing);
    void set_own(int body, bool own);
    [[nodiscard]] bool own(int body) const;
    [[nodiscard]] WorldRecord record(int body) const;  ///< at the end of the last step
    void record(int body, WorldRecord& out) const;     ///< the same, into storage that is there
    void restore(const WorldRecord& record);           ///< sets a body's state; wakes no other body
    /// Of the last step: contacts whose first body that moves is own,
    /// constraints likewise.
    void contact_records(std::vector<ContactRecord>& out) const;
    void spring_records(std::vector<SpringRecord>& out) const;
    /// islands: contacts solved elsewhere, ascending by (a, b), stand beside the own ones in the next step.
    void restore_contacts(const std::vector<ContactRecord>& contacts,
                          const std::vector<SpringRecord>& springs);
    [[nodiscard]] WorldSnapshot snapshot() const;
    void rewind(const WorldSnapshot& snapshot);  ///< bodies added later stay as they are
    void recall(const WorldPast& past);          ///< after rewind to a snapshot of another world: its past
    void set_step(std::uint64_t step);           ///< time_s and counts().steps continue from here

    // pairs.
    /// Those of `foreign` that have to be placed for the next step, because they may touch an own body.
    void near_own(const std::vector<ForeignBall>& foreign, std::vector<int>& near);
    /// The same for one of them whose state is known better, after near_own.
    [[nodiscard]] bool is_near_own(int body, const WorldBodyState& state) const;
    /// Places a ghost for the next step only; it moves under gravity and `held`.
    void place_ghost(int body, const WorldBodyState& state, const StepImpulse* held, bool asleep = false);
    /// Gives an own body, as rigid, an impulse [N s, N m s].
    void kick(int body, const Eigen::Vector3d& linear, const Eigen::Vector3d& angular);
    /// One step of a body that touches nothing but planes, which stop it, under gravity and `held`.
    void extrapolate(int body, WorldBodyState& state, const StepImpulse* held);
    /// Records what other own bodies that move and constraints give an own body of a world shared by pairs.
    void watch(int body, bool watched);
    /// Every pair of an own body and a ghost that gave each other an impulse in the last step.
    [[nodiscard]] const std::vector<CrossImpulse>& cross_impulses() const noexcept;
    /// Impulse on a watched body in the last step; nullptr: none.
    [[nodiscard]] const StepImpulse* impulse(int body) const;
    [[nodiscard]] int cross_contacts()
        const noexcept;  ///< points between own bodies and ghosts in the last step
    /// Radius of a ball that holds the body as deformed as it may be [m].
    [[nodiscard]] double most_radius(int body) const;
    [[nodiscard]] double radius_now(int body) const;  ///< likewise as it is deformed now [m]
    /// A body's share of the last step's work, in units of an own body without contacts.
    [[nodiscard]] double work(int body) const;

    /// FNV-1a 64 over the exact states in order of bodies, little-endian doubles.
    [[nodiscard]] std::uint64_t state_hash() const;

private:
    struct Implementation;
    std::unique_ptr<Implementation> implementation_;
};

/// The cheapest of rigid, linear and modal (cut at group borders) whose expected error is at most
/// request.error. Expected error of a basis: an impact at v displaces the struck point by v sqrt(m c), c =
/// sum (n . phi_k)^2 / omega_k^2 its modal compliance, largest over the surface's six poles; the error is the
/// difference of that with all 75 modes of an element (of `elements` a side if more) and with the basis's, as
/// share of the largest extent. A named fidelity is kept; its error is computed. Solves for the 75 modes
/// each time: 0.7 ms with one element a side.
[[nodiscard]] FidelityChoice choose_fidelity(const Superquadric& shape, const Material& material,
                                             const FidelityRequest& request);

}  // namespace sim
