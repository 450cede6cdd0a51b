#include "struck/stepped_body.h"

#include <algorithm>

#include "struck/tip_sweep.h"

namespace sim {

SteppedBody::SteppedBody(std::uint32_t index, const BodyDefinition& definition, const BodyRecord& record)
    : index_(index),
      model_(std::make_unique<const BodyModel>(definition)),
      motion_(*model_),
      record_(record) {
    confirmed_.reserve(32);
    found_.reserve(32);
}

OscillatorState SteppedBody::folded(const StepRequest& request) const {
    OscillatorState now = model_->to_oscillators(record_.state);
    if (record_.stepped) now = model_->after(now, request.t_s - record_.t_s);
    for (const Impulse& impulse : request.folded) {
        if (impulse.body == index_)
            now.add(model_->after(model_->kick(impulse), request.t_s - impulse.t_s), 1);
    }
    return now;
}

ModalState SteppedBody::picture(const PictureRequest& request, const OscillatorState& now) const {
    OscillatorState shown = model_->after(now, request.t_s - record_.t_s);
    for (const WeightedImpulse& w : request.provisional) {
        if (w.impulse.body != index_ || w.impulse.t_s > request.t_s) continue;
        shown.add(model_->after(model_->kick(w.impulse), request.t_s - w.impulse.t_s), w.weight);
    }
    return model_->to_modal(shown);
}

void SteppedBody::set_motion(const StepRequest& request, const OscillatorState& now) {
    confirmed_.clear();
    for (const Impulse& impulse : request.confirmed) {
        if (impulse.body != index_) continue;
        confirmed_.push_back(&impulse);
        for (std::size_t i = confirmed_.size() - 1; i > 0 && confirmed_[i]->t_s < confirmed_[i - 1]->t_s;
             --i) {
            std::swap(confirmed_[i], confirmed_[i - 1]);
        }
    }
    motion_.start(request.t_s, now);
    for (const Impulse* impulse : confirmed_) motion_.add(*impulse);
}

void SteppedBody::sweep(const StepRequest& request, BodyOutcome& outcome) {
    const TipSweep sweep(*model_, motion_);
    outcome.clearance_m.clear();
    outcome.contacts.clear();
    for (std::uint32_t p = 0; p < request.paths.size(); ++p) {
        found_.clear();
        outcome.clearance_m.push_back(sweep.sweep(request.paths[p], index_, found_));
        for (const Contact& contact : found_) outcome.contacts.push_back({p, contact});
    }
}

void SteppedBody::step(const StepRequest& request, BodyOutcome& outcome) {
    if (request.anew) record_ = {};
    const auto mine = [this](const Impulse& impulse) { return impulse.body == index_; };
    const bool changes =
        !record_.stepped || request.t_s != record_.t_s || std::ranges::any_of(request.folded, mine);
    const OscillatorState now = folded(request);
    // A step that changes nothing leaves the state as it is to the last bit, so that asking twice is asking
    // once.
    if (changes) record_ = {model_->to_modal(now), true, request.t_s};
    outcome.body = index_;
    outcome.state = record_.state;
    outcome.pictures.clear();
    for (const PictureRequest& wanted : request.pictures) outcome.pictures.push_back(picture(wanted, now));
    set_motion(request, now);
    sweep(request, outcome);
}

StepReply merge(const std::vector<BodyOutcome>& outcomes, const StepRequest& request) {
    const std::size_t bodies = outcomes.size();
    StepReply reply;
    reply.states.reserve(bodies);
    reply.pictures.resize(request.pictures.size());
    reply.clearance_m.resize(request.paths.size() * bodies);
    std::vector<const BodyOutcome::PathContact*> contacts;
    for (std::size_t b = 0; b < bodies; ++b) {
        const BodyOutcome& outcome = outcomes[b];
        reply.states.push_back(outcome.state);
        for (std::size_t k = 0; k < request.pictures.size(); ++k)
            reply.pictures[k].push_back(outcome.pictures[k]);
        for (std::size_t p = 0; p < request.paths.size(); ++p)
            reply.clearance_m[p * bodies + b] = outcome.clearance_m[p];
        for (const BodyOutcome::PathContact& contact : outcome.contacts) contacts.push_back(&contact);
    }
    std::stable_sort(contacts.begin(), contacts.end(), [](const auto* a, const auto* b) {
        if (a->path != b->path) return a->path < b->path;
        return a->contact.t_s != b->contact.t_s ? a->contact.t_s < b->contact.t_s
                                                : a->contact.body < b->contact.body;
    });
    reply.contacts.reserve(contacts.size());
    for (const BodyOutcome::PathContact* contact : contacts) reply.contacts.push_back(contact->contact);
    return reply;
}

}  // namespace sim
