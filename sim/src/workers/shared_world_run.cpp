#include <algorithm>
#include <array>
#include <cmath>
#include <csignal>
#include <optional>
#include <utility>

#include "messages/world_scene_codec.h"
#include "shared/coordinator.h"
#include "shared/shared_world_worker.h"
#include "sim/errors.h"
#include "workers/elapsed.h"
#include "workers/worker_gate.h"
#include "workers/worker_process.h"
#include "run/processor_time.h"

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
    WorkerHere(std::uint32_t number) : number_(number) {}
    [[nodiscard]] std::uint32_t number() const { return number_; }

    void take(const std::vector<std::uint8_t>& bytes) {
        const double processor = thread_processor_s();
        DecodedMessage m = decode_message(bytes);
        if (const auto* scene = std::get_if<SceneMessage>(&m.message))
            worker_.emplace(*scene);
        else if (worker_)
            worker_->take(m.header, std::move(m.message));
        messages_s_ += thread_processor_s() - processor;
    }
    /// A step if one can be done; true if it was.
    bool work() {
        if (!worker_ || worker_->ended()) return false;
        if (worker_->awaits_answer())
            worker_->stop_waiting_for_answer();  // messages come between its steps alone
        if (!worker_->ready()) return false;
        const Clock::time_point start = Clock::now();
        const double processor = thread_processor_s();
        worker_->step();
        const double spent = std::exchange(messages_s_, 0) + thread_processor_s() - processor;
        worker_->worked({seconds_since(start), 0, spent});
        return true;
    }
    [[nodiscard]] std::vector<std::vector<std::uint8_t>> outgoing() {
        return worker_ ? worker_->outgoing() : std::vector<std::vector<std::uint8_t>>();
    }

private:
    std::uint32_t number_;
    std::optional<SharedWorldWorker> worker_;
    double messages_s_ = 0;  ///< processor time that they took since the last step
};

class SharedWorldRun {
public:
    SharedWorldRun(const WorldScene& scene, const DistributedSettings& settings,
                   const DistributedLaunch& launch, DistributedObserver& observer)
        : launch_(launch),
          processes_(launch.processes.program.empty() ? 0 : launch.processes.count),
          observer_(observer),
          meeting_(scene, settings, observer),
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
        meeting_.start();
        const Clock::time_point start = Clock::now();
        while (!meeting_.finished()) advance();
        DistributedResult result = meeting_.result();
        result.elapsed_s = seconds_since(start);
        result.refused_messages += gate_.refused_messages() + gate_.refused_keys();
        end_children();
        return result;
    }

