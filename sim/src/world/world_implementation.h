#pragma once
#include <functional>
#include <memory>
#include <vector>

#include "sim/world.h"
#include "world/crew.h"
#include "world/disjoint_sets.h"
#include "world/island_solver.h"
#include "world/world_contacts.h"

namespace sim {

constexpr double kWorkOfPair = 0.5, kWorkOfPoint = 0.75;  ///< of a body that touches nothing
constexpr std::size_t kBodiesAPiece = 32;                 ///< of what threads take at once

/// What world.cpp (one world's step) and world_sharing.cpp (several worlds of the same bodies) work on.
struct World::Implementation {
    WorldSettings settings;
    std::vector<WorldPlane> planes;
    std::vector<WorldBody> definitions;
    std::vector<std::unique_ptr<BodyKind>> kinds;
    std::vector<MovingBody> bodies;
    std::vector<HeldConstraint> constraints;
    std::vector<TimedForce> forces;           // ascending by bodies
    std::vector<ActiveForce> active;          // of them in the step, ascending by bodies
    std::vector<std::pair<int, int>> joined;  // pairs that a constraint joins and that do not collide
    WorldContacts contacts;
    std::vector<std::unique_ptr<IslandSolver>> solvers;  // one a thread
    std::unique_ptr<Crew> all = std::make_unique<Crew>();
    Crew alone;
    /// Who shares the work of a step: of one by several partners one thread of each.
    [[nodiscard]] Crew& crew() noexcept { return with ? alone : *all; }
    [[nodiscard]] IslandSolver& solver() const noexcept { return *solvers.front(); }
    void set_threads(std::unique_ptr<Crew> crew);
    std::vector<Island> islands;
    DisjointSets sets;                          ///< of bodies that contacts and constraints join
    std::vector<int> place;                     ///< of a set's first body: the island
    std::vector<std::pair<int, int>> touching;  // of each contact: bodies that move, or -1
    std::size_t islands_used = 0;
    /// What a solve changed besides the bodies' states, kept of every island at its first body.
    struct Outcome {
        Eigen::Vector3d outside = Eigen::Vector3d::Zero();
        std::uint64_t limited = 0, broken = 0;
        bool carried = false;             // IslandSolver::is_carried
        bool found = false;               // contacts, within the step
        std::vector<Manifold> manifolds;  // those
    };
    std::vector<Outcome> outcomes;
    std::vector<WorldBodyState> started;        // of bodies that are solved, when the step began
    std::vector<std::uint8_t> at_limit_before;  // at_limit of bodies, then
    std::vector<std::uint8_t> noted;            // of each body: both are known
    std::vector<SpringRecord> springs_before;   // then
    std::vector<std::uint8_t> solved,
        again;  // of each body: its island went through the solver, and has to once more
    WorldCounts counts;
    std::vector<QuarantinedBody> quarantined;
    std::vector<FirstStep> limited, broken;
    std::vector<std::uint8_t> held_before;                     // constraints, when the last step began
    Eigen::Vector3d outside = Eigen::Vector3d::Zero();         // impulse, see World::outside_impulse
    Eigen::Vector3d outside_before = Eigen::Vector3d::Zero();  // when the last step began

    std::vector<int> here;  // bodies that take part in the step, ascending

    // Together, world_together.cpp.
    using Solve = std::function<void(const Island&, IslandSolver&, const ContactScene&)>;
    Partners* with = nullptr;                 ///< of this step
    std::vector<std::uint8_t> owned_by_this;  ///< own of each body, while such a step counts them all
    struct Sleep {
        bool asleep;
        int still_steps, group;
    };
    std::vector<Sleep> sleep_before;  ///< of each body, when the step began
    bool solving = false;             ///< the step has come so far
    bool results_checked = false;     ///< as they came: no body is broken
    bool all_whole = false;           ///< no own body is broken: nothing has changed them since that was seen
    std::vector<std::uint8_t> near;   ///< of each body: this partner's may meet it
    void find_near();                 ///< fills `near`
    void pose_the_rest();             ///< as the step began
    struct Divided {
        const Island* island;
        IslandSolver* part;
    };
    std::vector<Divided> divided;  ///< islands of which all sweep a part
    std::vector<double> effort,    ///< of each constraint: what solving its island took last time, as cost_of
        effort_told;               ///< as its body's owner knows it
    std::vector<double> spare;     ///< of each partner: what it should still do, in the step
    std::vector<int> solved_by;    ///< of an island's first body: which partner solves it
    std::vector<std::pair<double, const Island*>> dear;  ///< small islands that take long
    std::vector<std::vector<const Island*>> solves;      ///< each partner which of the small islands
    void write_efforts(ByteWriter& out) const;
    void read_efforts(ByteReader& in, int partner);
    [[nodiscard]] double cost_of(const Island& island) const;
    void plan_islands();
    [[nodiscard]] int solver_of(const Island& island) const {
        return solved_by[static_cast<std::size_t>(island.bodies.front())];
    }
    IslandSolver& part_solver(std::size_t part);
    bool end_divided(const Divided& d, const Solve& solve, const ContactScene& scene);
    void step_together(Partners& with);
    void restore_own() noexcept;
    void go_back(const WorldCounts& counts_before);
    void solve_together(const Solve& solve, bool first);
    [[nodiscard]] bool is_by_one(const Island& island) const;
    void write_result(ByteWriter& out, const Island& island) const;
    void read_result(ByteReader& in, const Island& island);
    void share_paths();

