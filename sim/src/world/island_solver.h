#pragma once
#include <algorithm>
#include <array>
#include <functional>
#include <numbers>
#include <span>
#include <vector>

#include "shape/lanes.h"
#include "world/block_cholesky.h"
#include "world/island_blocks.h"
#include "world/island_contacts.h"
#include "world/kept_vector.h"

namespace sim {

/// Multiply-adds of a factorisation per body up to which an island is solved directly: one of contacts alone, which sweeps
/// solve, too, and one with springs.
constexpr double kMostWithContacts = 500, kMostWithSprings = 1e4;
constexpr std::size_t kMostFollowed =
    64;                              ///< bodies of an island that is followed: all are solved in each halving
constexpr int kMostFollowLevel = 8;  ///< so often at most a substep is halved for bodies that are followed
constexpr float kPushSpeed = 3;      ///< at which bodies inside each other are moved apart [m/s]

/// Speeds by which swept contacts may miss: at rest, of the smallest body's size a second, and as a share of the fastest body's.
constexpr double kMissedAtRest = 1e-3, kMissedShare = 0.03;
constexpr double kUneven =
    30;  ///< masses that touch: sweeps let the heavier press the lighter away within a step

/// A timed force in a step. Times in substeps since the start.
struct ActiveForce {
    const TimedForce* force;
    double from, until;  ///< until > from
    double factor;       ///< of `force`: an impulse's, 1 / substep [1/s]
};

/// Bodies joined by contacts or constraints in one step, in order of ids.
struct Island {
    std::vector<int> bodies;       ///< that move, ascending
    std::vector<int> manifolds;    ///< indices, ascending by (a, b)
    std::vector<int> constraints;  ///< indices, ascending
};

/// Moves one island over one step by substeps with soft contacts (Catto 2024, "Solver2D: soft step"; Macklin
/// et al. 2019, "Small steps in physics simulation"), for bodies with modes.
///
/// A substep of h, for every body with coordinates y = (sqrt(m) v, sqrt(I) w, G):
///   1. v <- v + h g; modes: free mean rate G0 = (z_free(h) - z) / h; last impulses applied
///      (warm start)
///   2. one sweep over springs and contacts, overlaps pushed out softly (30 Hz, damping 10, at most 3 m/s)
///   3. positions and orientations move with these velocities
///   4. two sweeps without the push, so that it leaves no speed behind; with one, soft piles simmer (bodies
///      that came deep into each other are pushed in a sweep of their own that only
///      positions see)
///   5. modes step exactly under the force P / h held over h: z1 = z + h G, z1' = c z + d z' + (b / h) P
/// and at the end of the last substep restitution. Contact forces act on a mode with its compliance over the
/// substep, w = (1 - a) / (omega h)^2 >= 0 (body_kind.h), so rigid, stiff and soft bodies go through one
/// solver, and the force's work on a pair without push is -1/2 P J M^-1 J^T P of the rigid part: never
/// positive, for any omega h. Restitution gives back at most e^2 of what a contact took.
///
/// Rows. One Jacobian row a direction (normal, two tangents) and body, scaled by the square root of the
/// inverse mass: D = J M^-1/2, floats in whole lanes, (n, R^T(r x n) / sqrt(I), sqrt(w) phi(r)^T R^T n). So
/// the same row takes velocities out and puts impulses in. The three rows of a point are read together, with
/// K = D D^T between them; friction is a 2 x 2 block limited to the cone. Separations move along with the
/// rows: s = s0 + D . integral of y. Contacts are frozen over the step but for velocities and separations;
/// the rows of springs follow the bodies every substep, as does the frame of angular rows where there is no
/// contact.
///
/// Momentum. An impulse acts on both bodies of a pair at one place of space and at one time, in double
/// precision: what moves them before they move, where they are; what comes after, where that took them; and
/// they move with the velocities that it left. So linear and angular momentum are kept to rounding.
///
/// Impacts (island_impacts.cpp) come first in a substep, in the order of their times: those of fast pairs
/// (ManifoldPoint::begins), and contacts of rigid bodies that rebound and close their gap within the substep.
/// Bodies go to that time with the velocities that they have, frames with them, and on from there. An impact is
/// shared out as generalized reflections are (Smith, Kaufman, Vouga, Tamstorf, Grinspun 2012, "Reflections on
/// simultaneous impact"): of all that touches there, what approaches at v gets impulses P that leave v+ = -e v
/// together (P >= 0, v+ + e v >= 0, no P where more), and so on for what then approaches, until nothing does. A
/// row of balls so hands an impulse on, a box lands on its corners at once. With y the velocities before and d
/// what P adds to them, the energy given is y . d + |d_rigid|^2 / 2 + |d_modes|^2 (held over the substep). Without
/// friction P is scaled to what the rebounds demand, - sum of P v (1 - e) / 2; with friction, which may bring
/// more (Kane), to nothing given at most: no impact gives energy, and none of e = 1 without friction takes any.
/// Afterwards an impact is a contact, unless its bodies turn on too fast for one that stands still.
///
/// A body that strikes faster than its modes can yield within what they describe is rigid in that step (stiffen).
///
/// Frames of bodies with unequal moments of inertia follow them where they turn by more than kFrameTurn, with
/// their rows.
///
/// Directly (direct_solution.cpp) go islands with springs, and islands whose contacts a step's sweeps leave far
/// from solved (kMissedAtRest, kMissedShare), where a factorisation is cheap enough; such a step is taken anew,
/// and kept unless it gives energy, more than kWorse (contacts of bodies deep in each other may contradict each other).
/// A substep then has two halves, as RATTLE (Andersen 1983) for rigid springs:
///   half of gravity; impulses P by which springs' ends meet where the bodies *will be*, and contacts close
///   their gaps; move; the other half; impulses V by which what holds has no speed between its ends
/// which is of second order and gives joints no energy while its equations are solved. P is found by Newton's method on
/// the poses at the end with the rows of the start; each of its steps, and V, minimise
///   1/2 |y - y_free|^2 + sum over rows of what they hold (a convex problem; Castro et al. 2022)
/// with H = 1 + sum of D^T D / gamma, factorised as BlockCholesky: O(bodies) for chains, stacks and trees.
/// Overlaps yield by a share of their bodies' compliance, less under heavy loads; V and friction have no
/// compliance: they are held to the round before's impulses (proximal point method). Modes see all of a
/// substep's impulse in its first half. A substep is halved, and again, where an arm of a spring turns further
/// than kMostTurn, Newton's method does not converge, or weight moves a body by more than kMostFall of its size, and up
/// to kStrikeLevel times where a rigid body rebounds: such impacts act when a substep begins, with all joints that hold.
/// Where bodies have moved by more than kSlow of their size since contacts were found, these are found again
/// (IslandContacts): the step goes on as a new one would begin. So do islands of thin bodies that met unforeseen (may_follow).
/// Where a factorisation is too dear, springs alone are factorised, and solved in turn with sweeps over the contacts; if all
/// are soft (springs_are_soft) they are forces, as they always are among contacts: half of a substep's before bodies move, half
/// after (velocity Verlet).
/// Islands without either, where a timed force acts, go directly, too: a constant force then moves a body exactly.
///
/// Deterministic: sweeps go over springs, then contacts, in an order that is a function of the bodies and their places alone
/// (IslandBlocks; within a block by ids, see kWindow), however many threads share them out. No allocation once the buffers
/// have grown.
class IslandSolver {
public:
    IslandSolver(const WorldSettings& settings, std::vector<MovingBody>& bodies,
                 std::vector<Manifold>& manifolds, std::vector<HeldConstraint>& constraints)
        : settings_(&settings), bodies_(&bodies), manifolds_(&manifolds), constraints_(&constraints) {}

