#pragma once
#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "sim/simulation.h"
#include "sim/world.h"

namespace sim {

// One world simulated by several workers (thesis 2.1, 2.3, 2.4). Every worker is a process that knows the
// whole scene and owns some of its bodies. It steps them as fast as it can, but is at most a bound of steps
// ahead of the slowest worker. The application is the coordinator: it keeps the members and the owners of
// bodies, and relays messages. SI units, world frame, y up.

/// From the event on, worker `worker` takes `factor` times as long per step. A factor of 1 ends that.
struct Slowing {
    int worker = 0;
    double factor = 1;
};

/// An event before a step: constraints are removed, bodies added, a worker slowed down.
struct WorldEvent {
    std::uint64_t step = 0;          ///< before this one, counted from 0
    std::vector<int> removed;        ///< constraints, by number
    std::size_t first = 0, end = 0;  ///< bodies added: indices of `later`, from first to before end
    std::vector<Slowing> slowing;
};

/// A world and its events. The bodies of `world` have the first numbers. Then come those of `later`, in the
/// order in which they are added.
struct WorldScene {
    WorldDefinition world;
    std::vector<WorldBody> later;
    std::vector<WorldEvent> events;  ///< by ascending steps
};

struct MarketSettings {  ///< of the load balancing, thesis 2.4
    bool trade = true;
    std::uint64_t from_step = 0;  ///< the seller's first step with offers
    double smoothing_steps = 20;  ///< time constant of the smoothed seconds per work [steps]
    double dead_band = 0.1;       ///< share of the average by which a worker must be slower to offer
};

/// Settings of a run. Refused settings throw std::invalid_argument.
struct DistributedSettings {
    /// Most steps that a worker may be ahead of the slowest one that owns a body; 0: a barrier after each
    /// step.
    int bound = 4;
    std::uint64_t steps = 0;  ///< at most
    /// The run ends earlier when every body has been still for half a second and no event is left.
    bool until_rest = false;
    /// At first one worker owns every body. Otherwise each one gets as many, which are near each other.
    bool all_to_first = false;
    MarketSettings market;
};

/// One step of one worker.
struct WorkerStep {
    int worker = 0;          ///< number, in the order of joining; no number is used again
    std::uint64_t step = 0;  ///< number of the step that ended
    double seconds = 0;      ///< work without waiting, by the run's clock
    double smoothed_s = 0;   ///< the same, as smoothed for load balancing
    double waited_s = 0;     ///< waiting for other workers before the step
    /// Processor time of the stepping thread (of the process, if the worker has several threads), with the
    /// messages since the step before; on simulated processors by their clocks.
    double processor_s = 0;
    int bodies = 0;           ///< own
    int lead = 0;             ///< steps ahead of the slowest owner, as known at the start of the step
    int ghost_age = 0;        ///< of the oldest ghost [steps]
    std::uint64_t bytes = 0;  ///< sent for this step
    int cross_contacts = 0;   ///< contact points with others' bodies; both owners resolve and count them
};

/// The result of a whole run.
struct DistributedResult {
    std::uint64_t steps = 0;       ///< done by every body
    double elapsed_s = 0;          ///< from the first step's start to the last one's end, by the run's clock
    double cpu_s = 0;              ///< processor time of all workers' steps, see WorkerStep
    int workers = 0;               ///< the largest number at a time
    int lost = 0, left = 0;        ///< workers that died; workers that left in order
    int bodies_reowned = 0;        ///< bodies of lost workers, given to other workers
    std::uint64_t migrations = 0;  ///< bodies that changed owners by trade
    std::uint64_t trades = 0;      ///< accepted offers
    std::uint64_t cross_contacts = 0;                           ///< points, summed over steps
    std::uint64_t bytes = 0;                                    ///< sent by workers, every copy
    std::uint64_t bytes_states = 0;                             ///< the part of state and update messages
    std::uint64_t records = 0;                                  ///< records in state and update messages
    std::uint64_t refused_messages = 0;                         ///< malformed or stale ones
    int largest_lead = 0, largest_ghost_age = 0;                ///< [steps]
    Eigen::Vector3d outside_impulse = Eigen::Vector3d::Zero();  ///< see World::outside_impulse
    WorldCounts counts;                        ///< of one process; with workers the steps alone
    std::vector<QuarantinedBody> quarantined;  ///< in order of steps; so are the next two
    std::vector<FirstStep> limited, broken;    ///< see World::limited and World::broken
    bool one_owner = false;     ///< one worker owned all bodies, as they are too unlike to be shared out
    bool rest_reached = false;  ///< until_rest: every body came to rest
};

/// The state of a run in one process at the end of a step: all that its next steps and its result depend on,
/// besides its scene and settings.
struct RunState {
    WorldSnapshot world;
    DistributedResult result;  ///< so far
};

/// The bytes of a file; run_state.cpp describes the layout.
[[nodiscard]] std::vector<std::uint8_t> encode(const RunState& state);
/// Throws InputError unless a run of the scene can have this state. Whatever the bytes are, it reads and
/// allocates no more than they hold.
[[nodiscard]] RunState decode_run_state(std::span<const std::uint8_t> bytes, const WorldScene& scene);

/// Receives a run's progress. Calls come in order, from one thread.
class DistributedObserver {
public:
    virtual ~DistributedObserver() = default;
    /// In one process, from step 1 on, before at(): `state` returns the state from which another run can
    /// continue. That run begins with at() of this step.
    virtual void done(std::uint64_t step, const std::function<RunState()>& state) { (void)step, (void)state; }
    /// `world`: all bodies at the end of step `step` (0: the start), as the workers published them.
    virtual void at(std::uint64_t step, const World& world) { (void)step, (void)world; }
    /// After at(), perhaps more than once: `world` at the beginning of the next step, with the events before
    /// it; after the last step at its end.
    virtual void ready(std::uint64_t step, const World& world) { (void)step, (void)world; }
    virtual void worked(const WorkerStep& step) { (void)step; }  ///< a worker has published a step
    /// Bodies changed owners; `from` -1: they had none.
    virtual void moved(std::uint64_t step, int bodies, int from, int to) {
        (void)step, (void)bodies, (void)from, (void)to;
    }
    virtual void note(const std::string& what) { (void)what; }  ///< joins, losses, refusals, in words
};

/// Runs a scene in this process, without workers. The bound and the market of `settings` and slowed workers
/// are ignored. Steps are reported as worker 0's. elapsed_s and cpu_s are of the steps alone; cpu_s is of the
/// calling thread. `from`: continues from this state, after at(0), to the same bits as without the
/// interruption. `threads` share out each step (World::use_threads). Throws InputError for a scene that is
/// refused.
DistributedResult run_alone(const WorldScene& scene, const DistributedSettings& settings,
                            DistributedObserver& observer, const RunState* from = nullptr, int threads = 1);

/// Where workers come from.
struct DistributedLaunch {
    /// Started here; none without a program. They join through an ipc socket in a private folder.
    WorkerLaunch processes;
    /// tcp://ADDRESS:PORT (PORT * or 0: any) for workers that are started elsewhere; empty: ipc alone.
    std::string listen;
    int expect = 0;              ///< workers to wait for before the first step, at least processes.count
    double wait_s = 60;          ///< for these; then the run begins without those that have not come
    double silence_s = 1;        ///< a worker that is silent for this long is lost
    double longest_step_s = 30;  ///< a worker for which all others have waited for this long is lost
    std::filesystem::path keys;  ///< folder made by make_keys; needed unless ipc or loopback
    std::function<void(const std::string& endpoint)> listening;  ///< called once, with the bound endpoint
};

/// Runs a scene on worker processes over ZeroMQ. Returns when all steps are done. A lost worker's bodies go
/// to other workers, or to this process if none is left. Throws InputError for a scene or setting that is
/// refused, WorkerError if workers cannot be started, or if none was started and none joined.
DistributedResult run_distributed(const WorldScene& scene, const DistributedSettings& settings,
                                  const DistributedLaunch& launch, DistributedObserver& observer);

/// Writes CURVE keys into a new folder (0700): application.key (secret, 0600), application.pub, for each
/// worker NAME a file NAME.key with all keys that it needs (its secret and public keys, the application's
/// public key), and `allowed` with a public key and a name a line. Throws InputError for an invalid name or
/// an existing folder, WorkerError if it cannot write.
void make_keys(const std::filesystem::path& folder, const std::vector<std::string>& workers);

/// The process of a worker: joins the application at `endpoint`, which runs a world or a play, and serves
/// until the run ends. At SIGTERM or SIGINT it sells its bodies and leaves. `key`: a file made by make_keys;
/// empty: none. `threads` share out the steps of a world (World::use_threads). Returns the exit status.
/// If nobody answers, or the run fails, a line goes to standard error. Throws InputError for an endpoint or key that
/// is refused.
[[nodiscard]] int run_worker(const std::string& endpoint, const std::filesystem::path& key = {},
                             int threads = 1);

}  // namespace sim
