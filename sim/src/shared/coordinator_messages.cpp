#include <algorithm>
#include <utility>

#include "shared/coordinator.h"

// Messages of members.

namespace sim {
void Coordinator::refuse(std::uint32_t worker, const std::string& why) {
    ++result_.refused_messages;
    const auto sender = senders_.find(worker);
    if (sender == senders_.end() || std::exchange(sender->second.refused, true)) return;
    observer_->note("a message of " + name(worker) + " is refused: " + why);
}

// Removes a member that sends an impossible message. Otherwise the others would wait for its step for ever.
void Coordinator::expel(std::uint32_t worker, const std::string& why) {
    refuse(worker, why);
    lose(worker, "its message was refused: " + why);
}

// While the view is at one step, a member does at most `bound` + 1 steps. In each it sends border data to
// each other member of then, and makes or answers an offer for each step of each member. This bounds what is relayed.
bool Coordinator::is_too_much(Sender& sender, std::size_t bytes) const {
    constexpr std::size_t kMessages = 256, kRepeated = 8;
    const auto steps = static_cast<std::size_t>(settings_.bound) + 2;
    if (std::exchange(sender.counted_at, view_.step()) != view_.step())
        sender.messages = sender.message_bytes = sender.offers = 0;
    sender.message_bytes += bytes;
    return ++sender.messages > kMessages + 8 * steps * most_members_ + sender.offers ||
           sender.message_bytes > kRepeated * steps * static_cast<std::size_t>(largest_message(scene_));
}

void Coordinator::receive(std::uint32_t worker, std::span<const std::uint8_t> bytes) {
    if (finished_) return;
    if (!is_member(worker)) return refuse(worker, "found a worker that is no member, expected a member");
    result_.bytes += bytes.size();
    senders_[worker].bytes += bytes.size();
    if (is_too_much(senders_[worker], bytes.size()))
        return expel(worker, "found more messages than steps need");
    try {
        DecodedMessage& decoded = senders_[worker].decoded;
        decode_message(bytes, decoded);
        if (decoded.header.worker != worker || decoded.header.epoch > epoch_ ||
            decoded.header.step > settings_.steps)
            return expel(worker, "found another worker's number, or a step or epoch to come");
        handle(decoded.header, bytes, decoded.message);
    } catch (const DecodeError& error) {
        expel(worker, error.what());
    }
}

void Coordinator::handle(const MessageHeader& header, std::span<const std::uint8_t> bytes,
                         WorkerMessage& message) {
    const std::uint32_t worker = header.worker;
    if (const auto* last = std::get_if<StateMessage>(&message)) return handle_last(header, bytes, *last);
    if (auto* update = std::get_if<UpdateMessage>(&message)) return handle_update(header, bytes, *update);
    if (auto* handover = std::get_if<Handover>(&message))
        return handle_handover(header, std::move(*handover));
    if (const auto* offer = std::get_if<Offer>(&message)) return handle_offer(header, bytes, *offer);
    if (const auto* answer = std::get_if<OfferAnswer>(&message)) return handle_answer(header, bytes, *answer);
    if (const auto* border = std::get_if<NeighbourMessage>(&message)) {
        check_.check(header, *border);
        if (is_member(border->to)) senders_[worker].sent[border->to] = header.step;
        return relay(header, bytes, border->to);
    }
    if (const auto* found = std::get_if<FoundMessage>(&message)) {
        check_.check(header, *found);
        return relay(header, bytes, found->to);
    }
    if (std::holds_alternative<Beat>(message)) return;
    if (const auto* failure = std::get_if<WorkerFailure>(&message)) return lose(worker, failure->what);
    if (std::holds_alternative<Leaves>(message)) {
        if (!leaving_.insert(worker).second) return;
        if (!started_) return send({worker}, Gather{kApplication, {}});  // it owns nothing yet
        return ask_leaving_members();
    }
    if (std::holds_alternative<Drained>(message)) {
        observer_->note(name(worker) + " leaves");
        ++result_.left;
        return remove(worker);
    }
    expel(worker, "found a message that no worker sends");
}

void Coordinator::handle_offer(const MessageHeader& header, std::span<const std::uint8_t> bytes,
                               const Offer& offer) {
    const std::uint32_t worker = header.worker;
    if (!may_offer(worker, offer)) {  // declined in the name of the buyer
        const OfferAnswer no{worker, offer.number, false};
        queue_.push_back({{worker}, shared(encode({offer.to, epoch_, view_.step()}, no))});
        return;
    }
    if (is_member(offer.to)) ++senders_[offer.to].offers;
    senders_[worker].offer = {offer.to, offer.number};
    relay(header, bytes, offer.to);
}

// The buyer's step decides at which step the bodies change owners, so it must not be one to come.
void Coordinator::handle_answer(const MessageHeader& header, std::span<const std::uint8_t> bytes,
                                const OfferAnswer& answer) {
    const Sender& buyer = senders_[header.worker];
    if (header.step > std::max(buyer.step, buyer.gained_at) + 1)
        return expel(header.worker, "found a step that it has not published");
    if (!is_member(answer.to)) return;  // the seller has left meanwhile
    std::optional<std::pair<std::uint32_t, std::uint32_t>>& offer = senders_[answer.to].offer;
    if (offer != std::pair(header.worker, answer.number)) return;  // no offer waits for it
    offer.reset();
    if (answer.accepted) awaited_[{header.worker, answer.to}] = false;
    relay(header, bytes, answer.to);
}

void Coordinator::relay(const MessageHeader& header, std::span<const std::uint8_t> bytes, std::uint32_t to) {
    if (to == header.worker) return refuse(header.worker, "found a message to itself");
    if (is_member(to)) queue_.push_back({{to}, shared(bytes)});  // else it has left meanwhile
}

bool Coordinator::is_valid(std::uint32_t body, Eigen::Index modes) const {
    return body < bodies_.size() && bodies_[body].record.state.q.size() == modes;
}

// Whether these are states that the worker's bodies can have.
bool Coordinator::is_valid(std::uint32_t worker, const std::vector<WorldRecord>& records) const {
    return std::all_of(records.begin(), records.end(), [&](const WorldRecord& r) {
        const auto body = static_cast<std::uint32_t>(r.body);
        return owns(worker, body) && is_valid(body, r.state.q.size()) && r.sleep_group >= -1 &&
               r.sleep_group <= r.body;
    });
}

bool Coordinator::is_valid(const std::vector<Mishap>& mishaps) const {
    return std::all_of(mishaps.begin(), mishaps.end(), [this](const Mishap& m) {
        return m.number < (m.kind == Mishap::Kind::broken ? scene_.world.constraints.size() : bodies_.size());
    });
}

// Whether a worker may make this offer now. Its bodies may have changed owners since it wrote the offer.
bool Coordinator::may_offer(std::uint32_t worker, const Offer& offer) const {
    const auto& before = senders_.at(worker).offer;
    const bool is_answered = !before || !is_member(before->first);
    return is_answered && !offer.bodies.empty() && std::ranges::all_of(offer.bodies, [&](std::uint32_t body) {
               return owns(worker, body) && (!offer.gathers || bodies_[body].asked_to == offer.to);
           });
}

bool Coordinator::owns_constraint(std::uint32_t worker, int constraint) const {
    if (constraint < 0 || constraint >= static_cast<int>(scene_.world.constraints.size())) return false;
    const PointConstraint& c = scene_.world.constraints[static_cast<std::size_t>(constraint)];
    const int first = view_.clock().moves(c.body_a) || c.body_b < 0 ? c.body_a : c.body_b;
    return owns(worker, static_cast<std::uint32_t>(first));
}

void Coordinator::publish(Body& body, const WorldRecord& record, std::uint64_t step) {
    if (step < body.step) return;
    body.record = record;
    body.step = step;
}

void Coordinator::handle_update(const MessageHeader& header, std::span<const std::uint8_t> bytes,
                                const UpdateMessage& message) {
    const bool own = std::all_of(message.bodies.begin(), message.bodies.end(), [&](const Update& u) {
        return owns(header.worker, u.body) && is_valid(u.body, u.state.q.size()) &&
               (!u.held || is_valid(u.body, u.impulse.modal.size()));
    });
    const bool constraints = std::ranges::all_of(
        message.broken, [&](std::uint32_t c) { return owns_constraint(header.worker, static_cast<int>(c)); });
    if (!own || !constraints || !is_valid(message.report.mishaps) ||
        header.step <= senders_[header.worker].step)
        return expel(header.worker, "found states that are not its to publish");
    for (const std::uint32_t c : message.broken) view_.break_constraint(static_cast<int>(c));
    for (const Update& update : message.bodies) {
        Body& body = bodies_[update.body];
        if (header.step < body.step) continue;
        assign(body.record, update);
        body.step = header.step;
    }
    // Of the last step the view shows the corrected states, which come later.
    const bool last = header.step == settings_.steps;
    if (!last) extend_sleep(header);
    report(header, message.report, message.bodies.size(), bytes.size());
    if (!last) view_.add(header.step, message.bodies);
}

// Exact states of the last step, with all corrections.
void Coordinator::handle_last(const MessageHeader& header, std::span<const std::uint8_t> bytes,
                              const StateMessage& message) {
    Sender& sender = senders_[header.worker];
    if (header.step != settings_.steps || header.step != sender.step ||
        !is_valid(header.worker, message.bodies) || !is_valid(message.report.mishaps))
        return expel(header.worker, "found states that are not its to publish");
    sender.settled = true;
    for (const WorldRecord& record : message.bodies)
        publish(bodies_[static_cast<std::size_t>(record.body)], record, header.step);
    report(header, message.report, message.bodies.size(), bytes.size());
    view_.add(header.step, message.bodies, true);
}

// The state of a sleeping body is published once and holds until the body wakes. Bodies are left out that the
// sender did not know to be its own when it wrote the message.
void Coordinator::extend_sleep(const MessageHeader& header) {
    std::vector<WorldRecord> asleep;
    for (int i = 0; i < static_cast<int>(bodies_.size()); ++i) {
        Body& body = bodies_[static_cast<std::size_t>(i)];
        if (body.owner != header.worker || body.epoch > header.epoch || body.step >= header.step) continue;
        if (!body.record.asleep || !view_.clock().moves_at(i, header.step)) continue;
        body.step = header.step;
        asleep.push_back(body.record);
    }
    view_.add(header.step, asleep);
}

void Coordinator::handle_handover(const MessageHeader& header, Handover&& message) {
    if (!is_valid(header.worker, message.bodies))
        return refuse(header.worker, "found bodies that are not its to hand over");
    std::vector<int> bodies;
    for (const WorldRecord& record : message.bodies) bodies.push_back(record.body);
    std::sort(bodies.begin(), bodies.end());
    if (std::adjacent_find(bodies.begin(), bodies.end()) != bodies.end())
        return refuse(header.worker, "found a body twice");
    view_.add(header.step, message.bodies);
    for (const WorldRecord& record : message.bodies)
        publish(bodies_[static_cast<std::size_t>(record.body)], record, header.step);
    const bool traded = is_member(message.to) && message.to != header.worker;
    if (traded) {
        if (!leaving_.contains(header.worker)) ++result_.trades;
        result_.migrations += bodies.size();
        awaited_.erase({message.to, header.worker});
        register_owner(bodies, message.to, header.worker, true);
    } else if (message.to == kApplication && members_.size() > 1) {
        // The worker leaves and must not get them back.
        const std::vector<std::uint32_t> all = members_;
        std::erase(members_, header.worker);
        distribute(bodies, header.worker);
        members_ = all;
    } else {
        register_owner(bodies, header.worker, header.worker);
    }
    advance();
}

void Coordinator::report(const MessageHeader& header, const StepReport& report, std::size_t records,
                         std::size_t bytes) {
    Sender& sender = senders_[header.worker];
    sender.step = std::max(sender.step, header.step);
    WorkerStep step;
    step.worker = static_cast<int>(header.worker);
    step.step = header.step;
    step.seconds = report.seconds, step.smoothed_s = report.smoothed_s, step.waited_s = report.waited_s;
    step.processor_s = report.processor_s;
    step.bodies = static_cast<int>(report.own);
    step.lead = static_cast<int>(report.lead), step.ghost_age = static_cast<int>(report.ghost_age);
    step.bytes = std::exchange(sender.bytes, 0);
    step.cross_contacts = static_cast<int>(report.cross_contacts);
    result_.cpu_s += report.processor_s;
    result_.cross_contacts += report.cross_contacts;
    result_.bytes_states += bytes;
    result_.records += records;
    result_.largest_lead = std::max(result_.largest_lead, step.lead);
    result_.largest_ghost_age = std::max(result_.largest_ghost_age, step.ghost_age);
    outside_[header.worker] = report.outside_impulse;
    for (const Mishap& m : report.mishaps) {
        const int number = static_cast<int>(m.number);
        if (m.kind == Mishap::Kind::quarantined)
            quarantined_.try_emplace(number, QuarantinedBody{number, m.step, m.what});
        else
            (m.kind == Mishap::Kind::limited ? limited_ : broken_).try_emplace(number, m.step);
    }
    observer_->worked(step);
}

}  // namespace sim