    /// Over one step. follow: see may_follow.
    void solve(const Island& island, const ContactScene& scene, bool follow = false);
    /// Whether an island in which bodies met unforeseen can be followed: solved directly, in substeps in which none of its
    /// bodies moves by more than kSlow of its size, contacts found again in each. Islands of bodies so small or thin that
    /// weight alone takes one further than that in a step, unless they are too fast, or go on at other workers.
    [[nodiscard]] bool may_follow(const Island& island) const;
    /// Before a step: its number, from 0, and the forces that act within it, ascending by bodies; must stay.
    void begin_step(std::uint64_t step, const std::vector<ActiveForce>& forces) noexcept {
        first_substep_ = static_cast<double>(step) * settings_->substeps;
        forces_ = &forces;
    }
    /// The contacts that the last island ends the step with, if they were found again within it; else nullptr.
    [[nodiscard]] const std::vector<Manifold>* found() const noexcept {
        return found_again_ ? &found_ : nullptr;
    }
    /// Whether a body of it touches or is joined to what travels.
    [[nodiscard]] bool is_carried(const Island& island) const;
    /// Where solve writes the paths of its bodies, one a body of the world; must stay. nullptr: nowhere.
    void record(std::vector<BodyPath>* paths) noexcept { paths_ = paths; }
    /// What planes, fixed bodies, places, gravity and drag gave own bodies since the last call [N s].
    [[nodiscard]] Eigen::Vector3d take_outside_impulse() noexcept {
        return std::exchange(outside_, Eigen::Vector3d::Zero());
    }
    [[nodiscard]] const std::vector<CrossImpulse>& crossed() const noexcept { return crossed_; }
    /// Clears `crossed` and sets whether contacts of own bodies with others are recorded in it.
    void cross(bool told) noexcept {
        crossed_.clear();
        told_crossed_ = told;
    }
    /// Adds what an own body and a ghost gave each other besides.
    void add_crossed(const CrossImpulse& more);
    /// Forgets the crossed impulses of a body whose island is solved once more.
    void forget_crossed(int body);
    [[nodiscard]] std::uint64_t deformations_limited() const noexcept { return limited_; }
    [[nodiscard]] std::uint64_t constraints_broken() const noexcept { return broken_; }  ///< since the start

private:
    struct BodyRows {
        MovingBody* body;
        std::uint32_t offset;  // of y, start, moved
        int width;
        double inverse_mass;    // [1/kg]
        Eigen::Vector3d place;  // of the centre: where impulses act
        double time = 0;        // of that, since the substep's start [s]
        bool struck = false;    // takes part in the impact that is being solved
        bool turned = false;    // its frame was, as the substep began
        Eigen::Matrix3d frame;  // body to world, in which angular rows are written
        Eigen::Matrix3f body_from_world;
        std::uint32_t at;                                   // of wide_y_
        FreeRotation rotation{Eigen::Vector3d::Ones(), 0};  // over the substep, direct solutions
        Eigen::Vector3d found_at;                           // its centre when contacts were last found
        Eigen::Quaterniond found_turned;                    // its orientation, then
        bool stiff = false;                                 // see stiffen
    };
    /// One body's part of a row triple.
    struct Side {
        int body = -1;           // island-local, -1: does not move
        int width = 0;           // of a row
        std::uint32_t rows = 0;  // where they begin in jacobians_
        std::uint32_t y = 0;     // where the body begins in y_, start_, moved_
    };
    /// A row triple and the bodies it joins.
    struct Rows {
        Side side[2];
        std::uint32_t wide[2] = {0, 0};  // where the sides' rows begin in wide_rows_
        float k[3][3];
        Eigen::Vector3f drift =
            Eigen::Vector3f::Zero();  ///< what they see of bodies that move as prescribed [m/s]
        bool told = false;            ///< a watched body is among them
    };
    struct ContactRows : Rows {
        ManifoldPoint* point;
        const Manifold* manifold;
        Eigen::Vector3f tangent[2];
        float separation, now, friction, restitution, approach;
        double starts;          // of an impact: when it acts, else negative; infinite: it does not happen [s]
        int begins = -1;        // of an impact: number of the substep
        float drifted = 0;      // by `drift` along the normal, since the step's start [m]
        bool over = false;      // an impact that is no contact afterwards
        bool striking = false;  // part of the reflection that is being solved
        bool struck = false;    // of the impact
        float bias = 0;         // then: speed along the normal that it leaves, negative [m/s]
        float taken, slide_mass, inverse_normal,
            inverse_tangent[3];  // of K: 1/nn; [[0, 1], [1, 2]] of the tangents' 2 x 2
        float impulse[3], kept[3], at_move[3], largest;
        bool emerging, firm;  // firm: an impact, which does not yield
        int pair = -1;        // of crossed_
    };
    struct SpringRows : Rows {
        HeldConstraint* constraint;
        HeldPoint* point;      // of it
        Eigen::Matrix3d axes;  // rows: the point's directions, world; impulses, gap and offset are along them
        Eigen::Vector3d place;   // where the impulse acts, world
        Eigen::Vector3d offset;  // of the ends, over h, less what the rows see of the velocities [m/s]
        double gamma;            // [1/kg]: a unit of impulse lets the ends move by so much
        bool resolved;           // whether the substep follows its motion
        double lag;              // of their gap, what counts of the one before the substep
        Eigen::Vector3d gap;     // between the ends [m]
        Eigen::Vector3d impulse, moved;  // of the velocities' solution, of the positions' [N s]
        bool struck = false;             // holds in the impact that is being solved:
        float kept[3], strike[3];        // its speeds before, its impulse
    };
    /// A contact in a direct solution.
    struct DirectContact {
        double normal_gamma, tangent_gamma;  // [1/kg]
        bool active;                         // begins before the substep ends
        bool soft;                           // along the normal: not held to the impulse before
        double bias;                         // speed along the normal that is wanted, less its sign [m/s]
        double bound;                        // of the friction impulse [N s]
        Eigen::Vector3d before;              // of `impulse`, what `start` has seen
        Eigen::Vector3d impulse;
        Eigen::Matrix3d weight, factored;  // see weight_of; those in the factorisation
        Eigen::Matrix3d mobility;          // K, where it is solved alone
        Eigen::Matrix2d tangent_inverse;   // of K's
    };
    /// A place on a body that rows act on.
    struct Place {
        int body;             // island-local, -1
        Eigen::Vector3f arm;  // world axes, from the centre
        const float* shapes;  // phi there, [axis][mode_width]; nullptr without modes
    };

