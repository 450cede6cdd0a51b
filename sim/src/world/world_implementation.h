#pragma once
#include <functional>
#include <memory>
#include <vector>

#include "body/prescribed_motion.h"
#include "contact/crew.h"
#include "contact/step_contacts.h"
#include "sim/world.h"
#include "solver/island_solver.h"
#include "world/disjoint_sets.h"

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
    StepContacts contacts;
    std::vector<std::unique_ptr<IslandSolver>> solvers;     // one a thread
    std::unique_ptr<Crew> crew = std::make_unique<Crew>();  ///< who shares the work of a step
    Crew alone;
    [[nodiscard]] IslandSolver& solver() const noexcept { return *solvers.front(); }
    void make_solvers();  ///< one a thread
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
    std::vector<SpringRecord> springs_before;   // then
    std::vector<std::uint8_t> solved,
        again;  // of each body: its island went through the solver, and has to once more
    WorldCounts counts;
    std::vector<QuarantinedBody> quarantined;
    std::vector<FirstStep> limited, broken;
    Eigen::Vector3d outside = Eigen::Vector3d::Zero();         // impulse, see World::outside_impulse
    Eigen::Vector3d outside_before = Eigen::Vector3d::Zero();  // when the last step began

    std::vector<int> here;  // bodies that take part in the step, ascending

    using Solve = std::function<void(const Island&, IslandSolver&, const ContactScene&)>;
    bool solving = false;    ///< the step has come so far
    bool all_whole = false;  ///< no own body is broken: nothing has changed them since that was seen
    // Sharing.
    bool shared = false;       ///< see SharedWorld
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
    void record(int body, WorldRecord& out) const;
    void restore(const WorldRecord& record);
    void restore(const std::vector<SpringRecord>& springs);
    void set_step(std::uint64_t step);
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
    void set_driven(MovingBody& body, const PrescribedState& now);
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
    void start_solving();   ///< notes what solve_again goes back to
    void solve_island(const Island& island, bool follow, IslandSolver& by, const ContactScene& scene);
    [[nodiscard]] bool is_by_one(const Island& island) const;
    /// Calls solve(island, solver, scene) for those in `to_solve`.
    void share_islands(const Solve& solve);
    void begin_again(const Island& island);
    std::vector<const Island*> to_solve, small;  // small: of them, for one thread each
    void note_found();                           ///< contacts, by the islands that have just been solved
    void move_alone(int body);                   ///< over the step
    void solve_again();                          ///< islands of bodies in `again`, from the step's start
    void hold_apart(const StepContacts::Meeting& meeting);
    std::vector<StepContacts::Meeting> last;  ///< what meets after all rounds
    void sum_outcomes();                      ///< of all islands
    [[nodiscard]] ContactScene contact_scene(Crew& crew);
    [[nodiscard]] bool is_held(const Island& island) const;
    [[nodiscard]] bool drifts(const Island& island) const;
    void put_to_sleep();                             ///< islands that are still
    void count_work();                               ///< see World::work
    void step();                                     ///< see World::step
    [[nodiscard]] int still_steps_to_sleep() const;  ///< half a second
    void list_broken();                              ///< constraints, of the step
    void list_limited();                             ///< bodies, of the step
    void begin_step();
    void end_step();
    void pose_bodies();
};

}  // namespace sim
