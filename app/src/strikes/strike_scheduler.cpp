#include "strikes/strike_scheduler.h"

#include <audio/performance.h>

#include <cmath>
#include <iterator>
#include <numeric>
#include <utility>

namespace app {
namespace {

constexpr std::size_t kRememberedCancellations = 8;
constexpr double kSameSide = 0.5;  // cosine of the angle between normals

void copy_contact(Strike& strike, const sim::Contact& contact) {
    strike.contact_s = contact.t_s;
    strike.zone = contact.zone;
    strike.speed_mps = contact.speed_mps;
    strike.point_world = contact.point_world;
    strike.normal_world = contact.normal_world;
    strike.point_body = contact.point_body;
    strike.impulse_body = contact.impulse_body;
}

bool sounds_the_same(const Strike& a, const Strike& b) {
    return a.onset_sample == b.onset_sample && a.speed_mps == b.speed_mps && a.zone == b.zone;
}

bool contains(std::span<const std::uint64_t> ids, std::uint64_t id) {
    return std::ranges::find(ids, id) != ids.end();
}

}  // namespace

StrikeScheduler::StrikeScheduler(const StrikeRules& rules, std::size_t sticks, std::size_t instruments)
    : rules_(rules),
      instruments_(instruments),
      pairs_(sticks * instruments),
      samples_since_start_(sticks, 0) {}

void StrikeScheduler::advance_to(double s, double fixed_s) {
    fixed_s_ = fixed_s;
    release_before(std::max(s + rules_.release_margin_s, fixed_s));
}

void StrikeScheduler::finish() {
    release_before(std::numeric_limits<double>::infinity());
}

void StrikeScheduler::restart(std::uint32_t stick) {
    samples_since_start_[stick] = 0;
}

void StrikeScheduler::sample(std::uint32_t stick, double s, std::span<const ModelContacts> expected,
                             std::size_t selected, const MeasuredTip& tip) {
    const int number = samples_since_start_[stick]++;
    std::vector<sim::Contact> own;
    for (std::uint32_t instrument = 0; instrument < instruments_; ++instrument) {
        Pair& pair = pairs_[stick * instruments_ + instrument];
        const double measured = tip.clearance_m[instrument];
        const auto with_it = [&](const sim::Contact& contact) { return contact.body == instrument; };
        pair.approaches.resize(expected.size());
        for (std::uint32_t model = 0; model < expected.size(); ++model) {
            Approach& a = pair.approaches[model];
            a.stick = stick;
            a.model = model;
            own.clear();
            // Only a tip that was armed when it passed through: else it was the stroke that was released.
            if (a.armed) std::ranges::copy_if(tip.passed, std::back_inserter(own), with_it);
            update_arming(a, s, measured, expected[model].clearance_m[instrument], number == 0);
            if (!own.empty() && !a.entered_s) a.entered_s = own.front().t_s;
            if (number >= rules_.settling_samples)
                std::ranges::copy_if(expected[model].contacts, std::back_inserter(own), with_it);
            else
                own.clear();
            follow_path(a, s, own);
            if (!expected[model].silent_until_s.empty())
                silence(a, s, expected[model].silent_until_s[instrument]);
            // A stroke that was not found in time is missed; the stick lies in the head until it rises again.
            if (a.entered_s && a.pending.empty() && s + rules_.commit_lead_s - *a.entered_s > rules_.late_s)
                disarm(a);
        }
        pair.selected = selected;
        open_again(pair, s, measured);
        play_selected(pair, s);
    }
}

void StrikeScheduler::disarm(Approach& a) {
    a.armed = false;
    a.entered_s.reset();
    a.lowest_measured = a.lowest_filtered = std::numeric_limits<double>::infinity();
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
    a.interval_s = first ? 0 : s - a.last_s;
    a.last_s = s;
}

std::vector<StrikeScheduler::Candidate> StrikeScheduler::candidates(
    const Approach& a, double s, std::span<const sim::Contact> contacts) const {
    std::vector<Candidate> result;
    for (std::size_t i = 0; i < contacts.size(); ++i) {
        const sim::Contact& contact = contacts[i];
        if (i == 0 && !a.armed) continue;  // still the stroke that was released
        // A path that goes right through a thin body and turns back into it from behind or from the side is no second
        // stroke.
        if (i > 0 && contact.normal_world.dot(contacts[0].normal_world) < kSameSide) continue;
        if (contact.zone < 0 || contact.speed_mps < rules_.minimum_speed_mps) continue;
        const double onset = std::max(contact.t_s, earliest_onset(s));
        const double happened = i == 0 && a.entered_s ? std::min(*a.entered_s, contact.t_s) : contact.t_s;
        result.push_back({&contact, happened, onset - happened > rules_.late_s});
    }
    return result;
}

void StrikeScheduler::follow_path(Approach& a, double s, std::span<const sim::Contact> contacts) {
    std::vector<Candidate> found = candidates(a, s, contacts);
    std::vector<std::size_t> waiting(a.pending.size());
    std::iota(waiting.begin(), waiting.end(), std::size_t{0});
    // Nearest pairs first: the lists hold one or two entries.
    while (!found.empty() && !waiting.empty()) {
        std::size_t best_p = 0, best_c = 0;
        double best = std::numeric_limits<double>::infinity();
        for (std::size_t p = 0; p < waiting.size(); ++p)
            for (std::size_t c = 0; c < found.size(); ++c) {
                const Strike& pending = a.pending[waiting[p]];
                if (!may_be(pending, found[c], s)) continue;
                const double apart = std::abs(pending.contact_s - found[c].contact->t_s);
                if (apart < best) best = apart, best_p = p, best_c = c;
            }
        if (!std::isfinite(best)) break;
        if (Strike& pending = a.pending[waiting[best_p]]; !is_committed(pending, s)) {
            copy_contact(pending, *found[best_c].contact);
            place_onset(pending, s);
        }
        waiting.erase(waiting.begin() + static_cast<std::ptrdiff_t>(best_p));
        found.erase(found.begin() + static_cast<std::ptrdiff_t>(best_c));
    }
    // One stroke has come when the tip is in: the earliest note is its own, unless the path has confirmed
    // another.
    bool may_keep = waiting.size() == a.pending.size();
    std::ranges::sort(waiting, {}, [&](std::size_t p) { return a.pending[p].contact_s; });
    for (const std::size_t p : waiting) keep_or_cancel(a, s, a.pending[p], std::exchange(may_keep, false));
    std::erase_if(a.pending, [](const Strike& pending) { return pending.outcome == Outcome::cancelled; });
    for (const Candidate& candidate : found)
        if (const auto fresh = new_contact(a, s, candidate)) a.pending.push_back(*fresh);
}

void StrikeScheduler::place_onset(Strike& pending, double s) const {
    // Rounded up, so that the onset never lies nearer to the sample than it may.
    const double earliest = std::max(pending.contact_s, earliest_onset(s));
    pending.onset_sample =
        static_cast<std::int64_t>(std::ceil((earliest - rules_.t0_s) * audio::kSampleRate));
    pending.onset_s = rules_.t0_s + static_cast<double>(pending.onset_sample) / audio::kSampleRate;
}

bool StrikeScheduler::is_committed(const Strike& pending, double s) const {
    return pending.onset_s < s + rules_.commit_lead_s;
}

bool StrikeScheduler::may_be(const Strike& pending, const Candidate& candidate, double s) const {
    if (!is_committed(pending, s)) return !candidate.late;
    return candidate.happens_s - pending.onset_s <= rules_.late_s;
}

std::optional<Strike> StrikeScheduler::new_contact(Approach& a, double s, const Candidate& candidate) const {
    const sim::Contact& contact = *candidate.contact;
    Strike fresh;
    fresh.stick = a.stick;
    fresh.instrument = contact.body;
    fresh.model = a.model;
    copy_contact(fresh, contact);
    place_onset(fresh, s);
    const auto again = std::find_if(a.cancelled.rbegin(), a.cancelled.rend(), [&](const Strike& old) {
        return std::abs(old.onset_s - contact.t_s) <= rules_.revive_s;
    });
    const bool is_back = again != a.cancelled.rend();
    // A time that stood when it was cancelled stands again, as long as it can be met: it is not too late for that.
    const bool stands = is_back && is_committed(*again, s) && again->onset_s >= s + rules_.release_margin_s;
    if (candidate.late && !stands) return std::nullopt;
    if (!is_back) return fresh;
    if (stands) {
        fresh.contact_s = again->contact_s;
        fresh.onset_sample = again->onset_sample;
        fresh.onset_s = again->onset_s;
    }
    fresh.id = again->id;
    a.cancelled.erase(std::next(again).base());
    return fresh;
}

void StrikeScheduler::keep_or_cancel(Approach& a, double s, Strike& pending, bool may_keep) const {
    if (a.entered_s && may_keep) {
        // The measured tip has met the surface: the stroke came, whatever the path now says. It sounds as
        // soon as it may.
        if (is_committed(pending, s)) {
            // Its time cannot be mended: a note far from its stroke is not played.
            if (rules_.cancelling && pending.onset_s - *a.entered_s > rules_.late_s) cancel(a, pending);
            return;
        }
        const Strike before = pending;
        pending.contact_s = std::min(pending.contact_s, *a.entered_s);
        place_onset(pending, s);
        if (pending.onset_sample < before.onset_sample) return;
        pending.onset_sample = before.onset_sample;
        pending.onset_s = before.onset_s;
    } else if (rules_.cancelling || pending.onset_s >= s + rules_.sent_lead_s) {
        cancel(a, pending);
    }
}

void StrikeScheduler::silence(Approach& a, double s, double until_s) const {
    if (!rules_.cancelling) return;
    const auto is_silent = [&](const Strike& pending) {
        return pending.onset_s < until_s && pending.onset_s <= s + a.interval_s + rules_.release_margin_s;
    };
    for (Strike& pending : a.pending)
        if (is_silent(pending)) cancel(a, pending);
    std::erase_if(a.pending, [](const Strike& pending) { return pending.outcome == Outcome::cancelled; });
}

void StrikeScheduler::cancel(Approach& a, Strike& pending) {
    a.cancelled.push_back(pending);
    pending.outcome = Outcome::cancelled;
    if (a.cancelled.size() > kRememberedCancellations) a.cancelled.erase(a.cancelled.begin());
}

bool StrikeScheduler::is_selected(const Pair& pair, const Strike& pending) const {
    const double passed_by_s = pair.approaches[pair.selected].passed_by_s;
    return pending.model == pair.selected || std::abs(pending.onset_s - passed_by_s) <= rules_.late_s;
}

void StrikeScheduler::open_again(Pair& pair, double s, double measured) const {
    if (!pair.struck || s < pair.struck->onset_s) return;
    double& lowest = pair.struck->lowest_m;
    lowest = std::min(lowest, measured);
    if (measured >= rules_.rearm_m && measured >= lowest + rules_.rearm_m) pair.struck.reset();
}

void StrikeScheduler::play_selected(Pair& pair, double s) {
    std::vector<std::uint64_t> played;
    for (Approach& a : pair.approaches)
        for (Strike& pending : a.pending) {
            const bool same_stroke =
                pair.is_closed() && pending.onset_s <= pair.struck->onset_s + rules_.late_s;
            if (!is_selected(pair, pending) || same_stroke) continue;
            play(pair, pending, s, played);
            played.push_back(pending.id);
        }
    for (const std::uint64_t id : pair.strikes)
        if (!contains(played, id)) withdraw(id, s);
    while (pair.strikes.size() > kRememberedCancellations &&
           strike(pair.strikes.front()).outcome == Outcome::cancelled)
        pair.strikes.erase(pair.strikes.begin());
}

void StrikeScheduler::play(Pair& pair, Strike& pending, double s, std::span<const std::uint64_t> played) {
    const bool has_strike = pending.id != 0 && strike(pending.id).outcome != Outcome::released;
    if (!has_strike || contains(played, pending.id)) pending.id = taken_over(pair, pending, played);
    if (pending.id == 0) {
        pending.id = strikes_.size() + 1;
        pending.scheduled_at_s = s;
        pending.moves = 0;
        strikes_.push_back(pending);
        pair.strikes.push_back(pending.id);
        changes_.push_back(pending.id);
        return;
    }
    Strike& known = strike(pending.id);
    const bool moves = known.outcome == Outcome::cancelled || !sounds_the_same(known, pending);
    if (moves) changes_.push_back(pending.id);
    pending.scheduled_at_s = known.scheduled_at_s;
    pending.moves = known.moves + (moves ? 1 : 0);
    known = pending;
}

std::uint64_t StrikeScheduler::taken_over(const Pair& pair, const Strike& pending,
                                          std::span<const std::uint64_t> played) const {
    const auto goes_on = [&](std::uint64_t id) {
        const Strike& other = strike(id);
        return other.model != pending.model && !contains(played, id) &&
               std::abs(other.onset_s - pending.contact_s) <= rules_.revive_s;
    };
    const auto newest = std::find_if(pair.strikes.rbegin(), pair.strikes.rend(), goes_on);
    return newest == pair.strikes.rend() ? 0 : *newest;
}

void StrikeScheduler::withdraw(std::uint64_t id, double s) {
    if (strike(id).outcome != Outcome::pending) return;
    strike(id).outcome = Outcome::cancelled;
    strike(id).decided_at_s = s;
    changes_.push_back(id);
}

void StrikeScheduler::release_before(double until) {
    const auto due = [&](const Strike& pending) { return pending.onset_s < until; };
    for (Pair& pair : pairs_)
        for (Approach& a : pair.approaches) {
            if (std::ranges::none_of(a.pending, due)) continue;
            for (const Strike& pending : a.pending)
                if (due(pending)) release(pair, a, pending);
            std::erase_if(a.pending, due);
            disarm(a);
        }
}

void StrikeScheduler::release(Pair& pair, Approach& a, const Strike& pending) {
    if (!is_selected(pair, pending)) {
        a.passed_by_s = pending.onset_s;
        return;
    }
    if (pending.id == 0 || strike(pending.id).outcome != Outcome::pending) return;
    const double release_s = pending.onset_s - rules_.release_margin_s;
    if (pair.is_closed()) return withdraw(pending.id, release_s);
    Strike& released = strike(pending.id);
    released.outcome = Outcome::released;
    released.decided_at_s = release_s;
    released_.push_back(released.id);
    std::erase(pair.strikes, released.id);
    pair.struck = {released.onset_s};
}

std::vector<std::uint64_t> StrikeScheduler::take_changes() {
    return std::exchange(changes_, {});
}

std::vector<std::uint64_t> StrikeScheduler::take_released() {
    return std::exchange(released_, {});
}

}  // namespace app