    /// A contact's turn: after every earlier one (by ids) that shares a body with it.
    struct Turn {
        Manifold* manifold;
        int point, turn;
    };

    void begin(const Island& island);
    void begin_body(BodyRows& rows);
    void stiffen(const Island& island);
    void start_following();
    [[nodiscard]] bool moves_little() const;
    void note_start();
    void sum_start();          ///< of measures_
    void go_back();            ///< to it
    bool calm(double energy);  ///< of the island, after the step; whether it took any
    [[nodiscard]] double energy(bool directly);
    [[nodiscard]] double energy_of(const MovingBody& body) const;
    [[nodiscard]] double energy_of(const SpringRows& spring, bool directly) const;
    void note_springs();
    [[nodiscard]] bool is_far_from_solved() const;
    [[nodiscard]] bool is_uneven() const;
    [[nodiscard]] bool may_gain() const;  // energy, from without
    [[nodiscard]] double most_with_contacts() const noexcept {
        return kMostWithContacts * static_cast<double>(rows_of_.size());
    }
    // Bodies that move as prescribed, driven_bodies.cpp.
    [[nodiscard]] BodyPath::Pose pose_of(int body, double time) const;
    [[nodiscard]] Eigen::Vector3d speed_of(int body, const Eigen::Vector3d& arm) const;
    void see_driven(ContactRows& contact) const;
    void begin_times(double begins) noexcept { time_ = now_ = begins; }
    // Timed forces, timed_forces.cpp: added to those that the user applies, substep by substep.
    void begin_forces(int row);
    void set_forces();
    void end_forces();
    void count_forces(double share);  // of the substep that they acted
    /// The contacts in windows of kWindow, within a window by turn, then by ids. Contacts of one turn share
    /// no body, so sweeping in this order gives the bits of the order by ids, but the processor can work on
    /// several at once; windows keep the bodies they use in its cache.
    static constexpr std::size_t kWindow = 64;
    /// What a block's contacts need, and have among them.
    struct Part {
        std::size_t contacts = 0, floats = 0;  // of it; then where they begin
        bool impacts = false, bounces = false, rebounds = false, emerging = false;
    };
    /// In which a thread orders contacts.
    struct Window {
        std::vector<Turn> contacts;
        std::vector<int> next_turn;  // per island body, 0 between windows
    };
    [[nodiscard]] Part part_of(std::span<const int> manifolds) const;
    void add_contacts(const Island& island);
    [[nodiscard]] int substep_of(const ManifoldPoint& point) const;
    void fill_part(std::span<const int> manifolds, Window& window, Part& part);
    void flush(Window& window, Part& part);
    void add_contact(Manifold& manifold, ManifoldPoint& point);
    void fill_contact(ContactRows& contact, Manifold& manifold, ManifoldPoint& point, Part& part);
    void note(const Part& part) noexcept;
    // Sharing out: what is written of one body or contact alone, by any thread; what contacts do to bodies, in the order of
    // blocks_; what is summed, slab by slab.
    [[nodiscard]] Crew& crew() const noexcept { return scene_->crew; }
    template <typename Visit>
    void each_contact(Visit visit) {
        crew().each(contacts_.size(), 64, [&](int, std::size_t first, std::size_t last) {
            for (std::size_t i = first; i < last; ++i) visit(contacts_[i]);
        });
    }
    template <typename Visit>
    void each_body(Visit visit) {
        crew().each(rows_of_.size(), 16, [&](int, std::size_t first, std::size_t last) {
            for (std::size_t i = first; i < last; ++i) visit(rows_of_[i]);
        });
    }
    [[nodiscard]] std::span<ContactRows> contacts_in(const IslandBlocks::Block& block) noexcept {
        return std::span(contacts_).subspan(block.first, block.last - block.first);
    }
    /// A part of a substep: of the contacts of a block, or of the bodies of its slab. Parts are put together and then
    /// done in one hand-out, see IslandBlocks::run.
    struct Phase {
        void (IslandSolver::*act)(const IslandBlocks::Block& block);
        bool of_bodies;
    };
    void contacts(void (IslandSolver::*act)(const IslandBlocks::Block&)) { phases_.push_back({act, false}); }
    void bodies(void (IslandSolver::*act)(const IslandBlocks::Block&)) { phases_.push_back({act, true}); }
    void run();
    /// What a slab's bodies add to sums, in the order of sweeps.
    struct Sums {
        Eigen::Vector3d outside = Eigen::Vector3d::Zero();
        std::uint64_t limited = 0;
    };
    void take_sums();
    void write_contact(ContactRows& contact);
    // Impacts, island_impacts.cpp.
    /// A contact that meets, at a time of the substep [s].
    struct Hit {
        double time;
        std::size_t contact;
    };
    void strike();
    [[nodiscard]] bool strike_at_start();
    bool find_hits();
    [[nodiscard]] bool is_elsewhere(const ContactRows& contact, double time) const;
    void list_contacts();
    [[nodiscard]] double meets_at(const ContactRows& contact) const;
    void strike(const Hit& hit);
    void reach(int body, double time);
    bool gather(const Manifold& seed, double time, float least);
    [[nodiscard]] bool touches(const ContactRows& contact, const Manifold& seed, double time) const;
    [[nodiscard]] double gap_at(const ContactRows& contact, double time) const;
    void reflect();
    void hold_springs();
    /// By how much a unit of impulse moves a spring's ends apart, mean over its directions [1/kg].
    [[nodiscard]] static double mobility_of(const SpringRows& s) noexcept {
        return static_cast<double>(s.k[0][0] + s.k[1][1] + s.k[2][2]) / s.point->held;
    }
    void sweep_impact(bool friction);
    [[nodiscard]] double share_of_impact() const;
    void go_to(BodyRows& rows, double time);
    void load_rigid(BodyRows& rows, double gone);
    void stretch_gap(ContactRows& contact) const;
    void turn_frames(const IslandBlocks::Block& slab);
    void turn_rows(const IslandBlocks::Block& block);
    /// Whether a contact's rows follow the place where it acts: of those that may rebound, for the balance of energy.
    [[nodiscard]] static bool follows(const ContactRows& contact) noexcept {
        return contact.firm || contact.restitution > 0;
    }
    void turn_frame(BodyRows& rows, const Eigen::Matrix3d& frame);
    void aim(ContactRows& contact) const;
    [[nodiscard]] float least_bounce(const ContactRows& contact) const;
    [[nodiscard]] float rounding(const ContactRows& contact) const;
    [[nodiscard]] bool goes_far(const ContactRows& contact) const;
    void end_impact(ContactRows& contact);
    void write_leg(const BodyRows& rows, const Eigen::Vector3d& velocity, const Eigen::Vector3d& momentum);
    [[nodiscard]] bool is_rigid(const ContactRows& contact) const noexcept {
        return std::ranges::all_of(contact.side, [this](const Side& side) {
            return side.width <= 8 || rows_of_[static_cast<std::size_t>(side.body)].stiff;
        });
    }
    void add_spring(HeldConstraint& constraint, HeldPoint& point);
    /// An end of a spring, now.
    struct End {
        Eigen::Vector3d point;  // world
        Place place;
    };
    [[nodiscard]] End end_of(int body, const Eigen::Vector3d& rest, float* shapes) const;
    [[nodiscard]] Eigen::Quaterniond orientation_of(int body) const;  // now; of -1: the world's
    void write_spring(SpringRows& spring);

