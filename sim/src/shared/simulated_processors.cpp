#include <time.h>

#include <algorithm>
#include <deque>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>

#include "shared/coordinator.h"
#include "shared/shared_world_worker.h"
#include "sim/distributed_world.h"
#include "sim/errors.h"

namespace sim {
namespace {

using Bytes = std::shared_ptr<const std::vector<std::uint8_t>>;

double thread_seconds() {
    timespec now{};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
    return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

struct Arrival {
    double time;
    Bytes bytes;
};

/// One worker and the processor it runs on.
struct Processor {
    std::unique_ptr<SharedWorldWorker> worker;  // with the scene
    std::deque<Arrival> inbox;                  // by ascending times
    std::deque<Arrival> outbox;                 // times at which the application gets them
    double free_at = 0;                         // when what it does now ends
    double handled = 0;                         // [s] spent on messages since its last step
    double waited = 0;                          // [s] idle since its last step
    bool stepping = false, drain = false;
    double step_cost = 0;
    bool killed = false, stopped = false, cut = false;
    double silent_since = 0;  // when one of these began
    [[nodiscard]] bool silent() const { return killed || stopped || cut; }
    [[nodiscard]] bool runs() const { return !killed && !stopped; }
};

// Everything happens in the order of simulated time; what happens at one time in the order: failures,
// messages to the application by worker, workers by number.
class Machine {
public:
    Machine(const WorldScene& scene, const DistributedSettings& settings, const SimulatedProcessors& how,
            DistributedObserver& observer)
        : how_(how), observer_(&observer), meeting_(scene, settings, observer) {
        std::stable_sort(how_.failures.begin(), how_.failures.end(),
                         [](const auto& a, const auto& b) { return a.time_s < b.time_s; });
    }

    DistributedResult run();

private:
    struct Event {
        enum class Kind { failure, silence, application, worker, none } kind = Kind::none;
        double time = 0;
        std::size_t who = 0;
    };

    void join();
    void deliver();
    [[nodiscard]] Event next() const;
    void happen(const Event& event);
    void fail(const SimulatedProcessors::Failure& failure);
    void run_worker(std::size_t number);
    void end_step(Processor& p);
    void take_messages(Processor& p);
    void start_step(std::size_t number);
    void send(Processor& p);
    [[nodiscard]] double factor(std::size_t number) const;
    [[nodiscard]] std::string stuck() const;

    SimulatedProcessors how_;
    DistributedObserver* observer_;
    Coordinator meeting_;
    std::vector<Processor> processors_;
    std::size_t next_failure_ = 0;
    double now_ = 0, started_ = -1, ended_ = 0;
};

void Machine::join() {
    JoinRequest request;
    request.fingerprint = 0;
    request.host = "a simulated processor";
    processors_.emplace_back();
    processors_.back().free_at = now_;
    (void)meeting_.join(request);
}

// What the application sends arrives half a latency later.
void Machine::deliver() {
    for (const Coordinator::Outgoing& message : meeting_.outgoing())
        for (const std::uint32_t to : message.to) {
            Processor& p = processors_.at(to);
            if (!p.cut && !p.killed) p.inbox.push_back({now_ + how_.latency_s / 2, message.bytes});
        }
}

Machine::Event Machine::next() const {
    Event best;
    auto offer = [&best](Event::Kind kind, double time, std::size_t who) {
        if (best.kind == Event::Kind::none || std::pair(time, kind) < std::pair(best.time, best.kind))
            best = {kind, time, who};
    };
    if (next_failure_ < how_.failures.size())
        offer(Event::Kind::failure, std::max(now_, how_.failures[next_failure_].time_s), 0);
    for (std::size_t i = 0; i < processors_.size(); ++i) {
        const Processor& p = processors_[i];
        const auto& members = meeting_.members();
        if (p.silent() && std::find(members.begin(), members.end(), i) != members.end())
            offer(Event::Kind::silence, p.silent_since + how_.silence_s, i);
        if (!p.outbox.empty()) offer(Event::Kind::application, p.outbox.front().time, i);
        if (!p.runs()) continue;
        const bool startable = p.worker && p.worker->ready();
        if (p.stepping || p.drain || startable) {
            offer(Event::Kind::worker, p.free_at, i);
        } else if (!p.inbox.empty()) {
            offer(Event::Kind::worker, std::max(p.free_at, p.inbox.front().time), i);
        }
    }
    return best;
}

void Machine::happen(const Event& event) {
    now_ = std::max(now_, event.time);
    if (event.kind == Event::Kind::failure) fail(how_.failures[next_failure_++]);
    if (event.kind == Event::Kind::silence)
        meeting_.lose(static_cast<std::uint32_t>(event.who), "not heard of for a while");
    if (event.kind == Event::Kind::application) {
        Processor& p = processors_[event.who];
        const Bytes bytes = p.outbox.front().bytes;
        p.outbox.pop_front();
        meeting_.take(static_cast<std::uint32_t>(event.who), *bytes);
    }
    if (event.kind == Event::Kind::worker) run_worker(event.who);
    // If no worker is left, the application's own process continues.
    if (meeting_.members().empty() && !meeting_.finished()) join();
    deliver();
}

void Machine::fail(const SimulatedProcessors::Failure& failure) {
    using Kind = SimulatedProcessors::Failure::Kind;
    if (failure.kind == Kind::join) return join();
    const auto number = static_cast<std::size_t>(failure.worker);
    if (number >= processors_.size()) return;
    Processor& p = processors_[number];
    if (!p.silent()) p.silent_since = now_;
    if (failure.kind == Kind::kill) p.killed = true, p.inbox.clear();
    if (failure.kind == Kind::stop) p.stopped = true;
    if (failure.kind == Kind::cut) p.cut = true, p.inbox.clear(), p.outbox.clear();
    if (failure.kind == Kind::drain) p.drain = p.runs();
    if (failure.kind == Kind::resume && p.stopped) {
        p.stopped = false;
        p.free_at += now_ - p.silent_since;
    }
}

double Machine::factor(std::size_t number) const {
    const SharedWorldWorker& worker = *processors_[number].worker;
    double factor = worker.slowing();
    if (how_.factor) factor *= how_.factor(static_cast<int>(number), worker.steps_done());
    return factor;
}

void Machine::run_worker(std::size_t number) {
    Processor& p = processors_[number];
    if (!p.stepping) p.waited += now_ - p.free_at;
    p.free_at = now_;
    const double start = thread_seconds();
    if (p.stepping) end_step(p);
    take_messages(p);
    if (p.drain && p.worker) p.drain = false, p.worker->drain();
    if (!how_.modelled) {
        const double cost = (thread_seconds() - start) * how_.slowdown;
        p.handled += cost;
        p.free_at = now_ + cost;
    }
    send(p);
    if (p.worker && p.worker->ready()) start_step(number);
}

void Machine::end_step(Processor& p) {
    p.stepping = false;
    p.worker->worked(p.step_cost + std::exchange(p.handled, 0), std::exchange(p.waited, 0));
    ended_ = now_;
}

void Machine::take_messages(Processor& p) {
    while (!p.inbox.empty() && p.inbox.front().time <= now_) {
        DecodedWorldMessage decoded = decode_for_worker(*p.inbox.front().bytes);
        p.inbox.pop_front();
        if (const auto* scene = std::get_if<SceneMessage>(&decoded.message)) {
            p.worker = std::make_unique<SharedWorldWorker>(*scene);
        } else if (p.worker) {
            p.worker->take(decoded.header, std::move(decoded.message));
        }
    }
}

void Machine::start_step(std::size_t number) {
    Processor& p = processors_[number];
    const double slow = factor(number), start = thread_seconds();
    if (started_ < 0) started_ = p.free_at;
    p.worker->step();
    p.step_cost =
        how_.modelled ? how_.seconds_per_work * p.worker->work() : (thread_seconds() - start) * how_.slowdown;
    p.step_cost *= slow;
    p.free_at += p.step_cost;
    p.stepping = true;
}

void Machine::send(Processor& p) {
    if (!p.worker) return;
    for (std::vector<std::uint8_t>& bytes : p.worker->outgoing())
        if (!p.cut)
            p.outbox.push_back({p.free_at + how_.latency_s / 2,
                                std::make_shared<const std::vector<std::uint8_t>>(std::move(bytes))});
}

// That nothing is left to happen before the end is our own mistake.
std::string Machine::stuck() const {
    std::string what = "simulated processors: no event is left before the run's end; members";
    for (const std::uint32_t worker : meeting_.members()) {
        const Processor& p = processors_[worker];
        what.append(" ").append(std::to_string(worker));
        if (p.worker)
            what.append(" at step ")
                .append(std::to_string(p.worker->steps_done()))
                .append(" waits for ")
                .append(p.worker->waits_for());
        if (p.silent()) what.append(" silent");
    }
    return what;
}

DistributedResult Machine::run() {
    for (int i = 0; i < how_.count; ++i) join();
    meeting_.start();
    deliver();
    while (!meeting_.finished()) {
        const Event event = next();
        if (event.kind == Event::Kind::none) throw std::logic_error(stuck());
        happen(event);
    }
    DistributedResult result = meeting_.result();
    result.elapsed_s = std::max(0.0, ended_ - std::max(0.0, started_));
    return result;
}

}  // namespace

DistributedResult simulate_processors(const WorldScene& scene, const DistributedSettings& settings,
                                      const SimulatedProcessors& processors, DistributedObserver& observer) {
    if (processors.count < 1) throw InputError("", "no processor", "1 or more");
    return Machine(scene, settings, processors, observer).run();
}

}  // namespace sim
