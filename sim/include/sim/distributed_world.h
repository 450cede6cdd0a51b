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
// whole scene and owns some of its bodies. It goes on as fast as it can, but no more than a bound of steps ahead
// of the slowest. The application is the coordinator: it keeps the members and the owners of bodies, and relays
// messages. SI units, world frame, y up.

/// From a step on, worker `worker` takes `factor` times as long per step; 1 ends that.
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

/// A world and its events. Bodies are numbered: those of `world`, then those of `later` in the order of
/// their addition.
struct WorldScene {
    WorldDefinition world;
    std::vector<WorldBody> later;
    std::vector<WorldEvent> events;  ///< by ascending steps
};

struct MarketSettings {  ///< of the load balancing, thesis 2.4
    bool trade = true;
    std::uint64_t from_step = 0;  ///< no offers before the seller's step
    double smoothing_steps = 20;  ///< time constant of the smoothed seconds per work [steps]
    double dead_band = 0.1;       ///< share of the average by which a worker must be slower to offer
};

struct DistributedSettings {  ///< of a run; refused settings throw std::invalid_argument
    /// So many steps may a worker be ahead of the slowest that owns a body, and so old may a ghost be; 0: a barrier
    /// after each step.
    int bound = 4;
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
    double seconds = 0;      ///< worked, without waiting, by the clock that the run uses
    double smoothed_s = 0;   ///< the same, as smoothed for load balancing
    double waited_s = 0;     ///< waited before it, for other workers
    /// Processor time of the thread that steps (of a worker with several threads: of its process), with what it did for other workers since the step before; on
    /// simulated processors theirs.
    double processor_s = 0;
    int bodies = 0;     ///< own
    int lead = 0;       ///< steps ahead of the slowest that owned a body, as this worker knew at the start
    int ghost_age = 0;  ///< of the oldest used [steps]
    std::uint64_t bytes = 0;  ///< sent for this step
    int cross_contacts = 0;   ///< points between bodies of different owners that it resolved; both owners do
};

struct DistributedResult {    ///< of a whole run
    std::uint64_t steps = 0;  ///< done by every body
    double elapsed_s = 0;  ///< from the first step's start to the last one's end, of the clock that was used
    double cpu_s = 0;      ///< processor time of all workers' steps, see WorkerStep
    int workers = 0;       ///< the largest number at a time
    int lost = 0, left = 0;            ///< workers that died; that handed over and left
    int bodies_reowned = 0;            ///< bodies of those, given to other workers
    std::uint64_t migrations = 0;      ///< bodies that changed hands by trade
    std::uint64_t trades = 0;          ///< accepted offers
    std::uint64_t cross_contacts = 0;  ///< points, summed over steps
    std::uint64_t bytes = 0,
                  bytes_states = 0;      ///< sent by workers, every copy; of them state or update records
    std::uint64_t records = 0;           ///< state or update records sent
    std::uint64_t refused_messages = 0;  ///< malformed or stale ones
    int largest_lead = 0, largest_ghost_age = 0;                ///< [steps]
    Eigen::Vector3d outside_impulse = Eigen::Vector3d::Zero();  ///< see World::outside_impulse
    WorldCounts counts;                                         ///< summed over workers
    std::vector<QuarantinedBody> quarantined;                   ///< in order of steps; so are the next two
    std::vector<FirstStep> limited, broken;                     ///< see World::limited and World::broken
    bool one_owner = false;     ///< one worker stepped all bodies, which are too unlike to be shared out
    bool rest_reached = false;  ///< until_rest: every body came to rest
};

/// Where a run in one process is at the end of a step: all that its next steps and its result depend on, apart
/// from its scene and settings.
struct RunState {
    WorldSnapshot world;
    DistributedResult result;  ///< so far
};

/// For a file; see run_state.cpp for the layout.
[[nodiscard]] std::vector<std::uint8_t> encode(const RunState& state);
/// Throws InputError unless it is a state that a run of the scene can be in; no bytes make it read or allocate more than
/// they hold.
[[nodiscard]] RunState decode_run_state(std::span<const std::uint8_t> bytes, const WorldScene& scene);