    // Directly; direct_solution.cpp.
    /// Whether contacts of so many multiply-adds at most, or springs alone, are factorised; factor_ is ready for it then.
    [[nodiscard]] bool may_go_directly(double most, bool must = false);
    bool begin_direct(double most, bool must = false);
    [[nodiscard]] bool is_too_dear(double most) const;
    [[nodiscard]] double most_with_springs() const noexcept {
        return kMostWithSprings * static_cast<double>(rows_of_.size());
    }
    // Sweeps do for soft springs among contacts, too.
    [[nodiscard]] double most_at_first() const noexcept {
        return springs_soft_ && any_contacts_ ? most_with_contacts() : most_with_springs();
    }
    [[nodiscard]] bool springs_are_soft();
    void pull_springs();
    void set_firmness(SpringRows& spring, bool positions) const;
    [[nodiscard]] bool turns_little() const;
    [[nodiscard]] bool falls_little() const;
    [[nodiscard]] double residual() const;
    [[nodiscard]] float residual(const ContactRows& contact) const;
    void direct_substep(int level, bool last);
    bool try_substep(bool last);
    void write_legs();
    [[nodiscard]] bool moved_on() const;
    void find_again();
    void take_found(double most);
    void note_places();
    static void keep_impulse(const ContactRows& contact, ManifoldPoint& point);
    void follow(bool positions);
    void kick();
    void load_wide(bool positions);
    void widen(Rows& rows, bool positions);
    [[nodiscard]] double mode_scale(bool positions) const noexcept {
        return positions ? std::numbers::sqrt2 : 1;
    }
    void find_ends();
    [[nodiscard]] Eigen::Vector3d gap_at_end(const SpringRows& spring) const;
    [[nodiscard]] Eigen::Quaterniond orientation_at_end(int body) const;
    bool solve_positions();
    void settle_contacts();
    void begin_contact(std::size_t i, const Eigen::Vector3d& seen_so_far, const Eigen::Vector3d& guess,
                       double bias, bool positions);
    [[nodiscard]] double size_of(const Rows& rows) const;
    void solve_velocities();
    void settle_in_turn();
    [[nodiscard]] double left_open() const;
    [[nodiscard]] Eigen::Vector3d solve_alone(const ContactRows& contact, DirectContact& direct) const;
    void set_mobility(const ContactRows& contact, DirectContact& direct) const;
    void minimise();
    [[nodiscard]] Eigen::Vector3d seen(const Rows& rows, const AlignedDoubles& y) const;
    void give(const Rows& rows, const Eigen::Vector3d& impulse, AlignedDoubles& y) const;
    [[nodiscard]] Eigen::Vector3d impulse_of(const DirectContact& contact,
                                             const Eigen::Vector3d& speed) const;
    void gradient();
    [[nodiscard]] Eigen::Matrix3d weight_of(const ContactRows& contact, const DirectContact& direct) const;
    void assemble();
    void narrow(bool positions);
    void move_directly();
    void finish_directly(bool last);
    [[nodiscard]] Place place(int body, const Eigen::Vector3f& arm, int sample, const Eigen::Vector3f& rest,
                              float* scratch);
    [[nodiscard]] Side reserve_rows(int body, std::size_t& used) const;  // of jacobians_
    void write_rows(const Place& place, const Eigen::Matrix3f& directions, float sign, const Side& side);
    void finish_rows(Rows& rows);
    void note_told(ContactRows& c);
    bool note_told(const Rows& rows, bool contact);  // notes it in any_told_, too
    [[nodiscard]] const BodyKind::Substep& of_substep(const BodyKind& kind) const noexcept {
        return kind.substeps[static_cast<std::size_t>(level_)];
    }
    [[nodiscard]] int local(int body) const noexcept { return local_[static_cast<std::size_t>(body)]; }

