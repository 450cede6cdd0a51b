#include <ucontext.h>
#ifdef __SANITIZE_ADDRESS__
#include <sanitizer/common_interface_defs.h>
#endif

#include <algorithm>
#include <cstdint>
#include <deque>
#include <exception>
#include <functional>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>

#include "shared/coordinator.h"
#include "shared/shared_world_worker.h"
#include "sim/distributed_world.h"
#include "sim/errors.h"
#include "world/processor_time.h"

namespace sim {
namespace {

using Bytes = std::shared_ptr<const std::vector<std::uint8_t>>;

struct Arrival {
    double time;
    Bytes bytes;
    std::vector<std::uint32_t> to = {};  // other workers; empty: the application
};

/// What a worker does in one go. The same turns make the same of a worker, wherever it runs.
struct Turn {
    std::optional<SharedWorldWorker::Times> ended;  // the step under way ends
    std::vector<Bytes> messages;
    bool drain = false;
    bool step = false;                       // at last
    std::vector<std::vector<Bytes>> within;  // what came to each wait of it
};

/// A step of a worker that may wait in its midst for messages: on a stack of its own, which its owner leaves and comes back to.
class WaitingStep {
public:
    WaitingStep() = default;
    ~WaitingStep() { abandon(); }
    WaitingStep(const WaitingStep&) = delete;
    WaitingStep& operator=(const WaitingStep&) = delete;

    /// Runs the step until it waits or ends. Throws what it threw.
    void begin(std::function<void(WaitingStep&)> work) {
        abandon();
        if (stack_.empty()) stack_.resize(kStackBytes);
        work_ = std::move(work);
        if (getcontext(&inside_) != 0) throw std::runtime_error("a context cannot be made");
        inside_.uc_stack.ss_sp = stack_.data(), inside_.uc_stack.ss_size = stack_.size();
        inside_.uc_link = nullptr;
        const auto self = reinterpret_cast<std::uintptr_t>(this);
        makecontext(&inside_, reinterpret_cast<void (*)()>(&WaitingStep::run), 2,
                    static_cast<unsigned>(self >> 32), static_cast<unsigned>(self));
        enter(State::running);
    }
    void go_on() { enter(State::running); }
    [[nodiscard]] bool waits() const { return state_ == State::waiting; }

    /// Within the step: processor time since it began or went on [s].
    [[nodiscard]] double spent_s() const { return thread_processor_s() - start_s_; }
    void wait() {
        leave(State::waiting);
        if (state_ == State::abandoned) throw Abandoned{};
        start_s_ = thread_processor_s();
    }

private:
    enum class State { none, running, waiting, ended, abandoned };
    struct Abandoned {};
    static constexpr std::size_t kStackBytes = 1 << 20;

    static void run(unsigned high, unsigned low) {
        auto& self = *reinterpret_cast<WaitingStep*>(static_cast<std::uintptr_t>(high) << 32 | low);
        end_switch(nullptr, &self.outer_stack_, &self.outer_bytes_);
        try {
            self.start_s_ = thread_processor_s();
            self.work_(self);
        } catch (const Abandoned&) {
        } catch (...) {
            self.failure_ = std::current_exception();
        }
        self.leave(State::ended);
    }
    void enter(State state) {
        state_ = state;
        void* fake = nullptr;
        begin_switch(&fake, stack_.data(), stack_.size());
        (void)swapcontext(&outside_, &inside_);
        end_switch(fake, nullptr, nullptr);
        if (failure_) std::rethrow_exception(std::exchange(failure_, nullptr));
    }
    void leave(State state) {
        state_ = state;
        void* fake = nullptr;
        begin_switch(state == State::ended ? nullptr : &fake, outer_stack_, outer_bytes_);
        (void)swapcontext(&inside_, &outside_);
        end_switch(fake, &outer_stack_, &outer_bytes_);
    }
    void abandon() noexcept {
        if (state_ == State::waiting) enter(State::abandoned);
    }
    // The address sanitizer has to know on which stack it is.
    static void begin_switch([[maybe_unused]] void** fake, [[maybe_unused]] const void* stack,
                             [[maybe_unused]] std::size_t bytes) {
#ifdef __SANITIZE_ADDRESS__
        __sanitizer_start_switch_fiber(fake, stack, bytes);
#endif
    }
    static void end_switch([[maybe_unused]] void* fake, [[maybe_unused]] const void** stack,
                           [[maybe_unused]] std::size_t* bytes) {
#ifdef __SANITIZE_ADDRESS__
        __sanitizer_finish_switch_fiber(fake, stack, bytes);
#endif
    }

    std::function<void(WaitingStep&)> work_;
    ucontext_t inside_{}, outside_{};
    std::vector<char> stack_;
    const void* outer_stack_ = nullptr;
    std::size_t outer_bytes_ = 0;
    State state_ = State::none;
    std::exception_ptr failure_;
    double start_s_ = 0;
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
    double step_cost = 0, told_cost = 0;  // of the step; of the part under way, charged already
    double slow = 1;                      // of the step under way
    std::unique_ptr<WaitingStep> step = std::make_unique<WaitingStep>();
    std::vector<Bytes> come;  // to its last wait
    bool killed = false, stopped = false, cut = false;
    double silent_since = 0;  // when one of these began
    // Repeated alone:
    std::vector<Turn> turns;
    double spent_s = 0;                       // this thread's, once the worker was there
    std::size_t sent = 0;                     // bytes
    std::size_t linked = 0, linked_told = 0;  // of them to other workers, in all; and of its last report
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