/// Receives a run's progress. Calls come in order, from one thread.
class DistributedObserver {
public:
    virtual ~DistributedObserver() = default;
    /// Before at(), from step 1 on, in one process: `state` gives what a run goes on from that begins with at() of
    /// this step.
    virtual void done(std::uint64_t step, const std::function<RunState()>& state) { (void)step, (void)state; }
    /// `world`: all bodies at the end of step `step` (0: the start); of workers as published.
    virtual void at(std::uint64_t step, const World& world) { (void)step, (void)world; }
    /// After at(), perhaps more than once: `world` as the next step begins, with the events before it; after the last step as it ended.
    virtual void ready(std::uint64_t step, const World& world) { (void)step, (void)world; }
    virtual void worked(const WorkerStep& step) { (void)step; }             ///< a worker has published a step
    virtual void moved(std::uint64_t step, int bodies, int from, int to) {  ///< from -1: none
        (void)step, (void)bodies, (void)from, (void)to;
    }
    virtual void note(const std::string& what) { (void)what; }  ///< joins, losses, refusals, in words
};

/// Runs a scene in this process, without workers: bound and market of `settings` do not count, nor does who is
/// to be slower. elapsed_s and cpu_s are of the steps alone; each is told as worker 0's. `from`: goes on from
/// there, after at(0), to the same bits as without the interruption. So many `threads` share out each step
/// (World::use_threads); cpu_s is of the calling one, which takes part in all. Throws InputError for a scene that is refused.
DistributedResult run_alone(const WorldScene& scene, const DistributedSettings& settings,
                            DistributedObserver& observer, const RunState* from = nullptr, int threads = 1);

/// Where workers come from.
struct DistributedLaunch {
    WorkerLaunch processes;  ///< started here (none without a program), joined through a private folder's ipc
                             ///< socket or `listen`
    std::string listen;  ///< empty: ipc in a private folder; else tcp://ADDRESS:PORT (PORT * or 0: any), also
                         ///< for workers started elsewhere
    int expect = 0;      ///< wait for so many workers before the first step (at least processes.count)
    double wait_s = 60;  ///< for them; then the run begins without those that have not come
    double silence_s = 1;        ///< a worker silent for so long is lost
    double longest_step_s = 30;  ///< a worker for which all have waited for so long is given up
    std::filesystem::path keys;  ///< folder made by make_keys; needed unless ipc or loopback
    std::function<void(const std::string& endpoint)> listening;  ///< called once, with the bound endpoint
};

/// Runs a scene on worker processes over ZeroMQ. Returns when all steps are done. A lost worker's bodies go
/// on elsewhere; if none is left, in this process. Throws InputError for a scene or setting that is
/// refused, WorkerError if workers cannot be started, or none was and none joined.
DistributedResult run_distributed(const WorldScene& scene, const DistributedSettings& settings,
                                  const DistributedLaunch& launch, DistributedObserver& observer);

/// Writes CURVE keys into a new folder (0700): application.key (secret, 0600), application.pub, and for each
/// worker NAME NAME.key (its secret and public keys and the application's public one: all that it needs), and
/// `allowed`, the public keys and names, a line each. Throws InputError for a name or folder that cannot be
/// (nothing is overwritten), WorkerError if it cannot be written.
void make_keys(const std::filesystem::path& folder, const std::vector<std::string>& workers);

/// A worker's process: joins the application at `endpoint`, of a world or of a kit, and serves until the run
/// ends. SIGTERM or SIGINT: hands its bodies over and leaves. `key`: file made by make_keys, empty: none. `threads`
/// share out the steps of a world (World::use_threads). Returns the exit status. Throws InputError for an endpoint or key that is refused, WorkerError
/// if nobody answers.
[[nodiscard]] int run_worker(const std::string& endpoint, const std::filesystem::path& key = {},
                             int threads = 1);

}  // namespace sim