    void advance();
    void substep(bool last);
    void see_driven(const IslandBlocks::Block& block);
    void load_velocities(const IslandBlocks::Block& slab);
    void load_velocities(BodyRows& rows);
    void warm_start(const IslandBlocks::Block& block);
    void warm_start(ContactRows& contact);
    enum class Push { none, soft, all };
    template <Push kPush>
    void sweep(const IslandBlocks::Block& block);
    [[nodiscard]] bool may_push_out();
    void keep(const IslandBlocks::Block& slab);
    void speeds(const Rows& rows, float (&v)[3]) const;
    void push_by(const Rows& rows, const float (&impulse)[3]);
    void solve_contact(ContactRows& contact, Push push);
    void follow_rows(const IslandBlocks::Block& block);
    void note_work(const IslandBlocks::Block& block);
    void note_work(ContactRows& contact, float impulse);
    void restitute(const IslandBlocks::Block& block);
    void restitute(ContactRows& contact);
    void give_to_move(const IslandBlocks::Block& block);
    void move(const IslandBlocks::Block& slab);
    [[nodiscard]] Eigen::Vector3d place_now(const ContactRows& contact) const;
    void apply(const Rows& rows, const Eigen::Vector3d& impulse, const Eigen::Vector3d& point,
               Eigen::Vector3d& outside);
    void tell(const Rows& rows, int pair, const Eigen::Vector3d& impulse, const float (&along)[3],
              const Eigen::Vector3d& point);
    void apply(const ContactRows& contact, const float (&impulse)[3], Eigen::Vector3d& outside);
    [[nodiscard]] Eigen::Vector3d in_world(const ContactRows& contact, const Eigen::Vector3d& impulse) const;
    [[nodiscard]] static Eigen::Vector3d in_world(const SpringRows& spring, const Eigen::Vector3d& impulse) {
        return spring.axes.transpose() * impulse;
    }
    void give_the_rest(const IslandBlocks::Block& block);
    void finish(const IslandBlocks::Block& slab);
    void move(BodyRows& rows);
    void finish(const BodyRows& rows, Sums& sums);
    [[nodiscard]] bool step_modes(const BodyRows& rows);  // whether a deformation was held
    void keep_impulses();
    int note_pair(const Manifold& manifold);
    /// Bodies of two owners rebound if they touch no other body that moves, as far as this world knows. Each owner sees the other's
    /// bodies as they were some steps ago: in a heap they would rebound from what is no longer there, and gain energy.
    /// found_again: in a substep, see find_again.
    void part_rebounds(bool found_again);
    /// Whether the island goes on at other workers: it is swept, as all of it would be.
    [[nodiscard]] bool among_ghosts() const noexcept { return crossed_.size() > first_crossed_; }

