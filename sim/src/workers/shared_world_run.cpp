#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "messages/world_scene_codec.h"
#include "run/elapsed_time.h"
#include "shared/coordinator.h"
#include "shared/shared_world_worker.h"
#include "sim/errors.h"
#include "workers/worker_gate.h"
#include "workers/worker_process.h"

namespace sim {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;
constexpr auto kWait = 20ms;
constexpr auto kEndWithin = 1s;
constexpr double kLastWords_s = 0.3;
constexpr int kMostWorkers = 256;

std::string seconds(double s) {
    return std::to_string(std::lround(s)) + " s";
}

/// A worker in this process, for when no other is left.
class WorkerHere {
public:
    explicit WorkerHere(std::uint32_t number) : number_(number) {}
    [[nodiscard]] std::uint32_t number() const { return number_; }

    void receive(const std::vector<std::uint8_t>& bytes) {
        const double processor = thread_processor_s();
        DecodedMessage m = decode_message(bytes);
        if (const auto* scene = std::get_if<SceneMessage>(&m.message))
            worker_.emplace(*scene);
        else if (worker_)
            worker_->receive(m.header, std::move(m.message));
        messages_s_ += thread_processor_s() - processor;
    }
    /// Does a step if one can be done now; returns whether it did.
    bool step() {
        if (!worker_ || worker_->ended()) return false;
        if (worker_->awaits_answer())
            worker_->stop_waiting_for_answer();  // messages come only between its steps
        if (!worker_->ready()) return false;
        const Clock::time_point start = Clock::now();
        const double processor = thread_processor_s();
        worker_->step();
        const double spent = std::exchange(messages_s_, 0) + thread_processor_s() - processor;
        worker_->end_step({seconds_since(start), 0, spent});
        return true;
    }
    [[nodiscard]] std::vector<std::vector<std::uint8_t>> outgoing() {
        return worker_ ? worker_->outgoing() : std::vector<std::vector<std::uint8_t>>();
    }

private:
    std::uint32_t number_;
    std::optional<SharedWorldWorker> worker_;
    double messages_s_ = 0;  ///< processor time for messages since the last step
};

class SharedWorldRun {
public:
    SharedWorldRun(const WorldScene& scene, const DistributedSettings& settings,
                   const DistributedLaunch& launch, DistributedObserver& observer)
        : launch_(launch),
          processes_(launch.processes.program.empty() ? 0 : launch.processes.count),
          observer_(observer),
          coordinator_(scene, settings, observer),
          gate_(gate_settings(scene, settings, launch)) {
        if (launch.listening)
            launch.listening(launch.listen.empty() ? gate_.private_endpoint() : gate_.endpoint());
        children_.reserve(static_cast<std::size_t>(processes_));
        for (int i = 0; i < processes_; ++i) {
            const Secret secret = make_secret();
            gate_.expect(secret);
            children_.push_back({WorkerProcess(launch.processes, gate_.private_endpoint(), secret)});
        }
    }

    DistributedResult run() {
        wait_for_workers();
        started_ = true;
        progressed_ = Clock::now();
        coordinator_.start();
        const Clock::time_point start = Clock::now();
        while (!coordinator_.finished()) advance();
        DistributedResult result = coordinator_.result();
        result.elapsed_s = seconds_since(start);
        result.refused_messages += gate_.refused_messages() + gate_.refused_keys();
        end_children();
        return result;
    }

private:
    struct Child {
        WorkerProcess process;
        std::optional<std::uint32_t> worker = std::nullopt;     ///< once it has joined
        std::optional<Clock::time_point> ended = std::nullopt;  ///< when its end was noticed
    };

