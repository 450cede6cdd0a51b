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
constexpr auto kStruckSilence = 1s;
constexpr auto kStruckAnswerWithin = 30s;
constexpr auto kStopWithin = 1s;
constexpr auto kStruckPaused = 250ms;  // a longer gap between two looks is ours, not the workers' silence
constexpr int kStruckMostWorkers = 256;
constexpr std::int64_t kStruckLargestMessage = 64 << 20;

}  // namespace

StruckWorkers::StruckWorkers(std::vector<BodyDefinition> bodies, const WorkerLaunch& launch)
    : definitions_(std::move(bodies)),
      records_(definitions_.size()),
      outcomes_(definitions_.size()),
      answered_(definitions_.size(), 0),
      here_(definitions_.size()),
      join_within_(launch.join_within_s),
      router_(context_, zmq::socket_type::router) {
    if (launch.count < 0 || launch.count > kStruckMostWorkers) {
        throw InputError("", std::to_string(launch.count) + " workers",
                         "0 to " + std::to_string(kStruckMostWorkers));
    }
    for (const BodyDefinition& definition : definitions_) check_body(definition);
    report_.count = launch.count;
    bind();
    slots_.reserve(launch.count);
    for (int i = 0; i < launch.count; ++i)
        slots_.push_back(Slot{WorkerProcess(launch, folder_.endpoint()), {}, true, {}, {}, {}});
    wait_for_hellos();
    share_out();
}

void StruckWorkers::bind() {
    router_.set(zmq::sockopt::linger, 0);
    router_.set(zmq::sockopt::sndhwm, 1000);
    router_.set(zmq::sockopt::rcvhwm, 10000);
    router_.set(zmq::sockopt::sndtimeo, 1000);
    router_.set(zmq::sockopt::maxmsgsize, kStruckLargestMessage);
    router_.set(zmq::sockopt::router_mandatory, true);
    router_.bind(folder_.endpoint());
}

