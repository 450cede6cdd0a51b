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

#include "run/processor_time.h"
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

/// What a worker does in one go. The same turns make the same of a worker, wherever it runs.
struct Turn {
    std::optional<SharedWorldWorker::Times> ended;  // the step under way ends
    std::vector<Bytes> messages;
    bool drain = false;
    bool step = false;  // at last
};

double cost_of(const std::function<void()>& work) {
    const double start = thread_processor_s();
    work();
    return thread_processor_s() - start;
}

// All but the step. The first message makes the worker.
void handle(std::unique_ptr<SharedWorldWorker>& worker, const Turn& turn) {
    if (turn.ended) worker->worked(*turn.ended);
    for (const Bytes& bytes : turn.messages) {
        DecodedMessage decoded = decode_message(*bytes);
        if (const auto* scene = std::get_if<SceneMessage>(&decoded.message)) {
            worker = std::make_unique<SharedWorldWorker>(*scene);
        } else if (worker) {
            worker->take(decoded.header, std::move(decoded.message));
        }
    }
    if (turn.drain && worker) worker->drain();
}

/// One worker and the processor it runs on.
struct Processor {
    std::unique_ptr<SharedWorldWorker> worker;  // with the scene
    std::deque<Arrival> inbox;                  // by ascending times
    std::deque<Arrival> outbox;                 // by times of sending
    double free_at = 0;                         // when what it does now ends
    double handled = 0;                         // [s] spent on messages since its last step
    double waited = 0;                          // [s] idle since its last step
    bool stepping = false, drain = false;
    double step_cost = 0;  // [s] of the step under way
    bool killed = false, stopped = false, cut = false;
    double silent_since = 0;  // when one of these began
    // Repeated alone:
    std::vector<Turn> turns;
    double spent_s = 0;    // this thread's, once the worker was there
    std::size_t sent = 0;  // bytes
    [[nodiscard]] bool silent() const { return killed || stopped || cut; }
    [[nodiscard]] bool runs() const { return !killed && !stopped; }
};

// Everything happens in the order of simulated time; what happens at one time in the order: failures,
// messages by the worker that sent them, workers by number.
class Machine {
public:
    Machine(const WorldScene& scene, const DistributedSettings& settings, const SimulatedProcessors& how,
            DistributedObserver& observer)
        : how_(how), meeting_(scene, settings, observer) {
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
    void put(std::uint32_t to, double time, const Bytes& bytes);
    void hand_on(std::size_t from);
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
    Coordinator meeting_;
    std::vector<Processor> processors_;
    std::size_t next_failure_ = 0;
    double now_ = 0, started_ = -1, ended_ = 0;
};

void Machine::join() {
    JoinRequest request;
    request.host = "a simulated processor";
    processors_.emplace_back();
    processors_.back().free_at = now_;
    (void)meeting_.join(request);
}

void Machine::deliver() {
    for (const Coordinator::Outgoing& message : meeting_.outgoing())
        for (const std::uint32_t to : message.to) put(to, now_ + how_.latency_s / 2, message.bytes);
}

void Machine::put(std::uint32_t to, double time, const Bytes& bytes) {
    Processor& p = processors_.at(to);
    if (p.cut || p.killed) return;
    const auto later = std::ranges::upper_bound(p.inbox, time, {}, &Arrival::time);
    p.inbox.insert(later, {time, bytes});
}

// The next of what a worker sent: a message leaves when its time has come, so that a cut before that keeps it.
void Machine::hand_on(std::size_t from) {
    const Arrival message = std::move(processors_[from].outbox.front());
    processors_[from].outbox.pop_front();
    meeting_.take(static_cast<std::uint32_t>(from), *message.bytes);
    meeting_.advance();
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
        if (!p.outbox.empty()) offer(Event::Kind::message, p.outbox.front().time, i);
        if (!p.runs()) continue;
        const bool startable = p.worker && p.worker->ready();
        if (p.stepping || (p.drain && p.worker) || startable) {
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
    if (event.kind == Event::Kind::message) hand_on(event.who);
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
    Turn turn = turn_of(p);
    const bool there = p.worker != nullptr;
    const double spent = cost_of([&] { handle(p.worker, turn); });
    if (there) p.spent_s += spent;
    if (!how_.modelled && there) {  // that a worker reads its scene is no part of the run
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

// Processor time, as Processor::spent_s. Beside the worker that did it first: memory as of a process of its own.
double Machine::repeat_alone(const Processor& p) const {
    std::unique_ptr<SharedWorldWorker> worker;
    double spent = 0;
    std::size_t sent = 0;
    for (const Turn& turn : p.turns) {
        const bool there = worker != nullptr;
        const double handled = cost_of([&] { handle(worker, turn); });
        if (there) spent += handled;
        if (worker)
            for (const std::vector<std::uint8_t>& message : worker->outgoing()) sent += message.size();
        if (turn.step) spent += cost_of([&] { worker->step(); });
    }
    if (sent != p.sent)
        throw std::logic_error("simulated processors: a worker did otherwise when it was alone");
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

SimulatedResult Machine::run() {
    for (int i = 0; i < how_.count; ++i) join();
    meeting_.start();
    deliver();
    while (!meeting_.finished()) {
        const Event event = next();
        if (event.kind == Event::Kind::none) throw std::logic_error(stuck());
        happen(event);
    }
    SimulatedResult result{meeting_.result()};
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