    /// A worker may get at once: the messages of each other worker for the steps by which it is behind, if it
    /// joins late; and the new owner of each body, after a loss.
    static WorkerGate::Settings gate_settings(const WorldScene& scene, const DistributedSettings& run,
                                              const DistributedLaunch& launch) {
        WorkerGate::Settings settings;
        settings.silence_s = launch.silence_s;
        settings.listen = launch.listen;
        // Workers remove the folder of an application that was killed. So there is a folder only if there are
        // workers.
        settings.in_folder =
            launch.listen.empty() || (launch.processes.count > 0 && !launch.processes.program.empty());
        const auto bodies = static_cast<int>(scene.world.bodies.size() + scene.later.size());
        // The others do not wait for a worker that owns nothing. While it is silent they may do many steps of
        // few bodies.
        settings.most_waiting =
            1000 + 4 * bodies + 4 * (run.bound + 2) * kMostWorkers + 500'000 / std::max(bodies, 1);
        settings.largest_message = largest_message(scene);
        if (!launch.keys.empty()) settings.keys = read_application_keys(launch.keys);
        return settings;
    }

    void advance() {
        const bool worked = here_ && here_->step();
        for (WorkerGate::Event& event : gate_.wait(worked ? 0ms : kWait)) {
            handle(event);
            relay();  // at once, as others wait for it
            coordinator_.advance();
        }
        check_children();
        if (coordinator_.members().empty() && !coordinator_.finished()) take_over();
        check_progress();
        relay();
        note_refusals();
    }

    /// A worker may send messages, but not the states for which all wait.
    void check_progress() {
        // A worker that has just got the bodies of a lost one has the full time again.
        const std::pair now(coordinator_.steps(), coordinator_.result().bodies_reowned);
        if (std::exchange(progress_, now) != now) progressed_ = Clock::now(), waiting_noted_ = false;
        if (seconds_since(progressed_) > launch_.longest_step_s / 2 && !std::exchange(waiting_noted_, true))
            coordinator_.note_waiting();
        if (seconds_since(progressed_) < launch_.longest_step_s) return;
        progressed_ = Clock::now(), waiting_noted_ = false;
        coordinator_.lose_slowest("all have waited for its bodies for " + seconds(launch_.longest_step_s));
    }

    void wait_for_workers() {
        const auto wanted = static_cast<std::size_t>(std::max({launch_.expect, processes_, 1}));
        const Clock::time_point start = Clock::now();
        while (coordinator_.members().size() + ended_early_ < wanted) {
            for (WorkerGate::Event& event : gate_.wait(kWait)) handle(event);
            check_children();
            relay();
            note_refusals();
            if (seconds_since(start) > launch_.wait_s) return go_without_the_rest(wanted);
        }
    }

    /// A worker that is stopped, or cannot reach this process, does not hold up the others.
    void go_without_the_rest(std::size_t wanted) {
        const std::string joined = std::to_string(coordinator_.members().size()) + " of " +
                                   std::to_string(wanted) + " workers joined within " +
                                   seconds(launch_.wait_s);
        if (coordinator_.members().size() == 0 && children_.empty()) throw WorkerError(joined);
        for (Child& child : children_)
            if (!child.worker && !child.ended) child.process.kill();
        observer_.note(joined + ": the run begins without the others");
    }

    void handle(WorkerGate::Event& event) {
        using Kind = WorkerGate::Event::Kind;
        if (event.kind == Kind::asks_to_join)
            join(event);
        else if (event.kind == Kind::message)
            coordinator_.receive(event.worker, event.bytes);
        else if (coordinator_.is_member(event.worker)) {
            lost_.push_back(event.worker);
            coordinator_.lose(event.worker, event.why);
        }
    }

    void join(const WorkerGate::Event& event) {
        const auto child = std::find_if(children_.begin(), children_.end(), [&](const Child& c) {
            return !c.worker && !c.ended && c.process.secret() == event.request.secret;
        });
        if (child == children_.end() && coordinator_.members().size() >= kMostWorkers)
            return gate_.refuse(event.stranger, "all places are taken");
        const std::uint32_t worker = coordinator_.join(event.request);
        gate_.admit(event.stranger, worker, event.request.secret);
        admitted_.push_back(worker);
        if (child != children_.end()) child->worker = worker;
    }

