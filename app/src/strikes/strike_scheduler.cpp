#include "strikes/strike_scheduler.h"

#include <audio/performance.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace app {
namespace {

constexpr std::size_t kRememberedCancellations = 8;

void copy_contact(Strike& strike, const sim::Contact& contact) {
    strike.contact_s = contact.t_s;
    strike.zone = contact.zone;
    strike.speed_mps = contact.speed_mps;
    strike.point_world = contact.point_world;
    strike.normal_world = contact.normal_world;
    strike.point_body = contact.point_body;
    strike.impulse_body = contact.impulse_body;
}

}  // namespace

StrikeScheduler::StrikeScheduler(const StrikeRules& rules, std::size_t sticks, std::size_t instruments)
    : rules_(rules),
      instruments_(instruments),
      approaches_(sticks * instruments),
      samples_since_start_(sticks, 0) {}

StrikeScheduler::Approach& StrikeScheduler::approach(std::uint32_t stick, std::uint32_t instrument) {
    return approaches_[stick * instruments_ + instrument];
}

void StrikeScheduler::disarm(Approach& a) {
    a.armed = false;
    a.entered_s.reset();
    a.lowest_measured = a.lowest_filtered = std::numeric_limits<double>::infinity();
}

void StrikeScheduler::place_onset(Strike& strike, double s) const {
    // Rounded up, so that the onset never lies nearer to the sample than it may.
    const double earliest = std::max(strike.contact_s, earliest_onset(s));
    strike.onset_sample = static_cast<std::int64_t>(std::ceil((earliest - rules_.t0_s) * audio::kSampleRate));
    strike.onset_s = rules_.t0_s + static_cast<double>(strike.onset_sample) / audio::kSampleRate;
}

bool StrikeScheduler::is_committed(const Strike& strike, double s) const {
    return strike.onset_s < s + rules_.commit_lead_s;
}

void StrikeScheduler::release(std::uint64_t id) {
    Strike& released = strike(id);
    released.outcome = Outcome::released;
    released.decided_at_s = released.onset_s - rules_.release_margin_s;
    released_.push_back(id);
}

void StrikeScheduler::advance_to(double s, double fixed_s) {
    fixed_s_ = fixed_s;
    const double until = std::max(s + rules_.release_margin_s, fixed_s);
    for (Approach& a : approaches_) {
        const auto fixed = [&](std::uint64_t id) { return strike(id).onset_s < until; };
        bool any = false;
        for (const std::uint64_t id : a.pending)
            if (fixed(id)) release(id), any = true;
        if (!any) continue;
        std::erase_if(a.pending, fixed);
        disarm(a);
    }
}

void StrikeScheduler::finish() {
    for (Approach& a : approaches_) {
        for (const std::uint64_t id : a.pending) release(id);
        a.pending.clear();
    }
}

void StrikeScheduler::restart(std::uint32_t stick) {
    samples_since_start_[stick] = 0;
}

void StrikeScheduler::update_arming(Approach& a, double s, double measured, double filtered,
                                    bool first) const {
    if (first) {
        disarm(a);
        a.armed = measured > 0 && filtered > 0;
    } else if (!a.armed) {
        a.lowest_measured = std::min(a.lowest_measured, measured);
        a.lowest_filtered = std::min(a.lowest_filtered, filtered);
        const double d = rules_.rearm_m;
        a.armed = measured >= d && measured >= a.lowest_measured + d && filtered >= d &&
                  filtered >= a.lowest_filtered + d;
    }
    if (a.armed && !a.entered_s && measured <= 0) {
        // Straight between the samples.
        const double fall = a.last_clearance - measured;
        a.entered_s =
            fall > 0 && a.last_clearance > 0 ? a.last_s + (s - a.last_s) * a.last_clearance / fall : s;
    }
    a.last_clearance = measured;
    a.last_s = s;
}

std::vector<StrikeScheduler::Candidate> StrikeScheduler::candidates(
    const Approach& a, double s, std::span<const sim::Contact> contacts) const {
    std::vector<Candidate> result;
    for (std::size_t i = 0; i < contacts.size(); ++i) {
        const sim::Contact& contact = contacts[i];
        if (i == 0 && !a.armed) continue;  // still the stroke that was released
        // A path that goes right through a thin body and turns back into it from behind is no second stroke.
        if (i > 0 && contact.normal_world.dot(contacts[0].normal_world) <= 0) continue;
        if (contact.zone < 0 || contact.speed_mps < rules_.minimum_speed_mps) continue;
        const double onset = std::max(contact.t_s, earliest_onset(s));
        const double happened = i == 0 && a.entered_s ? std::min(*a.entered_s, contact.t_s) : contact.t_s;
        result.push_back({&contact, happened, onset - happened > rules_.late_s});
    }
    return result;
}

void StrikeScheduler::update(Strike& moved, double s, const sim::Contact& contact) {
    if (is_committed(moved, s)) return;
    const std::int64_t onset = moved.onset_sample;
    const double speed = moved.speed_mps;
    const std::int32_t zone = moved.zone;
    copy_contact(moved, contact);
    moved.model = model_;
    place_onset(moved, s);
    if (onset == moved.onset_sample && speed == moved.speed_mps && zone == moved.zone) return;
    ++moved.moves;
    changes_.push_back({moved.id, true});
}