private:
    struct Child {
        WorkerProcess process;
        std::optional<std::uint32_t> worker = std::nullopt;     ///< once it has joined
        std::optional<Clock::time_point> ended = std::nullopt;  ///< seen then
    };

    /// A worker is sent what each other one publishes in the steps by which it may be behind, all at once if it
    /// joins late; and who owns each body, all at once too, after a loss.
    static WorkerGate::Settings gate_settings(const WorldScene& scene, const DistributedSettings& run,
                                              const DistributedLaunch& launch) {
        WorkerGate::Settings settings;
        settings.silence_s = launch.silence_s;
        settings.listen = launch.listen;
        // Workers remove the folder of an application that was killed: without any there is none.
        settings.in_folder =
            launch.listen.empty() || (launch.processes.count > 0 && !launch.processes.program.empty());
        const auto bodies = static_cast<int>(scene.world.bodies.size() + scene.later.size());
        // Nobody waits for who owns nothing: while it is silent, but not for too long, steps of few bodies are many.
        settings.most_waiting =
            1000 + 4 * bodies + 4 * (run.bound + 2) * kMostWorkers + 500'000 / std::max(bodies, 1);
        settings.largest_message = largest_message(scene);
        if (!launch.keys.empty()) settings.keys = read_application_keys(launch.keys);
        return settings;
    }

    void advance() {
        const bool worked = here_ && here_->work();
        for (WorkerGate::Event& event : gate_.wait(worked ? 0ms : kWait)) {
            take(event);
            pass_on();  // at once: others wait for it
            meeting_.advance();
        }
        look_after_children();
        if (meeting_.members().empty() && !meeting_.finished()) take_over();
        look_after_progress();
        pass_on();
        note_refusals();
    }

    /// A worker may be heard, and even publish, and yet not what all wait for.
    void look_after_progress() {
        // Who has just got the bodies of a lost one has as long as that one had.
        const std::pair now(meeting_.steps(), meeting_.result().bodies_reowned);
        if (std::exchange(progress_, now) != now) progressed_ = Clock::now(), waiting_noted_ = false;
        if (seconds_since(progressed_) > launch_.longest_step_s / 2 && !std::exchange(waiting_noted_, true))
            meeting_.note_waiting();
        if (seconds_since(progressed_) < launch_.longest_step_s) return;
        progressed_ = Clock::now(), waiting_noted_ = false;
        meeting_.lose_slowest("all have waited for its bodies for " + seconds(launch_.longest_step_s));
    }

    void wait_for_workers() {
        const auto wanted = static_cast<std::size_t>(std::max({launch_.expect, processes_, 1}));
        const Clock::time_point start = Clock::now();
        while (meeting_.members().size() + ended_early_ < wanted) {
            for (WorkerGate::Event& event : gate_.wait(kWait)) take(event);
            look_after_children();
            pass_on();
            note_refusals();
            if (seconds_since(start) > launch_.wait_s) return go_without_the_rest(wanted);
        }
    }

    /// A worker that is stopped, or cannot reach us, does not hold up those that came.
    void go_without_the_rest(std::size_t wanted) {
        const std::string joined = std::to_string(meeting_.members().size()) + " of " +
                                   std::to_string(wanted) + " workers joined within " +
                                   seconds(launch_.wait_s);
        if (meeting_.members().size() == 0 && children_.empty()) throw WorkerError(joined);
        for (Child& child : children_)
            if (!child.worker && !child.ended) child.process.kill();
        observer_.note(joined + ": the run begins without the others");
    }

    void take(WorkerGate::Event& event) {
        using Kind = WorkerGate::Event::Kind;
        if (event.kind == Kind::asks_to_join)
            join(event);
        else if (event.kind == Kind::message)
            meeting_.take(event.worker, event.bytes);
        else if (meeting_.is_member(event.worker)) {
            lost_.push_back(event.worker);
            meeting_.lose(event.worker, event.why);
        }
    }

    void join(const WorkerGate::Event& event) {
        const auto child = std::find_if(children_.begin(), children_.end(), [&](const Child& c) {
            return !c.worker && !c.ended && c.process.secret() == event.request.secret;
        });
        if (child == children_.end() && meeting_.members().size() >= kMostWorkers)
            return gate_.refuse(event.stranger, "all places are taken");
        const std::uint32_t worker = meeting_.join(event.request);
        gate_.admit(event.stranger, worker, event.request.secret);
        admitted_.push_back(worker);
        if (child != children_.end()) child->worker = worker;
    }

    void look_after_children() {
        for (Child& child : children_) {
            if (child.worker && !meeting_.is_member(*child.worker) && was_lost(*child.worker))
                child.process.kill();
            if (!child.process.has_ended()) continue;
            if (!child.ended) {
                child.ended = Clock::now();
                if (!child.worker)
                    note_early_end(child);
                else if (!started_)
                    ++ended_early_;
            }
            // One that ended in order may have said so: that is on its way.
            const bool settled = child.process.was_killed() || seconds_since(*child.ended) > kLastWords_s;
            if (settled && child.worker && meeting_.is_member(*child.worker))
                meeting_.lose(*child.worker, child.process.ending());
        }
    }

    void note_early_end(const Child& child) {
        if (!child.process.was_killed())
            throw WorkerError("a worker ended before it joined: " + child.process.ending());
        ++ended_early_;
    }

    /// Not one that has drained: it ends by itself.
    [[nodiscard]] bool was_lost(std::uint32_t worker) const {
        return std::find(lost_.begin(), lost_.end(), worker) != lost_.end();
    }

    void take_over() {
        here_.emplace(meeting_.join({{}, "here"}));
        observer_.note("no worker is left: the application goes on by itself");
    }

    void pass_on() {
        for (bool more = true; more;) {
            for (Coordinator::Outgoing& out : meeting_.outgoing()) deliver(out);
            more = false;
            if (here_)
                for (const std::vector<std::uint8_t>& bytes : here_->outgoing())
                    meeting_.take(here_->number(), bytes), meeting_.advance(), more = true;
        }
        std::erase_if(admitted_, [this](std::uint32_t worker) {
            if (meeting_.is_member(worker)) return false;
            gate_.dismiss(worker);
            return true;
        });
    }

    void deliver(Coordinator::Outgoing& out) {
        if (here_ && std::erase(out.to, here_->number()) > 0) here_->take(*out.bytes);
        if (!out.to.empty()) gate_.send(out.to, std::move(out.bytes));
    }

    void note_refusals() {
        if (!keys_noted_ && gate_.refused_keys() > 0) {
            keys_noted_ = true;
            observer_.note("a worker without a key that is allowed here asks to join: it is not answered");
        }
        if (!noted_ && gate_.refused_messages() > 0) {
            noted_ = true;
            observer_.note("messages that are none of ours are dropped and counted");
        }
    }

    void end_children() {
        pass_on();
        const Clock::time_point deadline = Clock::now() + kEndWithin;
        const auto running = [](Child& child) { return !child.process.has_ended(); };
        while (std::any_of(children_.begin(), children_.end(), running) && Clock::now() < deadline)
            std::this_thread::sleep_for(2ms);
    }

    const DistributedLaunch launch_;
    const int processes_;  ///< started here
    DistributedObserver& observer_;
    Coordinator meeting_;
    WorkerGate gate_;
    std::vector<std::uint32_t> admitted_;  ///< by the gate, now
    std::vector<std::uint32_t> lost_;      ///< silent or out of reach
    std::optional<WorkerHere> here_;
    std::size_t ended_early_ = 0;
    bool started_ = false;
    std::pair<std::uint64_t, int> progress_;  ///< steps, bodies that went to others after losses
    Clock::time_point progressed_ = Clock::now();
    bool waiting_noted_ = false;  // since then
    bool noted_ = false, keys_noted_ = false;
    std::vector<Child> children_;  // last: processes end before the gate goes
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