void StruckWorkers::wait_for_hellos() {
    const Clock::time_point start = Clock::now();
    const auto missing = [](const Slot& slot) { return slot.alive && slot.identity.empty(); };
    while (std::any_of(slots_.begin(), slots_.end(), missing)) {
        receive(kStruckPoll);
        for (Slot& slot : slots_) {
            if (missing(slot) && slot.process.has_ended()) {
                if (slot.process.was_killed()) {
                    lose(slot);  // as later: the others take its share
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
    settle_losses();
    report_.bodies_reowned = 0;  // the first owners
}

StruckWorkers::~StruckWorkers() {
    for (Slot& slot : slots_) {
        if (slot.alive && !send(slot, Stop{})) slot.process.kill();
    }
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
    look_after_workers();
    settle_losses();
    request_ = &request;
    last_t_s_ = request.t_s;
    ++step_;
    for (Slot& slot : slots_) {
        if (slot.alive && !slot.bodies.empty()) dispatch(slot, slot.bodies);
    }
    for (std::uint32_t b = 0; b < here_.size(); ++b) {
        if (here_[b]) step_here(b);
    }
    settle_losses();
    while (waiting()) {
        receive(kStruckPoll);
        look_after_workers();
        settle_losses();
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
    send(slot, Step{epoch_, step_, bodies, request_for(bodies)});
}

void StruckWorkers::assign(Slot& slot, const std::vector<std::uint32_t>& bodies) {
    Assign message{++epoch_, {}};
    std::vector<std::uint32_t> unanswered;
    for (const std::uint32_t b : bodies) {
        message.bodies.push_back({b, definitions_[b], records_[b]});
        slot.bodies.push_back(b);
        if (answered_[b] < step_) unanswered.push_back(b);
    }
    if (send(slot, message) && request_ && !unanswered.empty()) dispatch(slot, unanswered);
}

bool StruckWorkers::send(Slot& slot, const Message& message) {
    const std::vector<std::uint8_t> bytes = encode(message);
    try {
        if (router_.send(zmq::buffer(slot.identity), zmq::send_flags::sndmore) &&
            router_.send(zmq::buffer(bytes), zmq::send_flags::none)) {
            return true;
        }
    } catch (const zmq::error_t&) {  // gone, or its queue is full
    }
    lose(slot);
    return false;
}

void StruckWorkers::receive(std::chrono::milliseconds timeout) {
    zmq::pollitem_t item{router_.handle(), 0, ZMQ_POLLIN, 0};
    try {
        zmq::poll(&item, 1, timeout);
        zmq::message_t identity, frame;
        while (router_.recv(identity, zmq::recv_flags::dontwait)) {
            if (!identity.more()) continue;
            if (!router_.recv(frame, zmq::recv_flags::dontwait)) continue;
            const bool single = !frame.more();
            while (frame.more()) (void)router_.recv(frame, zmq::recv_flags::dontwait);
            if (single) take(identity.to_string(), frame);
        }
    } catch (const zmq::error_t& e) {
        if (e.num() != EINTR) throw;
    }
}

void StruckWorkers::take(const std::string& identity, const zmq::message_t& frame) {
    const auto named =
        std::find_if(slots_.begin(), slots_.end(), [&](const Slot& s) { return s.identity == identity; });
    const auto process = [&](const Secret& secret) {
        return std::find_if(slots_.begin(), slots_.end(),
                            [&](const Slot& s) { return s.alive && s.process.secret() == secret; });
    };
    try {
        Message message = decode({frame.data<std::uint8_t>(), frame.size()});
        if (const auto* hello = std::get_if<Hello>(&message)) {
            const auto slot = process(hello->secret);
            if (slot == slots_.end() || !slot->identity.empty()) return;
            slot->identity = identity;
            send(*slot, Welcome{});
        } else if (const auto* heartbeat = std::get_if<Heartbeat>(&message)) {
            const auto slot = process(heartbeat->secret);
            if (slot != slots_.end()) slot->heard = Clock::now();
        } else if (named != slots_.end() && named->alive) {
            auto* answer = std::get_if<Answer>(&message);
            answer ? accept(*named, *answer) : lose(*named);
        }
    } catch (const DecodeError&) {
        if (named != slots_.end() && named->alive) lose(*named);  // from anyone else it is noise
    }
}

bool StruckWorkers::fits(const Pending& pending, const Answer& answer) const {
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

void StruckWorkers::accept(Slot& slot, Answer& answer) {
    slot.heard = Clock::now();
    const auto pending = std::find_if(slot.pending.begin(), slot.pending.end(),
                                      [&](const Pending& p) { return request_ && fits(p, answer); });
    if (pending == slot.pending.end()) return lose(slot);
    for (BodyOutcome& outcome : answer.outcomes) {
        const std::uint32_t b = outcome.body;
        records_[b] = {outcome.state, true, request_->t_s};
        answered_[b] = step_;
        outcomes_[b] = std::move(outcome);
    }
    slot.pending.erase(pending);
}

void StruckWorkers::look_after_workers() {
    const Clock::time_point now = Clock::now();
    const bool paused = now - std::exchange(last_look_, now) > kStruckPaused;
    for (Slot& slot : slots_) {
        if (!slot.alive) continue;
        if (paused) slot.heard = now;
        bool lost = slot.process.has_ended();
        for (const Pending& pending : slot.pending) {
            lost = lost || now - std::max(slot.heard, pending.since) > kStruckSilence ||
                   now - pending.since > kStruckAnswerWithin;
        }
        if (lost) lose(slot);
    }
}

void StruckWorkers::lose(Slot& slot) {
    if (!slot.alive) return;
    slot.alive = false;
    slot.process.kill();
    ++report_.lost;
    report_.bodies_reowned += static_cast<int>(slot.bodies.size());
    orphans_.insert(orphans_.end(), slot.bodies.begin(), slot.bodies.end());
    slot.bodies.clear();
    slot.pending.clear();
}

void StruckWorkers::settle_losses() {
    while (!orphans_.empty()) {
        std::vector<std::uint32_t> bodies = std::exchange(orphans_, {});
        std::vector<Slot*> living;
        for (Slot& slot : slots_) {
            if (slot.alive) living.push_back(&slot);
        }
        if (living.empty()) return own_here(bodies);
        std::vector<std::vector<std::uint32_t>> shares(living.size());
        for (const std::uint32_t body : bodies) shares[next_slot_++ % shares.size()].push_back(body);
        for (std::size_t i = 0; i < living.size(); ++i) {
            if (shares[i].empty()) continue;
            if (living[i]->alive) {
                assign(*living[i], shares[i]);
            } else {
                orphans_.insert(orphans_.end(), shares[i].begin(), shares[i].end());
            }
        }
    }
}

void StruckWorkers::own_here(const std::vector<std::uint32_t>& bodies) {
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