    void check_children() {
        for (Child& child : children_) {
            if (child.worker && !coordinator_.is_member(*child.worker) && was_lost(*child.worker))
                child.process.kill();
            if (!child.process.has_ended()) continue;
            if (!child.ended) {
                child.ended = Clock::now();
                if (!child.worker)
                    note_early_end(child);
                else if (!started_)
                    ++ended_early_;
            }
            // A process that left in order has said so, but its message may still be on its way.
            const bool settled = child.process.was_killed() || seconds_since(*child.ended) > kLastWords_s;
            if (settled && child.worker && coordinator_.is_member(*child.worker))
                coordinator_.lose(*child.worker, child.process.ending());
        }
    }

    void note_early_end(const Child& child) {
        if (!child.process.was_killed())
            throw WorkerError("a worker ended before it joined: " + child.process.ending());
        ++ended_early_;
    }

    /// A worker that left in order is not lost: it ends by itself.
    [[nodiscard]] bool was_lost(std::uint32_t worker) const {
        return std::find(lost_.begin(), lost_.end(), worker) != lost_.end();
    }

    void take_over() {
        here_.emplace(coordinator_.join({{}, "here"}));
        observer_.note("no worker is left: the application goes on by itself");
    }

    void relay() {
        for (bool more = true; more;) {
            for (Coordinator::Outgoing& out : coordinator_.outgoing()) deliver(out);
            more = false;
            if (here_)
                for (const std::vector<std::uint8_t>& bytes : here_->outgoing())
                    coordinator_.receive(here_->number(), bytes), coordinator_.advance(), more = true;
        }
        std::erase_if(admitted_, [this](std::uint32_t worker) {
            if (coordinator_.is_member(worker)) return false;
            gate_.dismiss(worker);
            return true;
        });
    }

    void deliver(Coordinator::Outgoing& out) {
        if (here_ && std::erase(out.to, here_->number()) > 0) here_->receive(*out.bytes);
        if (!out.to.empty()) gate_.send(out.to, std::move(out.bytes));
    }

    void note_refusals() {
        if (!keys_noted_ && gate_.refused_keys() > 0) {
            keys_noted_ = true;
            observer_.note("a worker without a key that is allowed here asks to join: it is not answered");
        }
        if (!noted_ && gate_.refused_messages() > 0) {
            noted_ = true;
            observer_.note("messages of strangers, or of no known kind, are dropped and counted");
        }
    }

    void end_children() {
        relay();
        const Clock::time_point deadline = Clock::now() + kEndWithin;
        const auto running = [](Child& child) { return !child.process.has_ended(); };
        while (std::any_of(children_.begin(), children_.end(), running) && Clock::now() < deadline)
            std::this_thread::sleep_for(2ms);
    }

    const DistributedLaunch launch_;
    const int processes_;  ///< started here
    DistributedObserver& observer_;
    Coordinator coordinator_;
    WorkerGate gate_;
    std::vector<std::uint32_t> admitted_;  ///< members at the gate
    std::vector<std::uint32_t> lost_;      ///< silent or out of reach
    std::optional<WorkerHere> here_;
    std::size_t ended_early_ = 0;
    bool started_ = false;
    std::pair<std::uint64_t, int> progress_;  ///< steps, bodies that went to others after losses
    Clock::time_point progressed_ = Clock::now();
    bool waiting_noted_ = false;  // since progressed_
    bool noted_ = false, keys_noted_ = false;
    std::vector<Child> children_;  // last member: the processes end before the gate
};

}  // namespace

DistributedResult run_distributed(const WorldScene& scene, const DistributedSettings& settings,
                                  const DistributedLaunch& launch, DistributedObserver& observer) {
    check_scene(scene);
    check_settings(settings);
    if (launch.processes.count < 0 || launch.processes.count > kMostWorkers)
        throw InputError("", std::to_string(launch.processes.count) + " workers",
                         "0 to " + std::to_string(kMostWorkers));
    return SharedWorldRun(scene, settings, launch, observer).run();
}

}  // namespace sim
