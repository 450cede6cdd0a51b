#pragma once
#include <array>
#include <memory>
#include <span>

#include "body/body_path.h"
#include "contact/broad_phase.h"
#include "contact/crew.h"
#include "contact/kept_vector.h"
#include "contact/narrow_phase.h"
#include "contact/time_of_impact.h"

namespace sim {

/// What the contacts of a step are made for.
struct ContactScene {
    const WorldSettings& settings;
    const std::vector<WorldPlane>& planes;
    const std::vector<std::pair<int, int>>& joined;  ///< pairs (a < b, ascending) that do not collide
    std::vector<MovingBody>& bodies;
    const std::vector<int>& participants;  ///< ids of those that take part, ascending
    /// No pairs of two foreign bodies that move.
    bool among_ghosts;
    Crew& crew;  ///< shares the work

    [[nodiscard]] bool may_meet(const std::pair<int, int>& pair) const;  ///< a < b
    /// Whether one may have been put into the other: ghosts, and bodies that came from another owner, are where others say.
    [[nodiscard]] bool may_part(const MovingBody& a, const MovingBody& b) const noexcept {
        return among_ghosts && (!a.own || !b.own || a.arrived || b.arrived);
    }
    void set_surface(Manifold& manifold) const;  ///< friction and restitution
};

/// Finds the contacts of a step: broad phase over the bounds that free motion sweeps, narrow phase,
/// manifolds, impulses of the step before; wakes sleepers that are touched.
///
/// A pair is slow if its surfaces move against each other, ringing apart, by at most kSlow of the smaller half
/// extent within the step. Its contacts are found where it is, as half-spaces that stand still over the step:
/// with a motion d a pair of balls that a half-space stops would have missed each other by less than
/// d^2 / (2 (r_a + r_b)), so by less than half a per cent of r. Edges are sharper, and normals of balls turn by
/// up to d / (r_a + r_b): where such a contact is not touched yet, would stop the free motion, and may turn, the
/// pair is treated as a fast one.
///
/// A fast pair that carries no load has its time of impact on the paths of free motion (time_of_impact.h), unless it is in each
/// other as the step begins, and had a contact a step ago or was put there (meet_fast): none, no contact; else its contact is found
/// where the bodies are then, as one that begins at that time (Impacts). Of a body's impacts those later than a substep after its first are left to
/// unforeseen(), which runs after the islands have been solved: it follows the paths really taken of bodies
/// that left the foreseen ones, or touch and turn, and adds the contacts that they lead to. A pair that touches
/// already meets again where it is kInside deep in each other, a little deeper every time.
class StepContacts {
public:
    void find(const ContactScene& scene);

    /// After a solve (`solved`: the bodies that went through it; `started`: the states of all that move, before): contacts for what the paths really taken lead to. Adds at most one impact a body and
    /// lists it; the worlds' islands then are solved again. Empty: nothing unforeseen.
    struct Meeting {
        int a, b;
        double time;    ///< since the step's start [s]
        bool touching;  ///< had a contact already, and still went on inside
    };
    const std::vector<Meeting>& unforeseen(const ContactScene& scene, const std::vector<std::uint8_t>& solved,
                                           const std::vector<WorldBodyState>& started);
    /// Of several impacts of a pair within the step only the last is one of its past in the next.
    void keep_last();
    /// The pair's manifold in this step, if it has one; the first of several.
    [[nodiscard]] Manifold* find_now(int a, int b) {
        return find_now(static_cast<std::uint64_t>(a) << 32 | static_cast<std::uint32_t>(b));
    }
    /// Impulses of the last step again, for a manifold whose island is solved once more.
    void rewarm(Manifold& manifold);
    /// Replaces the contacts of an island's bodies (ascending ids) by those that it found within the step.
    void replace(const std::vector<int>& bodies, const std::vector<Manifold>& by);
    /// From now on in this step the pair counts as one that has a contact.
    void note_known(std::uint64_t key) { known_.push_back(key); }
    std::vector<BodyPath>& paths() noexcept { return paths_; }  ///< of each body; set by solver and find

