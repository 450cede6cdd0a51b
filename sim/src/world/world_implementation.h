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

constexpr std::size_t kBodiesAPiece = 32;  ///< bodies that a thread takes at once: some microseconds of work

/// A world and the stages of its step, in the order of step(). One source for each group below.
struct World::Implementation {
    // What is in it; world.cpp.
    WorldSettings settings;
    std::vector<WorldPlane> planes;
    std::vector<WorldBody> definitions;
    std::vector<std::unique_ptr<BodyKind>> kinds;
    std::vector<MovingBody> bodies;
    std::vector<HeldConstraint> constraints;
    std::vector<std::pair<int, int>>
        joined;                      ///< pairs that a constraint joins and that do not collide, ascending
    std::vector<TimedForce> forces;  ///< ascending by bodies
    WorldCounts counts;
    Eigen::Vector3d outside = Eigen::Vector3d::Zero();  ///< see World::outside_impulse

    int add(const WorldBody& body);  ///< returns its id
    const BodyKind* kind_of(const WorldBody& body);
    void set_joined();
    void pose(MovingBody& body);  ///< its shape and place for contact tests
    void make_solvers();          ///< one a thread

    // A step; world_step.cpp.
    std::vector<int> participants;  ///< bodies that take part in the step, ascending
    StepContacts contacts;
    Eigen::Vector3d outside_before = Eigen::Vector3d::Zero();  ///< `outside`, when the step began

    void step();
    void begin_step();  ///< motions, forces, participants
    void end_step();
    void gather();  ///< fills `participants`
    [[nodiscard]] bool any_awake() const;
    void pose_bodies();
    void list_broken();   ///< constraints that broke in the step
    void list_limited();  ///< bodies whose deformation was held in the step
    void count_work();    ///< see SharedWorld::work, and counts

    // Bodies whose state is not finite; world_step.cpp.
    std::vector<QuarantinedBody> quarantined;
    std::vector<FirstStep> limited, broken;
    bool all_whole = false;  ///< no own body is broken: nothing has changed them since that was checked

    void quarantine_broken();                            ///< before a step, before they touch others
    void quarantine_results();                           ///< after a step, before any reader sees them
    void quarantine(int body, const std::string& what);  ///< takes it out of the world
    void drop_constraints(int body);                     ///< of a body that is taken out
    template <typename Concerned>
    [[nodiscard]] bool any_broken(Concerned concerned);

    // Prescribed motions and timed forces; driven_bodies.cpp, timed_forces.cpp.
    std::vector<ActiveForce> active;  ///< forces that act within the step, ascending by bodies

    void begin_motions();
    void end_motions();
    void place_driven(MovingBody& body);
    void set_driven(MovingBody& body, const PrescribedState& now);
    void find_forces();  ///< fills `active`, and wakes their bodies
    [[nodiscard]] bool is_forced(int body) const;

    // Islands and sleep; world_islands.cpp.
    std::vector<Island> islands;  ///< the first `islands_used` count
    std::size_t islands_used = 0;
    DisjointSets sets;                          ///< of bodies that contacts and constraints join
    std::vector<int> place;                     ///< of a set's first body: its place among the islands
    std::vector<std::pair<int, int>> touching;  ///< of each contact: its bodies that move, or -1

    void find_islands();
    [[nodiscard]] bool is_own(const Island& island) const;   ///< has an own body
    [[nodiscard]] bool is_held(const Island& island) const;  ///< something that does not move holds it
    [[nodiscard]] bool drifts(const Island& island) const;   ///< it goes on, or would fall
    [[nodiscard]] int still_steps_to_sleep() const;
    void put_to_sleep();

    // Solving islands, again where bodies met unforeseen; solve_islands.cpp.
    using Solve = std::function<void(const Island&, IslandSolver&, const ContactScene&)>;
    /// What solving an island changed besides the bodies' states; kept at its first body.
    struct Outcome {
        Eigen::Vector3d outside = Eigen::Vector3d::Zero();
        std::uint64_t limited = 0, broken = 0;
        bool carried = false;             ///< it touches what moves as prescribed
        bool found = false;               ///< contacts were found again within the step:
        std::vector<Manifold> manifolds;  ///< those
    };
    std::unique_ptr<Crew> crew = std::make_unique<Crew>();  ///< threads that share the work of a step
    Crew alone;
    std::vector<std::unique_ptr<IslandSolver>> solvers;  ///< one a thread
    std::vector<Outcome> outcomes;                       ///< of each body
    std::vector<const Island*> to_solve, small;          ///< in this round; of them, for one thread each
    std::vector<std::uint8_t> solved, again;  ///< of each body: its island was solved; has to be once more
    bool solving = false;                     ///< the step has come so far, and the following hold:
    std::vector<WorldBodyState> started;      ///< states when the step began, of bodies that are solved
    std::vector<std::uint8_t> at_limit_before;
    std::vector<SpringRecord> springs_before;
    std::vector<StepContacts::Meeting> last;  ///< what meets after all rounds

    [[nodiscard]] IslandSolver& solver() const noexcept { return *solvers.front(); }
    [[nodiscard]] ContactScene contact_scene(Crew& by);
    void solve_islands();
    void start_solving();
    void share_islands(const Solve& solve);  ///< calls solve(island, solver, scene) for those in `to_solve`
    [[nodiscard]] bool is_by_one(const Island& island) const;  ///< thread
    void solve_island(const Island& island, bool follow, IslandSolver& by, const ContactScene& scene);
    void move_alone(int body);
    void note_found();
    void solve_again();
    void begin_again(const Island& island);
    void hold_apart(const StepContacts::Meeting& meeting);
    void sum_outcomes();

    // State taken and taken back to; world_snapshot.cpp.
    void record(int body, WorldRecord& out) const;
    void restore(const WorldRecord& record);
    void restore(const std::vector<SpringRecord>& springs);
    [[nodiscard]] SpringRecord spring_record(std::size_t constraint) const;
    bool restore_spring(const SpringRecord& record);  ///< whether it held otherwise
    void set_step(std::uint64_t step);

    // A world that is shared; shared_world.cpp.
    struct Ball {
        Eigen::Vector3d center;
        double radius;
    };
    bool shared = false;          ///< see SharedWorld
    std::vector<int> owned;       ///< own and fixed bodies, ascending
    std::vector<int> placed;      ///< ghosts of the next step
    std::vector<int> arrived;     ///< bodies that became own since the last step
    std::vector<Ball> own_balls;  ///< that hold own bodies over the next step
    int cross_contacts = 0;       ///< points between own bodies and ghosts, in the last step

    void list_owned();  ///< fills `owned`
    void gather_shared();
    void dismiss_ghosts();
    [[nodiscard]] bool near_own(const Eigen::Vector3d& center, double radius) const;
    void stop_at_planes(MovingBody& body, const Eigen::Vector3d& before) const;
};

}  // namespace sim