    DistributedResult run();

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
    void charge(Processor& p, double spent);
    void go_on(std::size_t number);
    void after_part(Processor& p);
    [[nodiscard]] double repeat_alone(const Processor& p) const;
    void repeat_alone(DistributedResult& result) const;
    void send(Processor& p);
    [[nodiscard]] double factor(std::size_t number) const;
    [[nodiscard]] std::string stuck() const;

    SimulatedProcessors how_;
    Coordinator meeting_;
    std::deque<Processor> processors_;  // steps refer to theirs
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

// What the application sends arrives half a latency later, as what was sent to it: both are between two workers.
void Machine::deliver() {
    for (const Coordinator::Outgoing& message : meeting_.outgoing())
        for (const std::uint32_t to : message.to)
            put(to, now_ + how_.latency_s / 2 + how_.by_application_s, message.bytes);
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
    if (message.to.empty()) {
        meeting_.take(static_cast<std::uint32_t>(from), *message.bytes);
        meeting_.advance();
    }
    for (const std::uint32_t to : message.to)
        put(to, now_ + how_.latency_s / 2 + how_.directly_s, message.bytes);
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
        if (!p.step->waits() && (p.stepping || (p.drain && p.worker) || startable)) {
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
    if (p.step->waits()) return go_on(number);
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
        turn.ended = {seconds, std::exchange(p.waited, 0), seconds,
                      p.linked - std::exchange(p.linked_told, p.linked)};
        ended_ = now_;
    }
    for (; !p.inbox.empty() && p.inbox.front().time <= now_; p.inbox.pop_front())
        turn.messages.push_back(std::move(p.inbox.front().bytes));
    turn.drain = p.drain;
    return turn;
}

void Machine::start_step(std::size_t number) {
    Processor& p = processors_[number];
    p.slow = factor(number);
    if (started_ < 0) started_ = p.free_at;
    p.step_cost = p.told_cost = 0;
    // What a part of the step took is charged when it tells something, and when it ends.
    p.step->begin([this, number](WaitingStep& step) {
        Processor& own = processors_[number];
        own.worker->step([&](bool wait) {
            charge(own, step.spent_s());
            send(own);
            if (!wait) return;
            step.wait();
            for (const Bytes& bytes : own.come) {
                DecodedMessage decoded = decode_message(*bytes);
                own.worker->take(decoded.header, std::move(decoded.message));
            }
        });
        charge(own, step.spent_s());
    });
    after_part(p);
}

void Machine::charge(Processor& p, double spent) {
    const double fresh = spent - std::exchange(p.told_cost, spent);
    p.spent_s += fresh;
    if (how_.modelled) return;
    p.step_cost += fresh * how_.slowdown * p.slow;
    p.free_at += fresh * how_.slowdown * p.slow;
}

void Machine::go_on(std::size_t number) {
    Processor& p = processors_[number];
    p.waited += std::max(0.0, now_ - p.free_at);
    p.free_at = std::max(p.free_at, now_);
    p.come.clear();
    for (; !p.inbox.empty() && p.inbox.front().time <= now_; p.inbox.pop_front())
        p.come.push_back(std::move(p.inbox.front().bytes));
    if (how_.repeat_alone) p.turns.back().within.push_back(p.come);
    p.told_cost = 0;
    p.step->go_on();
    after_part(p);
}

void Machine::after_part(Processor& p) {
    if (p.step->waits()) return;
    if (how_.modelled) {
        p.step_cost = how_.seconds_per_work * how_.slowdown * p.worker->work() * p.slow;
        p.free_at += p.step_cost;
    }
    p.stepping = true;
}

void Machine::send(Processor& p) {
    if (!p.worker) return;
    for (SharedWorldWorker::Outgoing& message : p.worker->outgoing()) {
        p.sent += message.bytes.size();
        if (!message.to.empty() && message.by_application)
            message.bytes = p.worker->relayed(std::exchange(message.to, {}), std::move(message.bytes));
        p.linked += message.to.size() * message.bytes.size();
        if (p.cut) continue;
        p.outbox.push_back({p.free_at + how_.latency_s / 2,
                            std::make_shared<const std::vector<std::uint8_t>>(std::move(message.bytes)),
                            std::move(message.to)});
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
            for (const SharedWorldWorker::Outgoing& message : worker->outgoing())
                sent += message.bytes.size();
        if (!turn.step) continue;
        std::size_t next = 0;
        struct Unended {};
        const auto step = [&] {
            worker->step([&](bool wait) {
                for (const SharedWorldWorker::Outgoing& message : worker->outgoing())
                    sent += message.bytes.size();
                if (!wait) return;
                if (next == turn.within.size()) throw Unended{};
                for (const Bytes& bytes : turn.within[next++]) {
                    DecodedMessage decoded = decode_message(*bytes);
                    worker->take(decoded.header, std::move(decoded.message));
                }
            });
        };
        try {
            spent += cost_of(step);
        } catch (const Unended&) {  // it was killed, or the run ended
            break;
        }
    }
    if (sent != p.sent)
        throw std::logic_error("simulated processors: a worker did otherwise when it was alone");
    return spent;
}

void Machine::repeat_alone(DistributedResult& result) const {
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
    if (how_.repeat_alone) repeat_alone(result);
    return result;
}

}  // namespace

DistributedResult simulate_processors(const WorldScene& scene, const DistributedSettings& settings,
                                      const SimulatedProcessors& processors, DistributedObserver& observer) {
    if (processors.count < 1) throw InputError("", "no processor", "1 or more");
    return Machine(scene, settings, processors, observer).run();
}

}  // namespace sim