    std::vector<Manifold>& manifolds() noexcept { return manifolds_; }  ///< of the last step
    [[nodiscard]] const std::vector<Manifold>& manifolds() const noexcept { return manifolds_; }
    [[nodiscard]] int pairs() const noexcept { return pairs_; }  ///< tested in the last step
    [[nodiscard]] std::uint64_t fallbacks() const noexcept;      ///< of the inverse mapping, in the last step
    [[nodiscard]] std::uint64_t impacts() const noexcept {
        return impacts_;
    }  ///< of fast pairs, in the last step

private:
    /// How far a body's free motion takes it in the step.
    struct Reach {
        Eigen::Vector3d moved = Eigen::Vector3d::Zero();  // the centre [m]
        double turned = 0;                                // its surface about the centre [m]
        double rung = 0;                                  // its surface, by modes [m]
    };
    void set_reach(const ContactScene& scene, int id);
    /// What a thread finds: of consecutive bodies, each with later bodies and then with planes, so in the order of the
    /// manifolds' keys.
    struct Found {
        std::size_t first = 0, last = 0;  // of scene.here
        std::size_t next_before = 0;      // first of before_ whose key has not been passed
        NarrowPhase* narrow = nullptr;
        std::vector<Manifold> manifolds;
        std::vector<Meeting> meetings;
        std::vector<int> woken;
        int pairs = 0;
    };
    bool find_once(const ContactScene& scene);
    void set_box(const ContactScene& scene, std::size_t i);
    void find(const ContactScene& scene, const std::vector<std::pair<int, int>>& pairs, Found& found);
    void gather(const ContactScene& scene, std::size_t parts);
    void meet_pair(const ContactScene& scene, int i, int j, Found& found);
    [[nodiscard]] bool pass_by(const ContactScene& scene, int i, int j) const;
    void meet_near(const ContactScene& scene, int i, int j, double margin, const Manifold* before,
                   Found& found) const;
    void meet_fast(const ContactScene& scene, int i, int j, const Manifold* before, Found& found);
    [[nodiscard]] double bulge(const ContactScene& scene, int id) const;
    void watch_turning(int i, int j, double least);
    static void wake(const ContactScene& scene, int i, int j, Found& found);
    void meet_planes(const ContactScene& scene, int i, Found& found);
    const Manifold* last(std::uint64_t key, Found& found);
    [[nodiscard]] const Manifold* find_last(std::uint64_t key);
    [[nodiscard]] Manifold* find_now(std::uint64_t key);
    [[nodiscard]] int impacts_of(int i, int j) const;  // of a pair in this step

    // Fast pairs, step_impacts.cpp.
    [[nodiscard]] Impact foresee(const ContactScene& scene, int i, int j);
    void follow(const ContactScene& scene, int i, const WorldBodyState& from);
    void accept_impacts(const ContactScene& scene);
    void note_first(const ContactScene& scene, std::span<const Meeting> meetings);
    [[nodiscard]] bool is_late(const ContactScene& scene, const Meeting& meeting) const;
    void find_impacts(const ContactScene& scene, std::span<const Meeting> meetings,
                      std::span<Manifold> impacts);
    void find_impact(const ContactScene& scene, const Meeting& meeting, std::size_t thread,
                     Manifold& manifold);
    [[nodiscard]] bool left_path(const ContactScene& scene, int i) const;
    /// Whether unforeseen() looks at any path.
    [[nodiscard]] bool any_left_path(const ContactScene& scene,
                                     const std::vector<std::uint8_t>& solved) const;
    void meet_unforeseen(const ContactScene& scene, int i, int j);

    BroadPhase broad_;
    std::vector<std::unique_ptr<NarrowPhase>> narrow_;  // of each thread
    std::vector<Found> found_;
    std::vector<Reach> reach_;                  // of each body
    std::vector<Manifold> manifolds_, before_;  // by ascending keys
    KeptVector<Manifold> added_;                // to them
    std::vector<BodyPath> paths_;               // of each body
    enum : std::uint8_t { kNotFollowed, kBeingFollowed, kFollowed };
    std::vector<std::uint8_t> followed_;  // paths_ holds the free motion of this step; by any thread
    std::vector<std::uint8_t> watched_;   // has a contact that turns on: see unforeseen; by any thread
    std::vector<double> first_;           // of each body: time of its first impact
    std::vector<Meeting> meetings_;
    std::vector<std::uint64_t> known_;          // pairs
    std::vector<std::array<PosedBody, 2>> at_;  // of each thread, where an impact is
    int pairs_ = 0;
    std::uint64_t impacts_ = 0, fallbacks_before_ = 0;
};

/// Speed at which a body's surface moves along its normals by spin, at most [m/s]. A ball's does not.
[[nodiscard]] double turning_speed(const MovingBody& body) noexcept;
/// How far a body's contacts may begin beyond its surface in the next step [m].
[[nodiscard]] double contact_reach(const MovingBody& body, const WorldSettings& settings);

/// Wakes every body of the group that fell asleep with this one.
void wake_group(std::vector<MovingBody>& bodies, int body);

constexpr double kTouching = 1e-3;  ///< of the smaller half extent: tolerance of a time of impact
constexpr double kSlow = 0.1;       ///< of the smaller half extent: relative motion in a step of slow pairs

}  // namespace sim
