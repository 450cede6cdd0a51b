#pragma once
#include <algorithm>
#include <array>
#include <span>
#include <vector>

#include "contact/kept_vector.h"
#include "contact/step_contacts.h"
#include "shape/lanes.h"
#include "solver/cross_impulses.h"
#include "solver/island.h"
#include "solver/island_blocks.h"
#include "solver/rows.h"

namespace sim {

/// The rows of the island that is being solved: what its contacts and springs see of its bodies' velocities.
///
/// One Jacobian row a direction and body, scaled by the square root of the inverse mass: D = J M^-1/2, floats in whole lanes,
/// (n, R^T(r x n) / sqrt(I), sqrt(w) phi(r)^T R^T n). So with coordinates y = (sqrt(m) v, sqrt(I) w, G) the same row takes
/// velocities out and puts impulses in. G is a mode's mean rate over the substep, w its compliance (body_kind.h). The three
/// rows of a point are read together, with K = D D^T between them. Separations move along with the rows: s = s0 + D . integral
/// of y. Contacts are frozen over the step but for velocities and separations; the rows of springs follow the bodies every
/// substep, as does the frame of angular rows where there is no contact.
///
/// Momentum. An impulse acts on both bodies of a pair at one place of space and at one time, in double precision: what moves
/// them before they move, where they are; what comes after, where that took them; and they move with the velocities that it
/// left. So linear and angular momentum are kept to rounding.
///
/// Data is open to the solver's parts (Sweeps, Impacts, DirectSolution, EnergyBalance), which share it. No allocation once the
/// buffers have grown.
class IslandRows {
public:
    IslandRows(const WorldSettings& settings_of_all, std::vector<MovingBody>& all_bodies,
               std::vector<Manifold>& all_manifolds, std::vector<HeldConstraint>& all_constraints,
               std::vector<BodyPath>& all_paths)
        : settings(settings_of_all),
          world(all_bodies),
          manifolds(all_manifolds),
          constraints(all_constraints),
          paths(all_paths) {}
    IslandRows(const IslandRows&) = delete;
    IslandRows& operator=(const IslandRows&) = delete;

    void begin(const Island& of, const ContactScene& in);  ///< its rows, as the step begins
    /// Gives the last substep's impulses to contacts and springs. How many constraints break.
    [[nodiscard]] int end();
    /// Rows for `found` in place of the contacts so far; false: there are neither.
    bool take_found();

    [[nodiscard]] int local(int body) const noexcept { return local_[static_cast<std::size_t>(body)]; }
    [[nodiscard]] int id_of(const BodyRows& body) const noexcept {
        return static_cast<int>(body.body - world.data());
    }
    [[nodiscard]] Crew& crew() const noexcept { return scene->crew; }
    [[nodiscard]] double whole_substep() const noexcept { return settings.dt / settings.substeps; }  ///< [s]
    /// The island's contacts, or those found again within the step.
    template <typename Visit>
    void each_manifold(Visit visit) {
        for (std::size_t i = 0; i < (found_again ? found.size() : island->manifolds.size()); ++i)
            visit(found_again ? found[i] : manifolds[static_cast<std::size_t>(island->manifolds[i])]);
    }
    template <typename Visit>
    void each_contact(Visit visit) {
        crew().each(contacts.size(), 64, [&](int, std::size_t first, std::size_t last) {
            for (std::size_t i = first; i < last; ++i) visit(contacts[i]);
        });
    }
    template <typename Visit>
    void each_body(Visit visit) {
        crew().each(bodies.size(), 16, [&](int, std::size_t first, std::size_t last) {
            for (std::size_t i = first; i < last; ++i) visit(bodies[i]);
        });
    }
    [[nodiscard]] std::span<ContactRows> contacts_in(const IslandBlocks::Block& block) noexcept {
        return std::span(contacts).subspan(block.first, block.last - block.first);
    }
    [[nodiscard]] const BodyKind::Substep& of_substep(const BodyKind& kind) const noexcept {
        return kind.substeps[static_cast<std::size_t>(substep.level)];
    }
    /// What gravity and forces give in a time [s]: velocity, angular momentum.
    [[nodiscard]] Eigen::Vector3d velocity_given(const MovingBody& body, double time) const {
        const Eigen::Vector3d fall = time * body.gravity_scale * settings.gravity;
        return body.pushed ? Eigen::Vector3d(fall + time / body.kind->mass.mass * body.force) : fall;
    }
    [[nodiscard]] static Eigen::Vector3d momentum_given(const MovingBody& body, double time) {
        return body.pushed ? Eigen::Vector3d(time * body.torque) : Eigen::Vector3d::Zero();
    }