    // Sharing.
    Sharing sharing = Sharing::alone;
    std::vector<int> owned;    // pairs: own and fixed bodies, ascending
    std::vector<int> placed;   // pairs: ghosts of the next step
    std::vector<int> arrived;  // bodies that are own since the last step
    int cross_contacts = 0;
    struct LooseBall {
        Eigen::Vector3d center;
        double radius;
    };
    std::vector<LooseBall> own_balls;  // pairs: of the next step
    [[nodiscard]] bool near_own(const Eigen::Vector3d& center, double radius) const;

    const BodyKind* kind_of(const WorldBody& body);
    int add(const WorldBody& body);   ///< returns its id
    void set_joined();                ///< by constraints
    void drop_constraints(int body);  ///< of a body that is taken out
    [[nodiscard]] SpringRecord spring_record(std::size_t constraint) const;
    bool restore_spring(const SpringRecord& record);     ///< whether it held otherwise
    void pose(MovingBody& body);                         ///< for contact tests
    void quarantine(int body, const std::string& what);  ///< takes it out of the world
    template <typename Concerned>
    [[nodiscard]] bool any_broken(Concerned concerned);     ///< of those here
    void quarantine_broken();                               ///< before the step
    void quarantine_results();                              ///< after the step
    [[nodiscard]] bool is_own(const Island& island) const;  ///< has an own body
    [[nodiscard]] bool any_awake() const;
    void place_driven(MovingBody& body);
    void set_driven(MovingBody& body, const BodyPath::Pose& now, const Eigen::Vector3d& velocity,
                    const Eigen::Vector3d& spin);
    void begin_motions();
    void end_motions();
    void find_forces();  // and who they wake
    [[nodiscard]] bool is_forced(int body) const;
    void gather();        // who takes part in the step
    void list_owned();    ///< fills `owned`
    void gather_pairs();  // own bodies and the ghosts that were placed
    void stop_at_planes(MovingBody& body, const Eigen::Vector3d& before) const;
    void dismiss_ghosts();  ///< at the end of a step
    void find_islands();    ///< of contacts and constraints
    void solve_islands();   ///< in order of ids, again where something unforeseen meets
    void start_solving();   ///< notes what solve_again goes back to; with partners each body once it changes
    void note_started(int body);
    void note_before_reading(int body);  ///< the same; leaves anything in its state
    void solve_island(const Island& island, bool follow, IslandSolver& by, const ContactScene& scene);
    /// Calls solve(island, solver, scene) for those in `to_solve`. first: of the step's rounds.
    void share_islands(const Solve& solve, bool first);
    void begin_again(const Island& island);
    std::vector<const Island*> to_solve, small;  // small: of them, for one thread each
    void note_found();                           ///< contacts, by the islands that have just been solved
    void move_alone(int body);                   ///< over the step
    void solve_again();                          ///< islands of bodies in `again`, from the step's start
    void hold_apart(const WorldContacts::Meeting& meeting);
    std::vector<WorldContacts::Meeting> last;  ///< what meets after all rounds
    void sum_outcomes();                       ///< of all islands
    [[nodiscard]] ContactScene contact_scene(Crew& crew);
    [[nodiscard]] bool is_held(const Island& island) const;
    [[nodiscard]] bool drifts(const Island& island) const;
    void put_to_sleep();                              ///< islands that are still
    void count_work();                                ///< see World::work
    void step();                                      ///< see World::step
    [[nodiscard]] int still_steps_to_sleep() const;   ///< half a second
    void tell_broken(std::uint64_t broken_before);    ///< constraints, of the step
    void tell_limited(std::uint64_t limited_before);  ///< bodies, of the step
};

}  // namespace sim
