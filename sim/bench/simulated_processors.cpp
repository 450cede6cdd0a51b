#include "simulated_processors.h"

#include <algorithm>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>

#include "run/elapsed_time.h"
#include "shared/coordinator.h"
#include "shared/shared_world_worker.h"
#include "sim/errors.h"

namespace sim_bench {
namespace {

using namespace sim;

using Bytes = std::shared_ptr<const std::vector<std::uint8_t>>;

struct Arrival {
    double time;
    Bytes bytes;
};

/// What a worker does without a pause, in this order. The same turns bring any worker to the same state.
struct Turn {
    std::optional<SharedWorldWorker::Times> ended;  // it ends the step under way
    std::vector<Bytes> messages;                    // it receives these
    bool drain = false;                             // it begins to leave
    bool step = false;                              // it begins a step
};

double cost_of(const std::function<void()>& work) {
    const double start = thread_processor_s();
    work();
    return thread_processor_s() - start;
}

// Does all of a turn but the step. The first message creates the worker.
void handle(std::unique_ptr<SharedWorldWorker>& worker, const Turn& turn) {
    if (turn.ended) worker->end_step(*turn.ended);
    for (const Bytes& bytes : turn.messages) {
        DecodedMessage decoded = decode_message(*bytes);
        if (const auto* scene = std::get_if<SceneMessage>(&decoded.message)) {
            worker = std::make_unique<SharedWorldWorker>(*scene);
        } else if (worker) {
            worker->receive(decoded.header, std::move(decoded.message));
        }
    }
    if (turn.drain && worker) worker->drain();
}

/// One worker and the processor it runs on.
struct Processor {
    std::unique_ptr<SharedWorldWorker> worker;  // once it has received the scene
    std::deque<Arrival> inbox;                  // by ascending times
    std::deque<Arrival> outbox;                 // by times of sending
    double free_at = 0;                         // when its present work ends
    double handled = 0;                         // [s] spent on messages since its last step
    double waited = 0;                          // [s] idle since its last step
    bool stepping = false, drain = false;
    double step_cost = 0;  // [s] of the step under way
    bool killed = false, stopped = false, cut = false;
    double silent_since = 0;  // when one of these began
    // For repeat_alone:
    std::vector<Turn> turns;
    double spent_s = 0;    // processor time of this thread, once there was a worker
    std::size_t sent = 0;  // bytes
    [[nodiscard]] bool silent() const { return killed || stopped || cut; }
    [[nodiscard]] bool runs() const { return !killed && !stopped; }
};

// Events happen in the order of simulated time. At one time failures come first, then silences, messages by
// sender, and workers by number.
class Machine {
public:
    Machine(const WorldScene& scene, const DistributedSettings& settings, const SimulatedProcessors& how,
            DistributedObserver& observer)
        : how_(how), coordinator_(scene, settings, observer) {
        std::stable_sort(how_.failures.begin(), how_.failures.end(),
                         [](const auto& a, const auto& b) { return a.time_s < b.time_s; });
    }

    SimulatedResult run();

private:
    struct Event {
        enum class Kind { failure, silence, message, worker, none } kind = Kind::none;
        double time = 0;
        std::size_t who = 0;
    };

    void join();
    void deliver();
    void deliver_to(std::uint32_t to, double time, const Bytes& bytes);
    void relay_next(std::size_t from);
    [[nodiscard]] Event next() const;
    void happen(const Event& event);
    void fail(const SimulatedProcessors::Failure& failure);
    void run_worker(std::size_t number);
    [[nodiscard]] Turn turn_of(Processor& p);
    void start_step(std::size_t number);
    [[nodiscard]] double repeat_alone(const Processor& p) const;
    void repeat_alone(SimulatedResult& result) const;
    void send(Processor& p);
    [[nodiscard]] double factor(std::size_t number) const;
    [[nodiscard]] std::string stuck() const;

