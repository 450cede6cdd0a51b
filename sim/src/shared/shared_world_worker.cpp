#include "shared/shared_world_worker.h"

#include <algorithm>
#include <utility>

#include "shared/structures.h"

namespace sim {
namespace {

std::vector<Mishap> mishaps_of(const SharedWorld& world, std::uint64_t step) {
    std::vector<Mishap> mishaps;
    for (const QuarantinedBody& q : world.quarantined())
        if (q.step == step && world.own(q.body))
            mishaps.push_back({Mishap::Kind::quarantined, static_cast<std::uint32_t>(q.body), step, q.what});
    for (const FirstStep& first : world.limited())
        if (first.step == step && world.own(first.number))
            mishaps.push_back({Mishap::Kind::limited, static_cast<std::uint32_t>(first.number), step, {}});
    for (const FirstStep& first : world.broken())
        if (first.step == step)
            mishaps.push_back({Mishap::Kind::broken, static_cast<std::uint32_t>(first.number), step, {}});
    return mishaps;
}

}  // namespace

SharedWorldWorker::SharedWorldWorker(const SceneMessage& scene)
    : self_(scene.worker),
      exchange_(scene),
      market_(scene.worker, scene.settings.market, scene.settings.bound),
      // The step of the application's view is behind this worker's by the bound and one at most.
      forgets_after_(gather_patience(scene.settings.bound) +
                     static_cast<std::uint64_t>(scene.settings.bound) + 1) {
    for (const WorldEvent& event : scene.scene.events)
        if (!event.slowing.empty()) events_.push_back(event);
    exchange_.send_by([this](std::vector<std::uint8_t>&& bytes) { queue_.push_back(std::move(bytes)); });
    exchange_.report_to([this](const MessageHeader& header, double smoothed_s, std::uint32_t own) {
        market_.heard(header, smoothed_s, own);
    });
}

void SharedWorldWorker::take(const MessageHeader& header, WorkerMessage&& message) {
    if (left_ || ended_) return;
    std::visit([&](auto&& m) { take_message(header, std::forward<decltype(m)>(m)); }, std::move(message));
    if (left_ || ended_) return;
    exchange_.follow();
    if (exchange_.owes()) publish({});
    trade();  // the next step may have to wait for the buyer
}

void SharedWorldWorker::take_message(const MessageHeader& header, Members&& message) {
    epoch_ = header.epoch;
    market_.members(message.workers);
    exchange_.members(message, epoch_);
    std::erase_if(sellers_, [&message](const auto& seller) {
        return std::find(message.workers.begin(), message.workers.end(), seller.first) ==
               message.workers.end();
    });
}

void SharedWorldWorker::take_message(const MessageHeader& header, Ownership&& message) {
    epoch_ = header.epoch;
    market_.registered(header.epoch, message);
    if (message.owner == self_) sellers_.erase(message.from);
    exchange_.own(message, header.epoch);
}

void SharedWorldWorker::take_message(const MessageHeader& header, PastMessage&& message) {
    exchange_.take(header, message);
}

void SharedWorldWorker::take_message(const MessageHeader& header, NeighbourMessage&& message) {
    exchange_.take(header, std::move(message));
}

void SharedWorldWorker::take_message(const MessageHeader& header, FoundMessage&& message) {
    exchange_.take(header, std::move(message));
}

void SharedWorldWorker::take_message(const MessageHeader& header, Offer&& message) {
    OfferAnswer answer = {header.worker, message.number, false};
    // Who has nothing begins where its first seller is, which others may be behind.
    const bool begins = exchange_.has_nothing() && !sellers_.empty();
    if ((!draining_ || message.gathers) && !exchange_.at_end() && !begins)
        answer = market_.answer(header.worker, message);
    if (answer.accepted) sellers_[header.worker] = exchange_.steps_done() + 1;
    send(answer);
}

void SharedWorldWorker::take_message(const MessageHeader& header, OfferAnswer&& message) {
    if (market_.answered(header.worker, message)) handover_step_ = header.step + 1;
}

// What was asked for last counts.
void SharedWorldWorker::take_message(const MessageHeader& header, Gather&& message) {
    if (message.to == kApplication) {
        gives_up_ = draining_;
        return;
    }
    for (Asked& before : gathers_)
        std::erase_if(before.what.bodies, [&message](std::uint32_t body) {
            return std::ranges::find(message.bodies, body) != message.bodies.end();
        });
    std::erase_if(gathers_, [](const Asked& asked) { return asked.what.bodies.empty(); });
    gathers_.push_back({header.step, std::move(message)});
}

void SharedWorldWorker::take_message(const MessageHeader& header, EndOfRun&& message) {
    (void)header, (void)message;
    ended_ = true;
}

void SharedWorldWorker::take_message(const MessageHeader& header, Refusal&& message) {
    (void)header, (void)message;
    ended_ = true;
}

void SharedWorldWorker::take_message(const MessageHeader& header, Beat&& message) {
    (void)header, (void)message;
}

template <typename Other>
void SharedWorldWorker::take_message(const MessageHeader& header, Other&& message) {
    (void)header, (void)message;
    throw DecodeError("found a message that no worker gets, expected one for a worker");
}

bool SharedWorldWorker::ready() const {
    const bool bodies_are_due = std::ranges::any_of(
        sellers_, [this](const auto& seller) { return last_before(seller) <= exchange_.steps_done(); });
    return !left_ && !ended_ && !bodies_are_due && !hands_over() && !market_.awaits_answer() &&
           exchange_.ready();
}

// The step that this worker does not pass before the bodies come that it bought.
std::uint64_t SharedWorldWorker::last_before(
    const std::pair<const std::uint32_t, std::uint64_t>& seller) const {
    return std::max(seller.second, exchange_.steps_of(seller.first));
}

// It sold bodies, and is at the step at which they change owners.
bool SharedWorldWorker::hands_over() const {
    return market_.awaits_registration() || (market_.is_sold() && exchange_.steps_done() >= handover_step_);
}

std::string SharedWorldWorker::waits_for() const {
    if (ready()) return "nothing";
    if (left_ || ended_) return "nobody any more";
    if (exchange_.own_bodies() == 0) return "bodies";
    if (market_.awaits_answer()) return "an answer to its offer";
    if (hands_over()) return "the others, to hand bodies over";
    if (sellers_.empty()) return std::to_string(exchange_.lead()).append(" steps for the slowest");
    std::string who = "bodies from";
    for (const auto& [seller, step] : sellers_) who.append(" ").append(std::to_string(seller));
    return who;
}

void SharedWorldWorker::step() {
    lead_ = exchange_.lead();
    exchange_.step();
}

double SharedWorldWorker::work() const {
    const SharedWorld& world = exchange_.world();
    double sum = 0;
    for (int i = 0; i < world.bodies(); ++i)
        if (world.own(i)) sum += world.work(i);
    return sum;
}

void SharedWorldWorker::worked(const Times& times) {
    exchange_.weigh();
    market_.worked(exchange_.steps_done(), times.seconds, work(), exchange_.own_bodies());
    publish(times);
    if (exchange_.owes()) publish({});
    trade();
    exchange_.follow();
}

void SharedWorldWorker::publish(const Times& times) {
    const SharedWorld& world = exchange_.world();
    StepReport report;
    report.seconds = static_cast<float>(times.seconds);
    report.smoothed_s = static_cast<float>(market_.smoothed());
    report.waited_s = static_cast<float>(times.waited_s);
    report.processor_s = static_cast<float>(times.processor_s);
    report.lead = static_cast<std::uint32_t>(std::max(0, lead_));
    report.ghost_age = static_cast<std::uint32_t>(std::max(0, exchange_.ghost_age()));
    report.cross_contacts = static_cast<std::uint32_t>(world.cross_contacts());
    report.own = static_cast<std::uint32_t>(exchange_.own_bodies());
    report.outside_impulse = world.outside_impulse();
    report.mishaps = mishaps_of(world, exchange_.steps_done());
    exchange_.publish(epoch_, report);
}

// Between steps, after states are on their way: one offer a step, and another when bodies are handed over. Who leaves offers whatever
// it was asked for.
void SharedWorldWorker::trade() {
    const bool sold = hand_over();
    if (may_leave()) return leave();
    if (!sold && !draining_ && offered_at_ == exchange_.steps_done()) return;
    offered_at_ = exchange_.steps_done();
    if (exchange_.at_end() && !draining_) return;
    if (const std::optional<Offer> offer = make_offer()) send(*offer);
}

// What was asked for comes before what is dear.
std::optional<Offer> SharedWorldWorker::make_offer() {
    while (!gathers_.empty() && !market_.is_selling()) {
        Asked asked = std::move(gathers_.front());
        gathers_.pop_front();
        if (exchange_.steps_done() > asked.step + forgets_after_) continue;
        const SharedWorld& world = exchange_.world();
        std::erase_if(asked.what.bodies, [&world](std::uint32_t body) {
            return body >= static_cast<std::uint32_t>(world.bodies()) || !world.own(static_cast<int>(body));
        });
        if (const std::optional<Offer> offer = market_.make_offer(asked.what)) return offer;
    }
    if (draining_ || !market_.wants_to_sell()) return std::nullopt;
    return market_.make_offer(exchange_.holdings());
}

bool SharedWorldWorker::hand_over() {
    if (exchange_.steps_done() < handover_step_ || !exchange_.may_give()) return false;
    const std::optional<Offer> sold = market_.hand_over();
    if (!sold) return false;
    Handover handover = exchange_.give(sold->bodies);
    handover.to = sold->to, handover.number = sold->number;
    send(handover);
    return true;
}

void SharedWorldWorker::drain() {
    if (!left_ && !std::exchange(draining_, true)) send(Leaves{});
}

// All is sold, or there is nobody to sell to.
bool SharedWorldWorker::may_leave() const {
    if (!draining_ || gives_up_) return gives_up_;
    return exchange_.has_nothing() && sellers_.empty() && !market_.is_selling() &&
           !market_.awaits_registration();
}

void SharedWorldWorker::stop_waiting_for_answer() {
    market_.stop_waiting();
    trade();
}

// Bodies handed over without a buyer are distributed by the application.
void SharedWorldWorker::leave() {
    std::vector<std::uint32_t> bodies;
    const SharedWorld& world = exchange_.world();
    for (int i = 0; i < world.bodies(); ++i)
        if (world.own(i) && world.definition(i).moves()) bodies.push_back(static_cast<std::uint32_t>(i));
    if (!bodies.empty()) {
        Handover handover = exchange_.give(bodies);
        handover.to = kApplication;
        send(handover);
    }
    send(Drained{});
    left_ = true;
}

void SharedWorldWorker::send(const WorkerMessage& message) {
    queue_.push_back(encode({self_, epoch_, exchange_.steps_done()}, message));
}

double SharedWorldWorker::slowing() const {
    double factor = 1;
    for (const WorldEvent& event : events_) {
        if (event.step > exchange_.steps_done()) break;
        for (const Slowing& slowing : event.slowing)
            if (slowing.worker == static_cast<int>(self_)) factor = slowing.factor;
    }
    return factor;
}

}  // namespace sim