    /// What gravity and forces give in a time [s]: velocity, angular momentum.
    [[nodiscard]] Eigen::Vector3d velocity_given(const MovingBody& body, double time) const {
        const Eigen::Vector3d fall = time * body.gravity_scale * settings_->gravity;
        return body.pushed ? Eigen::Vector3d(fall + time / body.kind->mass.mass * body.force) : fall;
    }
    [[nodiscard]] static Eigen::Vector3d momentum_given(const MovingBody& body, double time) {
        return body.pushed ? Eigen::Vector3d(time * body.torque) : Eigen::Vector3d::Zero();
    }

    const WorldSettings* settings_;
    std::vector<MovingBody>* bodies_;
    std::vector<Manifold>* manifolds_;
    std::vector<HeldConstraint>* constraints_;
    std::vector<BodyPath>* paths_ = nullptr;
    int substep_ = 0;
    const ContactScene* scene_ = nullptr;  // of the island that is being solved
    const Island* island_ = nullptr;
    IslandContacts contact_finder_;
    std::vector<Manifold> found_;  // again, within the step
    bool found_again_ = false;
    bool fresh_ = true;  // contacts, in the first substep since they were found
    double first_substep_ = 0,
           gone_ = 0;            // of the step, since the start; of the substep, since that [substeps]
    double time_ = 0, now_ = 0;  // of the substep, and where the bodies are, since the step's start [s]
    const std::vector<ActiveForce>* forces_ = nullptr;
    struct Pushed {
        int row;                              // of rows_of_
        std::span<const ActiveForce> forces;  // on it
        bool pushed;                          // by the user, with these:
        Eigen::Vector3d force, torque;
        Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMostModes, 1> modal_force;  // not on the heap
        Eigen::Vector3d now;                                                     // of the timed ones [N]
    };
    std::vector<Pushed> pushed_;