    // Bodies.
    /// y and start: velocities with what the whole substep gives, modes' free mean rates.
    void load_velocities(BodyRows& body);
    void turn_frame(BodyRows& body, const Eigen::Matrix3d& frame);  ///< with the way so far
    void write_leg(const BodyRows& body, const Eigen::Vector3d& velocity, const Eigen::Vector3d& momentum);
    /// The modes under what the rows gave them, held over the substep; whether a deformation was held.
    [[nodiscard]] bool step_modes(const BodyRows& body);
    /// Pose of a body that the island does not move, at a time since the step's start [s].
    [[nodiscard]] BodyPath::Pose pose_of(int body, double time) const;
    /// Speed of its matter at a place, mean over the substep; zero unless it moves as prescribed.
    [[nodiscard]] Eigen::Vector3d speed_of(int body, const Eigen::Vector3d& arm) const;
    [[nodiscard]] Eigen::Quaterniond orientation_of(int body) const;  ///< now; of -1: the world's
    /// Whether one of the island's bodies touches or is joined to what moves as prescribed.
    [[nodiscard]] bool is_carried(const Island& of) const;
    [[nodiscard]] double size_of(const Rows& rows) const;  ///< least half extent of its bodies [m]

    // Contacts.
    /// The rows of a contact, in the bodies' frames as they are now, at the one point at which its impulses act, once it has
    /// begun.
    void write_contact(ContactRows& contact);
    /// What the rows of a contact see of bodies that move as prescribed.
    void see_driven(ContactRows& contact) const;
    /// Half-way between where the contact would be if it moved with either centre.
    [[nodiscard]] Eigen::Vector3d place_now(const ContactRows& contact) const;
    [[nodiscard]] bool is_rigid(const ContactRows& contact) const noexcept {
        return std::ranges::all_of(contact.side, [this](const RowSide& side) {
            return side.width <= 8 || bodies[static_cast<std::size_t>(side.body)].stiff;
        });
    }
    /// Whether a contact's rows follow the place where it acts: of those that may rebound, for the balance of energy.
    [[nodiscard]] static bool follows(const ContactRows& contact) noexcept {
        return contact.firm || contact.restitution > 0;
    }
    [[nodiscard]] static Eigen::Vector3d in_world(const ContactRows& contact,
                                                  const Eigen::Vector3d& impulse) {
        return impulse[0] * contact.point->normal.cast<double>() +
               impulse[1] * contact.tangent[0].cast<double>() +
               impulse[2] * contact.tangent[1].cast<double>();
    }
    static void keep_impulse(const ContactRows& contact, ManifoldPoint& point);

    // Springs.
    /// An end of a spring, or a place where a force acts.
    struct Place {
        int body;             // of the island, -1
        Eigen::Vector3f arm;  // world axes, from the centre
        const float* shapes;  // phi there, [axis][mode_width]; nullptr without modes
    };
    struct End {
        Eigen::Vector3d point;  // world
        Place place;
    };
    /// Now; `shapes`: storage for what Place::shapes points to.
    [[nodiscard]] End end_of(int body, const Eigen::Vector3d& rest, float* shapes) const;
    void write_spring(SpringRows& spring);  ///< its rows, place and gap, now
    [[nodiscard]] static Eigen::Vector3d in_world(const SpringRows& spring, const Eigen::Vector3d& impulse) {
        return spring.axes.transpose() * impulse;
    }