    SimulatedProcessors how_;
    Coordinator coordinator_;
    std::vector<Processor> processors_;
    std::size_t next_failure_ = 0;
    double now_ = 0, started_ = -1, ended_ = 0;
};

void Machine::join() {
    JoinRequest request;
    request.host = "a simulated processor";
    processors_.emplace_back();
    processors_.back().free_at = now_;
    (void)coordinator_.join(request);
}

void Machine::deliver() {
    for (const Coordinator::Outgoing& message : coordinator_.outgoing())
        for (const std::uint32_t to : message.to) deliver_to(to, now_ + how_.latency_s / 2, message.bytes);
}

void Machine::deliver_to(std::uint32_t to, double time, const Bytes& bytes) {
    Processor& p = processors_.at(to);
    if (p.cut || p.killed) return;
    const auto later = std::ranges::upper_bound(p.inbox, time, {}, &Arrival::time);
    p.inbox.insert(later, {time, bytes});
}

// Relays the next message of a worker. It leaves the worker when its time has come: a cut before that stops
// it.
void Machine::relay_next(std::size_t from) {
    const Arrival message = std::move(processors_[from].outbox.front());
    processors_[from].outbox.pop_front();
    coordinator_.receive(static_cast<std::uint32_t>(from), *message.bytes);
    coordinator_.advance();
}

Machine::Event Machine::next() const {
    Event best;
    auto consider = [&best](Event::Kind kind, double time, std::size_t who) {
        if (best.kind == Event::Kind::none || std::pair(time, kind) < std::pair(best.time, best.kind))
            best = {kind, time, who};
    };
    if (next_failure_ < how_.failures.size())
        consider(Event::Kind::failure, std::max(now_, how_.failures[next_failure_].time_s), 0);
    for (std::size_t i = 0; i < processors_.size(); ++i) {
        const Processor& p = processors_[i];
        const auto& members = coordinator_.members();
        if (p.silent() && std::find(members.begin(), members.end(), i) != members.end())
            consider(Event::Kind::silence, p.silent_since + how_.silence_s, i);
        if (!p.outbox.empty()) consider(Event::Kind::message, p.outbox.front().time, i);
        if (!p.runs()) continue;
        const bool startable = p.worker && p.worker->ready();
        if (p.stepping || (p.drain && p.worker) || startable) {
            consider(Event::Kind::worker, p.free_at, i);
        } else if (!p.inbox.empty()) {
            consider(Event::Kind::worker, std::max(p.free_at, p.inbox.front().time), i);
        }
    }
    return best;
}

void Machine::happen(const Event& event) {
    now_ = std::max(now_, event.time);
    if (event.kind == Event::Kind::failure) fail(how_.failures[next_failure_++]);
    if (event.kind == Event::Kind::silence)
        coordinator_.lose(static_cast<std::uint32_t>(event.who), "silent for too long");
    if (event.kind == Event::Kind::message) relay_next(event.who);
    if (event.kind == Event::Kind::worker) run_worker(event.who);
    // If no worker is left, the application goes on with a worker of its own.
    if (coordinator_.members().empty() && !coordinator_.finished()) join();
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
    Turn turn = turn_of(p);
    const bool has_scene = p.worker != nullptr;
    const double spent = cost_of([&] { handle(p.worker, turn); });
    if (has_scene) p.spent_s += spent;
    if (!how_.modelled && has_scene) {  // reading the scene is no part of the run
        p.handled += spent * how_.slowdown;
        p.free_at = now_ + spent * how_.slowdown;
    }
    if (p.worker) p.drain = false;
    send(p);
    turn.step = p.worker && p.worker->ready();
    const bool step = turn.step;
    if (how_.repeat_alone) p.turns.push_back(std::move(turn));
    if (step) start_step(number);
}

Turn Machine::turn_of(Processor& p) {
    Turn turn;
    if (!p.stepping) p.waited += now_ - p.free_at;
    p.free_at = now_;
    if (std::exchange(p.stepping, false)) {
        const double seconds = p.step_cost + std::exchange(p.handled, 0);
        turn.ended = {seconds, std::exchange(p.waited, 0), seconds};
        ended_ = now_;
    }
    for (; !p.inbox.empty() && p.inbox.front().time <= now_; p.inbox.pop_front())
        turn.messages.push_back(std::move(p.inbox.front().bytes));
    turn.drain = p.drain;
    return turn;
}

void Machine::start_step(std::size_t number) {
    Processor& p = processors_[number];
    if (started_ < 0) started_ = p.free_at;
    const double slow = factor(number), spent = cost_of([&] { p.worker->step(); });
    p.spent_s += spent;
    p.step_cost = slow * how_.slowdown * (how_.modelled ? how_.seconds_per_work * p.worker->work() : spent);
    p.free_at += p.step_cost;
    p.stepping = true;
}

void Machine::send(Processor& p) {
    if (!p.worker) return;
    for (std::vector<std::uint8_t>& message : p.worker->outgoing()) {
        p.sent += message.size();
        if (p.cut) continue;
        p.outbox.push_back({p.free_at + how_.latency_s / 2,
                            std::make_shared<const std::vector<std::uint8_t>>(std::move(message))});
    }
}

// The processor time of all turns of a processor, done by a new worker alone. The first worker still exists,
// so the new one has memory of its own, as a process has.
double Machine::repeat_alone(const Processor& p) const {
    std::unique_ptr<SharedWorldWorker> worker;
    double spent = 0;
    std::size_t sent = 0;
    for (const Turn& turn : p.turns) {
        const bool has_scene = worker != nullptr;
        const double handled = cost_of([&] { handle(worker, turn); });
        if (has_scene) spent += handled;
        if (worker)
            for (const std::vector<std::uint8_t>& message : worker->outgoing()) sent += message.size();
        if (turn.step) spent += cost_of([&] { worker->step(); });
    }
    if (sent != p.sent)
        throw std::logic_error("simulated processors: a worker sent other bytes when it was alone");
    return spent;
}

void Machine::repeat_alone(SimulatedResult& result) const {
    double in_turns = 0, sum = 0, longest = 0;
    for (const Processor& p : processors_) {
        const double alone = repeat_alone(p);
        in_turns += p.spent_s, sum += alone;
        longest = std::max(longest, alone);
    }
    if (sum > 0) result.cold_caches = in_turns / sum;
    result.busiest_s = how_.slowdown * longest;
}

// Words for a run that has no event left before its end, which is our own mistake.
std::string Machine::stuck() const {
    std::string what = "simulated processors: no event is left before the run's end; members";
    for (const std::uint32_t worker : coordinator_.members()) {
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

SimulatedResult Machine::run() {
    for (int i = 0; i < how_.count; ++i) join();
    coordinator_.start();
    deliver();
    while (!coordinator_.finished()) {
        const Event event = next();
        if (event.kind == Event::Kind::none) throw std::logic_error(stuck());
        happen(event);
    }
    SimulatedResult result{coordinator_.result()};
    result.elapsed_s = std::max(0.0, ended_ - std::max(0.0, started_));
    if (how_.repeat_alone) repeat_alone(result);
    return result;
}

}  // namespace

SimulatedResult simulate_processors(const WorldScene& scene, const DistributedSettings& settings,
                                    const SimulatedProcessors& processors, DistributedObserver& observer) {
    if (processors.count < 1) throw InputError("", "no processor", "1 or more");
    return Machine(scene, settings, processors, observer).run();
}

}  // namespace sim_bench