    KeptVector<BodyRows> rows_of_;  // per island body
    std::vector<int> local_;        // world body -> island body or -1
    IslandBlocks blocks_;
    std::vector<IslandBlocks::Body> places_;  // of the bodies, to divide them
    std::vector<Sums> sums_;                  // of each slab
    std::vector<Part> parts_;                 // of each block
    std::vector<Window> windows_;             // of each thread
    std::vector<Phase> phases_;               // that run() will do
    std::vector<int> next_of_;                // per island body
    KeptVector<ContactRows> contacts_;
    std::vector<SpringRows> springs_;
    bool springs_soft_ = true;          // as the step begins
    bool modes_ahead_ = false;          // springs' ends are where the substep takes them, with their modes
    std::vector<std::size_t> impacts_;  // contacts, of fast pairs
    bool any_contacts_ = false, any_impacts_ = false;       // in the island
    std::vector<Hit> hits_;                                 // of the substep, by time
    std::vector<int> hit_bodies_;                           // of the impact that is being solved
    std::vector<std::size_t> striking_, struck_;            // contacts, now and since it began
    std::vector<std::size_t> holding_;                      // springs
    std::vector<std::size_t> contacts_of_, first_contact_;  // body by body, and where each begins
    bool any_bounce_ = false, any_struck_ = false;          // contacts that may; in this step
    bool any_rebound_ = false, any_emerging_ = false;       // contacts that may; that are
    bool pushes_out_ = false;                               // in this substep: see may_push_out
    LaneArray y_, kept_, start_, moved_, jacobians_;
    std::size_t jacobians_used_ = 0;
    double h_ = 0;       // of the substep
    double last_h_ = 0;  // of the substep before [s]
    int level_ = 0;      // how often it was halved
    float inverse_h_ = 0, push_rate_ = 0, mass_share_ = 1, impulse_share_ = 0;
    std::uint64_t limited_ = 0, broken_ = 0;
    Eigen::Vector3d outside_ = Eigen::Vector3d::Zero();
    bool any_told_ = false, told_crossed_ = false;
    std::vector<CrossImpulse> crossed_;  // of all islands since forget_crossed
    std::size_t first_crossed_ = 0;      // of this island
    double remaining_ = 0;               // of the step after this substep [s]

