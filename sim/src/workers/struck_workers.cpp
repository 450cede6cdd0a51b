#include "workers/struck_workers.h"

#include <algorithm>
#include <stdexcept>
#include <thread>
#include <utility>

#include "sim/errors.h"
#include "struck/request_check.h"

namespace sim {
namespace {

using namespace std::chrono_literals;
constexpr auto kStruckPoll = 20ms;
constexpr auto kStruckAnswerWithin = 30s;
// After a longer gap between two checks this process was paused, and the workers were not late.
constexpr auto kStruckPaused = 250ms;
constexpr auto kStopWithin = 1s;
constexpr int kStruckMostWorkers = 256;
constexpr std::int64_t kStruckLargestMessage = 64 << 20;

WorkerGate::Settings struck_gate() {
    WorkerGate::Settings settings;
    settings.largest_message = kStruckLargestMessage;
    return settings;
}

}  // namespace

StruckWorkers::StruckWorkers(std::vector<BodyDefinition> bodies, const WorkerLaunch& launch)
    : definitions_(std::move(bodies)),
      records_(definitions_.size()),
      outcomes_(definitions_.size()),
      answered_(definitions_.size(), 0),
      here_(definitions_.size()),
      join_within_(launch.join_within_s),
      gate_(struck_gate()) {
    if (launch.count < 0 || launch.count > kStruckMostWorkers) {
        throw InputError("", std::to_string(launch.count) + " workers",
                         "0 to " + std::to_string(kStruckMostWorkers));
    }
    for (const BodyDefinition& definition : definitions_) check_body(definition);
    report_.count = launch.count;
    slots_.reserve(static_cast<std::size_t>(launch.count));
    for (int i = 0; i < launch.count; ++i) {
        slots_.push_back({WorkerProcess(launch, gate_.private_endpoint()), false, true, {}, {}});
        gate_.expect(slots_.back().process.secret());
    }
    wait_for_joins();
    share_out();
}

void StruckWorkers::wait_for_joins() {
    const Clock::time_point start = Clock::now();
    const auto missing = [](const Slot& slot) { return slot.alive && !slot.joined; };
    while (std::any_of(slots_.begin(), slots_.end(), missing)) {
        receive(kStruckPoll);
        for (Slot& slot : slots_) {
            if (missing(slot) && slot.process.has_ended()) {
                if (slot.process.was_killed()) {
                    lose(slot);  // the others get its share
                    continue;
                }
                throw WorkerError("a worker ended before it joined: " + slot.process.ending());
            }
        }
        for (Slot& slot : slots_)
            if (missing(slot) && Clock::now() - start > join_within_) lose(slot);  // it may be stopped
    }
}

void StruckWorkers::share_out() {
    std::vector<std::uint32_t> all(definitions_.size());
    for (std::size_t i = 0; i < all.size(); ++i) all[i] = static_cast<std::uint32_t>(i);
    orphans_ = all;
    reassign_orphans();
    report_.bodies_reowned = 0;  // these are the first owners
}

StruckWorkers::~StruckWorkers() {
    for (const Slot& slot : slots_)
        if (slot.alive) send(slot, EndOfRun{});
    const Clock::time_point deadline = Clock::now() + kStopWithin;
    const auto running = [](Slot& slot) { return !slot.process.has_ended(); };
    while (std::any_of(slots_.begin(), slots_.end(), running) && Clock::now() < deadline)
        std::this_thread::sleep_for(2ms);
}

StepReply StruckWorkers::step(const StepRequest& request) {
    check_request(request, definitions_.size());
    if (step_ > 0 && !request.anew && request.t_s < last_t_s_)
        throw InputError("request.t_s is before the last step's");
    receive(0ms);
    request_ = nullptr;
    check_workers();
    reassign_orphans();
    request_ = &request;
    last_t_s_ = request.t_s;
    ++step_;
    for (Slot& slot : slots_) {
        if (slot.alive && !slot.bodies.empty()) dispatch(slot, slot.bodies);
    }
    for (std::uint32_t b = 0; b < here_.size(); ++b) {
        if (here_[b]) step_here(b);
    }
    reassign_orphans();
    while (waiting()) {
        receive(kStruckPoll);
        check_workers();
        reassign_orphans();
    }
    request_ = nullptr;
    return merge(outcomes_, request);
}

bool StruckWorkers::waiting() const {
    return std::any_of(answered_.begin(), answered_.end(), [this](std::uint64_t n) { return n < step_; });
}

StepRequest StruckWorkers::request_for(const std::vector<std::uint32_t>& bodies) const {
    const auto other = [&](const Impulse& impulse) {
        return std::find(bodies.begin(), bodies.end(), impulse.body) == bodies.end();
    };
    StepRequest own = *request_;
    std::erase_if(own.folded, other);
    std::erase_if(own.confirmed, other);
    for (PictureRequest& picture : own.pictures) {
        std::erase_if(picture.provisional, [&](const WeightedImpulse& w) { return other(w.impulse); });
    }
    return own;
}

void StruckWorkers::dispatch(Slot& slot, const std::vector<std::uint32_t>& bodies) {
    slot.pending.push_back({epoch_, bodies, Clock::now()});
    send(slot, StruckStep{epoch_, step_, bodies, request_for(bodies)});
}

void StruckWorkers::assign(Slot& slot, const std::vector<std::uint32_t>& bodies) {
    StruckAssign message{++epoch_, {}};
    std::vector<std::uint32_t> unanswered;
    for (const std::uint32_t b : bodies) {
        message.bodies.push_back({b, definitions_[b], records_[b]});
        slot.bodies.push_back(b);
        if (answered_[b] < step_) unanswered.push_back(b);
    }
    send(slot, message);
    if (request_ && !unanswered.empty()) dispatch(slot, unanswered);
}

void StruckWorkers::send(const Slot& slot, const WorkerMessage& message) {
    const auto number = static_cast<std::uint32_t>(&slot - slots_.data());
    gate_.send({number}, std::make_shared<const std::vector<std::uint8_t>>(encode({}, message)));
}

void StruckWorkers::receive(std::chrono::milliseconds timeout) {
    for (const WorkerGate::Event& event : gate_.wait(timeout)) handle(event);
}

void StruckWorkers::handle(const WorkerGate::Event& event) {
    if (event.kind == WorkerGate::Event::Kind::asks_to_join) return join(event);
    Slot& slot = slots_[event.worker];
    if (!slot.alive) return;
    if (event.kind == WorkerGate::Event::Kind::lost) return lose(slot);
    try {
        DecodedMessage m = decode_message(event.bytes);
        auto* answer = std::get_if<StruckAnswer>(&m.message);
        answer ? accept(slot, *answer) : lose(slot);
    } catch (const DecodeError&) {
        lose(slot);
    }
}

void StruckWorkers::join(const WorkerGate::Event& event) {
    const auto slot = std::ranges::find_if(slots_, [&](const Slot& s) {
        return s.alive && !s.joined && s.process.secret() == event.request.secret;
    });
    if (slot == slots_.end()) return gate_.refuse(event.stranger, "this play has workers of its own only");
    gate_.admit(event.stranger, static_cast<std::uint32_t>(slot - slots_.begin()), event.request.secret);
    slot->joined = true;
    send(*slot, StruckAssign{});
}

bool StruckWorkers::answers(const Pending& pending, const StruckAnswer& answer) const {
    if (pending.epoch != answer.epoch || answer.step != step_ ||
        pending.bodies.size() != answer.outcomes.size())
        return false;
    for (std::size_t i = 0; i < pending.bodies.size(); ++i) {
        const BodyOutcome& outcome = answer.outcomes[i];
        if (outcome.body != pending.bodies[i] || outcome.pictures.size() != request_->pictures.size() ||
            outcome.clearance_m.size() != request_->paths.size()) {
            return false;
        }
    }
    return true;
}

void StruckWorkers::accept(Slot& slot, StruckAnswer& answer) {
    const auto pending = std::find_if(slot.pending.begin(), slot.pending.end(),
                                      [&](const Pending& p) { return request_ && answers(p, answer); });
    if (pending == slot.pending.end()) return lose(slot);
    for (BodyOutcome& outcome : answer.outcomes) {
        const std::uint32_t b = outcome.body;
        records_[b] = {outcome.state, true, request_->t_s};
        answered_[b] = step_;
        outcomes_[b] = std::move(outcome);
    }
    slot.pending.erase(pending);
}

void StruckWorkers::check_workers() {
    const Clock::time_point now = Clock::now();
    const bool paused = now - std::exchange(checked_, now) > kStruckPaused;
    for (Slot& slot : slots_) {
        if (!slot.alive) continue;
        for (Pending& pending : slot.pending)
            if (paused) pending.since = now;
        const bool late = std::ranges::any_of(
            slot.pending, [&](const Pending& pending) { return now - pending.since > kStruckAnswerWithin; });
        if (slot.process.has_ended() || late) lose(slot);
    }
}

void StruckWorkers::lose(Slot& slot) {
    if (!slot.alive) return;
    slot.alive = false;
    slot.process.kill();
    gate_.dismiss(static_cast<std::uint32_t>(&slot - slots_.data()));
    ++report_.lost;
    report_.bodies_reowned += static_cast<int>(slot.bodies.size());
    orphans_.insert(orphans_.end(), slot.bodies.begin(), slot.bodies.end());
    slot.bodies.clear();
    slot.pending.clear();
}

void StruckWorkers::reassign_orphans() {
    while (!orphans_.empty()) {
        std::vector<std::uint32_t> bodies = std::exchange(orphans_, {});
        std::vector<Slot*> living;
        for (Slot& slot : slots_) {
            if (slot.alive) living.push_back(&slot);
        }
        if (living.empty()) return take_over(bodies);
        std::vector<std::vector<std::uint32_t>> shares(living.size());
        for (const std::uint32_t body : bodies) shares[next_slot_++ % shares.size()].push_back(body);
        for (std::size_t i = 0; i < living.size(); ++i)
            if (!shares[i].empty()) assign(*living[i], shares[i]);
    }
}

void StruckWorkers::take_over(const std::vector<std::uint32_t>& bodies) {
    for (const std::uint32_t body : bodies) {
        here_[body] = std::make_unique<SteppedBody>(body, definitions_[body], records_[body]);
        if (request_ && answered_[body] < step_) step_here(body);
    }
}

void StruckWorkers::step_here(std::uint32_t body) {
    here_[body]->step(*request_, outcomes_[body]);
    records_[body] = here_[body]->record();
    answered_[body] = step_;
}

std::unique_ptr<Simulation> make_distributed_simulation(std::vector<BodyDefinition> bodies,
                                                        const WorkerLaunch& launch) {
    return std::make_unique<StruckWorkers>(std::move(bodies), launch);
}

}  // namespace sim