    // Impulses.
    /// Onto both bodies' states, and what does not act between bodies into `from_outside`.
    void apply(const Rows& rows, const Eigen::Vector3d& impulse, const Eigen::Vector3d& point,
               Eigen::Vector3d& from_outside);
    /// A contact's impulse (of it what moves its bodies), at the place where it is now.
    void apply(const ContactRows& contact, const float (&impulse)[3], Eigen::Vector3d& from_outside);

    const WorldSettings& settings;
    std::vector<MovingBody>& world;  ///< all bodies
    std::vector<Manifold>& manifolds;
    std::vector<HeldConstraint>& constraints;
    std::vector<BodyPath>& paths;  ///< of all bodies; the solver writes those of its own
    const ContactScene* scene = nullptr;
    const Island* island = nullptr;
    Substep substep;
    KeptVector<BodyRows> bodies;  ///< of the island
    IslandBlocks blocks;
    KeptVector<ContactRows> contacts;  ///< in the order of blocks
    std::vector<SpringRows> springs;
    std::vector<std::size_t> impacts;  ///< contacts of fast pairs
    LaneArray y, start, moved, kept;   ///< now, as the substep began, way since the step began, put aside
    LaneArray jacobians;
    std::vector<Manifold> found;  ///< contacts found again within the step
    bool found_again = false;     ///< `found` counts
    bool directly = false;        ///< solved by DirectSolution, not Sweeps
    bool modes_ahead = false;     ///< springs' ends are where the substep takes them, with their modes
    bool any_contacts = false, any_impacts = false;
    bool any_bounce = false;   ///< contacts of rigid bodies that may rebound
    bool any_rebound = false;  ///< contacts that may rebound
    bool any_emerging = false;
    bool any_struck = false;  ///< an impact has acted in this step
    Eigen::Vector3d outside =
        Eigen::Vector3d::Zero();  ///< given to own bodies by what does not move as a body [N s]
    std::uint64_t limited = 0;    ///< deformations held, since the start
    CrossImpulses cross{*this};

private:
    /// A contact's turn: after every earlier one (by ids) that shares a body with it.
    struct Turn {
        Manifold* manifold;
        int point, turn;
    };
    /// The contacts in windows, within a window by turn, then by ids. Contacts of one turn share no body, so sweeping in this
    /// order gives the bits of the order by ids, but the processor can work on several at once; windows keep the bodies they
    /// use in its cache.
    static constexpr std::size_t kWindow = 64;
    struct Window {
        std::vector<Turn> contacts;
        std::vector<int> next_turn;  // per island body, 0 between windows
    };
    /// What a block's contacts need, and have among them.
    struct Part {
        std::size_t contacts = 0, floats = 0;  // of it; then where they begin
        bool impacts = false, bounces = false, rebounds = false, emerging = false;
    };
    void begin_body(BodyRows& body);
    void stiffen();
    void add_contacts();
    [[nodiscard]] Part part_of(std::span<const int> of) const;
    void fill_part(std::span<const int> of, Window& window, Part& part);
    void flush(Window& window, Part& part);
    void add_contact(Manifold& manifold, ManifoldPoint& point);
    void fill_contact(ContactRows& contact, Manifold& manifold, ManifoldPoint& point, Part& part);
    void note(const Part& part) noexcept;
    [[nodiscard]] int substep_of(const ManifoldPoint& point) const;
    void add_spring(HeldConstraint& constraint, HeldPoint& point);
    [[nodiscard]] std::size_t floats_of(int id) const;  // of a row triple
    [[nodiscard]] RowSide reserve_rows(int body, std::size_t& used) const;
    [[nodiscard]] Place place_on(int body, const Eigen::Vector3f& arm, int sample,
                                 const Eigen::Vector3f& rest, float* scratch) const;
    void write_rows(const Place& place, const Eigen::Matrix3f& directions, float sign, const RowSide& side);
    void finish_rows(Rows& rows);

    std::vector<int> local_;                  // world body -> island body or -1
    std::vector<IslandBlocks::Body> places_;  // of the bodies, to divide them
    std::vector<Part> parts_;                 // of each block
    std::vector<Window> windows_;             // of each thread
    std::size_t jacobians_used_ = 0;
};

}  // namespace sim