    // Of direct solutions, in double precision: body by body velocity, spin, modes, without lanes' padding.
    bool direct_ = false;         // this island is solved directly
    bool carried_ = false;        // see is_carried
    bool follow_ = false;         // and followed
    bool with_contacts_ = false;  // they are factorised, too; else swept over
    struct Before {
        WorldBodyState state;
        bool at_limit;
    };
    double energy_before_ = 0, fastest_ = 0, smallest_ = 0, scale_ = 0;  // see sum_start
    struct Measure {
        double energy, scale, speed, size;
    };
    [[nodiscard]] Measure measure(const MovingBody& body) const;
    [[nodiscard]] static double size_of(const MovingBody& body) { return 2 * body.kind->half_box.minCoeff(); }
    std::vector<Measure> measures_;       // per island body, of energy() and note_start()
    std::vector<double> springs_before_;  // their energies, as the step began
    Eigen::Vector3d outside_before_ = Eigen::Vector3d::Zero();
    std::uint64_t limited_before_ = 0;
    std::vector<Before> before_;  // per world body, the last island's when the step began
    BlockCholesky factor_;
    bool factored_ = false;  // rows and springs have not changed since
    std::vector<int> sizes_;
    std::vector<DirectContact> direct_contacts_;
    std::vector<int> partners_;  // of each body, part_rebounds
    AlignedDoubles wide_rows_, wide_y_, wide_start_, wide_free_, wide_held_, gradient_, step_;
    struct End0 {
        Eigen::Vector3d position;
        Eigen::Quaterniond orientation;
        Eigen::Vector3d momentum;  // with which it turns there [kg m^2/s]
    };
    std::vector<End0> ends_;  // of the bodies, at the end of the substep
};

}  // namespace sim