void StrikeScheduler::create(Approach& a, double s, std::uint32_t stick, const sim::Contact& contact) {
    Strike fresh;
    fresh.stick = stick;
    fresh.instrument = contact.body;
    copy_contact(fresh, contact);
    fresh.model = model_;
    place_onset(fresh, s);
    fresh.scheduled_at_s = s;
    const auto again = std::find_if(a.cancelled.rbegin(), a.cancelled.rend(), [&](std::uint64_t id) {
        return std::abs(strike(id).onset_s - contact.t_s) <= rules_.revive_s;
    });
    if (again != a.cancelled.rend()) {
        const Strike old = strike(*again);
        // A time that stood when it was cancelled stands again, as long as it can be met.
        if (is_committed(old, s) && old.onset_s >= s + rules_.release_margin_s) {
            fresh.contact_s = old.contact_s;
            fresh.onset_sample = old.onset_sample;
            fresh.onset_s = old.onset_s;
        }
        a.cancelled.erase(std::next(again).base());
        fresh.id = old.id;
        fresh.scheduled_at_s = old.scheduled_at_s;
        fresh.moves = old.moves + 1;
        strike(fresh.id) = fresh;
    } else {
        fresh.id = strikes_.size() + 1;
        strikes_.push_back(fresh);
    }
    a.pending.push_back(fresh.id);
    changes_.push_back({fresh.id, true});
}

void StrikeScheduler::cancel(Approach& a, double s, std::uint64_t id) {
    strike(id).outcome = Outcome::cancelled;
    strike(id).decided_at_s = s;
    changes_.push_back({id, false});
    a.cancelled.push_back(id);
    if (a.cancelled.size() > kRememberedCancellations) a.cancelled.erase(a.cancelled.begin());
}

void StrikeScheduler::keep_or_cancel(Approach& a, double s, std::uint64_t id, bool may_keep) {
    if (a.entered_s && may_keep) {
        // The measured tip has met the surface: the stroke came, whatever the path now says. It sounds as
        // soon as it may.
        Strike& kept = strike(id);
        if (is_committed(kept, s)) {
            // Its time cannot be mended: a note far from its stroke is not played.
            if (rules_.cancelling && kept.onset_s - *a.entered_s > rules_.late_s) cancel(a, s, id);
            return;
        }
        const std::int64_t onset = kept.onset_sample;
        kept.contact_s = std::min(kept.contact_s, *a.entered_s);
        place_onset(kept, s);
        if (kept.onset_sample < onset) {
            ++kept.moves;
            changes_.push_back({id, true});
        } else {
            kept.onset_sample = onset;
            kept.onset_s = rules_.t0_s + static_cast<double>(onset) / audio::kSampleRate;
        }
    } else if (rules_.cancelling || strike(id).onset_s >= s + rules_.sent_lead_s) {
        cancel(a, s, id);
    }
}

bool StrikeScheduler::may_be(const Strike& strike, const Candidate& candidate, double s) const {
    if (!is_committed(strike, s)) return !candidate.late;
    return candidate.happens_s - strike.onset_s <= rules_.late_s;
}

void StrikeScheduler::follow(Approach& a, double s, std::uint32_t stick,
                             std::span<const sim::Contact> contacts, bool settled) {
    std::vector<Candidate> found;
    if (settled) found = candidates(a, s, contacts);
    std::vector<std::uint64_t> waiting = a.pending;
    // Nearest pairs first: the lists hold one or two entries.
    while (!found.empty() && !waiting.empty()) {
        std::size_t best_p = 0, best_c = 0;
        double best = std::numeric_limits<double>::infinity();
        for (std::size_t p = 0; p < waiting.size(); ++p)
            for (std::size_t c = 0; c < found.size(); ++c) {
                if (!may_be(strike(waiting[p]), found[c], s)) continue;
                const double apart = std::abs(strike(waiting[p]).contact_s - found[c].contact->t_s);
                if (apart < best) best = apart, best_p = p, best_c = c;
            }
        if (!std::isfinite(best)) break;
        update(strike(waiting[best_p]), s, *found[best_c].contact);
        waiting.erase(waiting.begin() + static_cast<std::ptrdiff_t>(best_p));
        found.erase(found.begin() + static_cast<std::ptrdiff_t>(best_c));
    }
    // One stroke has come when the tip is in: the earliest note is its own, unless the path has confirmed
    // another.
    bool may_keep = waiting.size() == a.pending.size();
    std::ranges::sort(waiting, {}, [this](std::uint64_t id) { return strike(id).contact_s; });
    for (const std::uint64_t id : waiting) keep_or_cancel(a, s, id, std::exchange(may_keep, false));
    std::erase_if(a.pending, [&](std::uint64_t id) { return strike(id).outcome == Outcome::cancelled; });
    for (const Candidate& candidate : found)
        if (!candidate.late) create(a, s, stick, *candidate.contact);
}

void StrikeScheduler::sample(std::uint32_t stick, double s, std::span<const sim::Contact> contacts,
                             std::span<const double> measured_clearance,
                             std::span<const double> filtered_clearance, std::size_t model) {
    model_ = static_cast<std::uint32_t>(model);
    const int number = samples_since_start_[stick]++;
    std::vector<sim::Contact> own;
    for (std::uint32_t instrument = 0; instrument < instruments_; ++instrument) {
        Approach& a = approach(stick, instrument);
        update_arming(a, s, measured_clearance[instrument], filtered_clearance[instrument], number == 0);
        own.clear();
        for (const sim::Contact& contact : contacts)
            if (contact.body == instrument) own.push_back(contact);
        follow(a, s, stick, own, number >= rules_.settling_samples);
        // A stroke that was not found in time is missed; the stick lies in the head until it rises again.
        if (a.entered_s && a.pending.empty() && s + rules_.commit_lead_s - *a.entered_s > rules_.late_s)
            disarm(a);
    }
}

std::vector<NoteChange> StrikeScheduler::take_changes() {
    return std::exchange(changes_, {});
}

std::vector<std::uint64_t> StrikeScheduler::take_released() {
    return std::exchange(released_, {});
}

}  // namespace app
