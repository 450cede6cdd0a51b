#pragma once
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "sim/simulation.h"
#include "sim/world.h"

namespace sim {

// One world simulated by several workers (thesis 2.1, 2.3, 2.4). Every worker is a process that knows the
// whole scene and owns some of its bodies; the application is where they meet: it keeps who is there and who
// owns what, and passes messages on.

/// A worker does every step `factor` times slower from a step on.
struct Slowing {
    int worker = 0;
    double factor = 1;
};

/// What happens before a step: constraints go, bodies come, a worker slows down.
struct WorldEvent {
    std::uint64_t step = 0;          ///< before this one, counted from 0
    std::vector<int> removed;        ///< constraints, by number
    std::size_t first = 0, end = 0;  ///< of `later`
    std::vector<Slowing> slowing;
};

/// A world with its future. Bodies are numbered: those of `world`, then `later` in the order in which they
/// come.
struct WorldScene {
    WorldDefinition world;
    std::vector<WorldBody> later;
    std::vector<WorldEvent> events;  ///< by ascending steps
};

enum class Pace {
    lockstep,  ///< to the bit as in one process
    bounded    ///< each worker as fast as it can, at most `bound` steps ahead of the slowest that owns a body
};

struct MarketSettings {
    bool trade = true;
    std::uint64_t from_step = 0;  ///< no offers before the seller's step
    double smoothing_steps = 3;   ///< time constant of the smoothed seconds a step
    double dead_band = 0.08;      ///< share of the average by which a worker must be slower to offer
};

struct DistributedSettings {
    Pace pace = Pace::lockstep;
    int bound = 0;            ///< [steps]; also the greatest age of a ghost
    std::uint64_t steps = 0;  ///< at most
    bool until_rest =
        false;  ///< stop before when every body has been still for half a second and no event is left
    bool all_to_first =
        false;  ///< at first one worker owns every body; else each gets neighbours, in equal numbers
    MarketSettings market;
};

/// One step of one worker.
struct WorkerStep {
    int worker = 0;          ///< number in order of joining, never used again
    std::uint64_t step = 0;  ///< number of the step that ended
    double seconds = 0;      ///< that it worked
    double smoothed_s = 0;   ///< the market's view of it
    double waited_s = 0;     ///< before it, for others
    int bodies = 0;          ///< own
    int lead = 0;       ///< steps ahead of the slowest that owned a body, as this worker knew at the start
    int ghost_age = 0;  ///< of the oldest used [steps]
    std::uint64_t bytes = 0;  ///< sent for this step
    int cross_contacts = 0;   ///< points between bodies of different owners that it resolved
};

/// Told in order, from one thread.
class DistributedObserver {
public:
    virtual ~DistributedObserver() = default;
    /// `world`: all bodies at the end of step `step` (0: the start), exact in lockstep, else as published.
    virtual void at(std::uint64_t step, const World& world) { (void)step, (void)world; }
    virtual void worked(const WorkerStep& step) { (void)step; }
    virtual void moved(std::uint64_t step, int bodies, int from, int to) {
        (void)step, (void)bodies, (void)from, (void)to;
    }
    virtual void note(const std::string& what) { (void)what; }  ///< joins, losses, refusals, in words
};

struct DistributedResult {
    std::uint64_t steps = 0;  ///< that every body has done
    double elapsed_s = 0;  ///< from the first step's start to the last one's end, of the clock that was used
    double cpu_s = 0;      ///< of all workers' steps
    int workers = 0;       ///< most at a time
    int lost = 0, left = 0;  ///< workers that died, that drained
    int bodies_reowned = 0;
    std::uint64_t migrations = 0;  ///< bodies that changed hands by trade
    std::uint64_t trades = 0;
    std::uint64_t cross_contacts = 0;           ///< points, summed over steps
    std::uint64_t bytes = 0, bytes_states = 0;  ///< sent by workers; of them state or update records
    std::uint64_t records = 0;                  ///< state or update records sent
    std::uint64_t refused_messages = 0;
    int largest_lead = 0, largest_ghost_age = 0;
    Eigen::Vector3d outside_impulse = Eigen::Vector3d::Zero();  ///< see World::outside_impulse
    WorldCounts counts;                                         ///< summed over workers
    std::vector<QuarantinedBody> quarantined;
    bool rest_reached = false;
};

/// Where workers come from.
struct DistributedLaunch {
    WorkerLaunch processes;  ///< started here (none without a program), joined through a private folder's ipc
                             ///< socket or `listen`
    std::string listen;  ///< empty: ipc in a private folder; else tcp://ADDRESS:PORT (PORT * or 0: any), also
                         ///< for workers started elsewhere
    int expect = 0;      ///< wait for so many workers before the first step (at least processes.count)
    double wait_s = 60;  ///< for them
    std::filesystem::path keys;  ///< folder made by make_keys; needed unless ipc or loopback
    std::function<void(const std::string& endpoint)> listening;  ///< told where, once
};

/// Runs a scene on worker processes over ZeroMQ. Returns when all steps are done. A lost worker's bodies go
/// on elsewhere; if none is left, in this process. Throws std::invalid_argument for a scene or setting that
/// is refused, std::runtime_error if nobody joins.
DistributedResult run_distributed(const WorldScene& scene, const DistributedSettings& settings,
                                  const DistributedLaunch& launch, DistributedObserver& observer);

/// Simulated processors: workers in this process, each with a clock of its own that goes on by what its work
/// costs; messages arrive `latency_s` after they were sent; events happen in the order of simulated time.
struct SimulatedProcessors {
    int count = 1;
    double latency_s = 2e-4;  ///< from worker to worker
    double slowdown = 1;      ///< simulated seconds a second of this thread's processor time
    bool modelled =
        false;  ///< costs are counted (World::work), not measured: results are a pure function of the input
    double seconds_per_work = 2e-6;  ///< modelled: of one unit of work
    /// A further factor of a worker's step, such as a straggler's; empty: none.
    std::function<double(int worker, std::uint64_t step)> factor;
    /// Failures at simulated times, for tests.
    struct Failure {
        double time_s;
        int worker;
        enum class Kind { kill, stop, resume, cut, drain, join } kind;
    };
    std::vector<Failure> failures;
    double silence_s = 1;  ///< a worker unheard for so long is dead
};

DistributedResult simulate_processors(const WorldScene& scene, const DistributedSettings& settings,
                                      const SimulatedProcessors& processors, DistributedObserver& observer);

/// Hash of a libm probe, the processor's features in use, the compiler, the protocol's version and a small
/// world's state after some steps: equal where lockstep is to the bit.
[[nodiscard]] std::uint64_t step_fingerprint();

/// Writes CURVE keys into a new folder (0700): application.key (secret, 0600), application.pub, and for each
/// worker NAME NAME.key (its secret and public keys and the application's public one: all that it needs), and
/// `allowed`, the public keys and names, a line each. Throws std::invalid_argument for a name or folder that
/// cannot be (nothing is overwritten), std::runtime_error if it cannot be written.
void make_keys(const std::filesystem::path& folder, const std::vector<std::string>& workers);

/// A worker's process: joins the application at `endpoint`, of a world or of a kit, and serves until told to
/// stop. SIGTERM or SIGINT: gives its bodies away and leaves. `key`: file made by make_keys, empty: none.
/// Returns the exit status. Throws std::invalid_argument for an endpoint or key that is refused.
[[nodiscard]] int run_worker(const std::string& endpoint, const std::filesystem::path& key);

}  // namespace sim
