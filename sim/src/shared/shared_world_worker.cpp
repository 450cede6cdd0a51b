#include "shared/shared_world_worker.h"

#include <algorithm>
#include <type_traits>
#include <utility>

#include "shared/structures.h"

namespace sim {
namespace {

// Mishaps of own bodies and constraints in a step.
std::vector<Mishap> mishaps_of(const SharedWorld& world, std::uint64_t step) {
    std::vector<Mishap> mishaps;
    const auto add = [&](Mishap::Kind kind, int number, std::uint64_t at, const std::string& what) {
        if (at == step && (kind == Mishap::Kind::broken || world.own(number)))
            mishaps.push_back({kind, static_cast<std::uint32_t>(number), step, what});
    };
    for (const QuarantinedBody& q : world.quarantined())
        add(Mishap::Kind::quarantined, q.body, q.step, q.what);
    for (const FirstStep& first : world.limited()) add(Mishap::Kind::limited, first.number, first.step, {});
    for (const FirstStep& first : world.broken()) add(Mishap::Kind::broken, first.number, first.step, {});
    return mishaps;
}

}  // namespace

SharedWorldWorker::SharedWorldWorker(const SceneMessage& scene)
    : self_(scene.worker),
      exchange_(scene),
      market_(scene.worker, scene.settings.market, scene.settings.bound),
      // The application's view is behind this worker by at most the bound and one step.
      requests_hold_(gather_patience(scene.settings.bound) +
                     static_cast<std::uint64_t>(scene.settings.bound) + 1) {
    for (const WorldEvent& event : scene.scene.events)
        if (!event.slowing.empty()) events_.push_back(event);
    exchange_.send_by([this](std::vector<std::uint8_t>&& bytes) { queue_.push_back(std::move(bytes)); });
    exchange_.report_to([this](const MessageHeader& header, double smoothed_s, std::uint32_t own) {
        market_.receive_report(header, smoothed_s, own);
    });
}

void SharedWorldWorker::receive(const MessageHeader& header, WorkerMessage&& message) {
    if (left_ || ended_) return;
    std::visit([&](auto&& m) { handle(header, std::forward<decltype(m)>(m)); }, std::move(message));
    if (left_ || ended_) return;
    exchange_.advance_without_bodies();
    if (exchange_.must_publish()) publish({});
    trade();  // the next step may have to wait for the buyer
}

void SharedWorldWorker::handle(const MessageHeader& header, Members&& message) {
    epoch_ = header.epoch;
    market_.set_members(message.workers);
    exchange_.set_members(message, epoch_);
    std::erase_if(sellers_, [&message](const auto& seller) {
        return std::ranges::find(message.workers, seller.first) == message.workers.end();
    });
}

void SharedWorldWorker::handle(const MessageHeader& header, Ownership&& message) {
    epoch_ = header.epoch;
    market_.register_sale(header.epoch, message);
    if (message.owner == self_) sellers_.erase(message.from);
    exchange_.set_owner(message, header.epoch);
}

void SharedWorldWorker::handle(const MessageHeader& header, Offer&& message) {
    OfferAnswer answer = {header.worker, message.number, false};
    // A worker without bodies begins at the step of its first seller. A second seller may be behind that
    // step.
    const bool begins = exchange_.has_nothing() && !sellers_.empty();
    if ((!draining_ || message.gathers) && !exchange_.at_end() && !begins)
        answer = market_.answer(header.worker, message);
    if (answer.accepted) sellers_[header.worker] = exchange_.steps_done() + 1;
    send(answer);
}

void SharedWorldWorker::handle(const MessageHeader& header, OfferAnswer&& message) {
    if (market_.receive_answer(header.worker, message)) handover_step_ = header.step + 1;
}

// The last request for a body replaces earlier ones.
void SharedWorldWorker::handle(const MessageHeader& header, Gather&& message) {
    if (message.to == kApplication) {
        gives_up_ = draining_;
        return;
    }
    for (Request& before : requests_)
        std::erase_if(before.what.bodies, [&message](std::uint32_t body) {
            return std::ranges::find(message.bodies, body) != message.bodies.end();
        });
    std::erase_if(requests_, [](const Request& request) { return request.what.bodies.empty(); });
    requests_.push_back({header.step, std::move(message)});
}

template <typename Other>
void SharedWorldWorker::handle(const MessageHeader& header, Other&& message) {
    using Message = std::remove_cvref_t<Other>;
    if constexpr (requires { exchange_.receive(header, std::move(message)); })
        exchange_.receive(header, std::move(message));
    else if constexpr (std::is_same_v<Message, EndOfRun> || std::is_same_v<Message, Refusal>)
        ended_ = true;
    else if constexpr (!std::is_same_v<Message, Beat>)
        throw DecodeError("found a message that no worker gets, expected one for a worker");
}

bool SharedWorldWorker::ready() const {
    return !left_ && !ended_ && !is_at_purchase() && !is_at_handover() && !market_.awaits_answer() &&
           exchange_.ready();
}

// Whether this worker has to wait here for bodies that it bought.
bool SharedWorldWorker::is_at_purchase() const {
    return std::ranges::any_of(sellers_, [this](const auto& seller) {
        return std::max(seller.second, exchange_.steps_of(seller.first)) <= exchange_.steps_done();
    });
}

// Whether this worker has to wait here until bodies that it sold have changed owners.
bool SharedWorldWorker::is_at_handover() const {
    return market_.awaits_registration() || (market_.is_sold() && exchange_.steps_done() >= handover_step_);
}

std::string SharedWorldWorker::waits_for() const {
    if (ready()) return "nothing";
    if (left_ || ended_) return "nobody any more";
    if (exchange_.own_bodies() == 0) return "bodies";
    if (market_.awaits_answer()) return "an answer to its offer";
    if (is_at_handover()) return "the others, to hand bodies over";
    if (sellers_.empty()) return std::to_string(exchange_.lead()).append(" steps for the slowest");
    std::string what = "bodies from";
    for (const auto& [seller, step] : sellers_) what.append(" ").append(std::to_string(seller));
    return what;
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

void SharedWorldWorker::end_step(const Times& times) {
    exchange_.update_costs();
    market_.end_step(exchange_.steps_done(), times.seconds, work(), exchange_.own_bodies());
    publish(times);
    if (exchange_.must_publish()) publish({});
    trade();
    exchange_.advance_without_bodies();
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

// Trades between steps, once the step's messages are on their way: one offer a step, and another one after a
// handover. A worker that leaves makes offers at any time.
void SharedWorldWorker::trade() {
    const bool sold = hand_over();
    if (may_leave()) return leave();
    if (!sold && !draining_ && offered_at_ == exchange_.steps_done()) return;
    offered_at_ = exchange_.steps_done();
    if (exchange_.at_end() && !draining_) return;
    if (const std::optional<Offer> offer = make_offer()) send(*offer);
}

// Requests of the application come before load balancing.
std::optional<Offer> SharedWorldWorker::make_offer() {
    while (!requests_.empty() && !market_.is_selling()) {
        Request request = std::move(requests_.front());
        requests_.pop_front();
        if (exchange_.steps_done() > request.step + requests_hold_) continue;
        const SharedWorld& world = exchange_.world();
        std::erase_if(request.what.bodies, [&world](std::uint32_t body) {
            return body >= static_cast<std::uint32_t>(world.bodies()) || !world.own(static_cast<int>(body));
        });
        if (const std::optional<Offer> offer = market_.make_offer(request.what)) return offer;
    }
    if (draining_ || !market_.wants_to_sell()) return std::nullopt;
    return market_.make_offer(exchange_.holdings());
}

bool SharedWorldWorker::hand_over() {
    if (exchange_.steps_done() < handover_step_ || !exchange_.may_hand_over()) return false;
    const std::optional<Offer> sold = market_.hand_over();
    if (!sold) return false;
    Handover handover = exchange_.hand_over(sold->bodies);
    handover.to = sold->to, handover.number = sold->number;
    send(handover);
    return true;
}

void SharedWorldWorker::drain() {
    if (!left_ && !std::exchange(draining_, true)) send(Leaves{});
}

// Whether all bodies are sold, or no member is left to sell them to.
bool SharedWorldWorker::may_leave() const {
    if (!draining_ || gives_up_) return gives_up_;
    return exchange_.has_nothing() && sellers_.empty() && !market_.is_selling() &&
           !market_.awaits_registration();
}

void SharedWorldWorker::stop_waiting_for_answer() {
    market_.stop_waiting();
    trade();
}

// Bodies that are handed over without a buyer are distributed by the application.
void SharedWorldWorker::leave() {
    std::vector<std::uint32_t> bodies;
    const SharedWorld& world = exchange_.world();
    for (int i = 0; i < world.bodies(); ++i)
        if (world.own(i) && world.definition(i).moves()) bodies.push_back(static_cast<std::uint32_t>(i));
    if (!bodies.empty()) {
        Handover handover = exchange_.hand_over(bodies);
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
