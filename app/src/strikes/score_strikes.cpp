#include "strikes/score_strikes.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <compare>

namespace app {
namespace {

/// Times are sums of doubles: a pair of exactly 30 ms counts as within.
constexpr double kTimeSlack_s = 1e-9;

struct Pair {
    double distance_s, contact_s;
    std::uint64_t id;
    std::size_t contact, strike;
    auto operator<=>(const Pair&) const = default;
};

std::vector<Pair> candidate_pairs(const std::vector<Strike>& strikes,
                                  const std::vector<TrueContact>& contacts) {
    const double window_s = kMatchWindow_s + kTimeSlack_s;
    std::vector<Pair> pairs;
    for (std::size_t i = 0; i < strikes.size(); ++i) {
        const Strike& strike = strikes[i];
        if (strike.outcome != Outcome::released) continue;
        auto contact = std::ranges::lower_bound(contacts, strike.onset_s - window_s, {}, &TrueContact::t_s);
        for (; contact != contacts.end() && contact->t_s <= strike.onset_s + window_s; ++contact) {
            if (contact->stick != strike.stick || contact->instrument != strike.instrument) continue;
            const auto index = static_cast<std::size_t>(contact - contacts.begin());
            pairs.push_back({std::abs(strike.onset_s - contact->t_s), contact->t_s, strike.id, index, i});
        }
    }
    std::ranges::sort(pairs);
    return pairs;
}

/// Takes the pairs in order, each strike and contact once; returns |onset - contact| of those taken [ms].
std::vector<double> match(const std::vector<Strike>& strikes, std::vector<TrueContact>& contacts) {
    std::vector<double> errors_ms;
    std::vector<bool> strike_taken(strikes.size()), contact_taken(contacts.size());
    for (TrueContact& contact : contacts) contact.matched_id = 0;
    for (const Pair& pair : candidate_pairs(strikes, contacts)) {
        if (strike_taken[pair.strike] || contact_taken[pair.contact]) continue;
        strike_taken[pair.strike] = contact_taken[pair.contact] = true;
        contacts[pair.contact].matched_id = pair.id;
        errors_ms.push_back(pair.distance_s * 1e3);
    }
    return errors_ms;
}

}  // namespace

StrikeScore score_strikes(const std::vector<Strike>& strikes, std::vector<TrueContact>& contacts) {
    assert(std::ranges::is_sorted(contacts, {}, &TrueContact::t_s) && "the true contacts are sorted by time");
    const std::vector<double> errors_ms = match(strikes, contacts);
    const int matched = static_cast<int>(errors_ms.size());
    StrikeScore score;
    score.true_contacts = static_cast<int>(contacts.size());
    for (const Strike& strike : strikes) {
        score.released += strike.outcome == Outcome::released;
        score.cancelled += strike.outcome == Outcome::cancelled;
        score.moved += strike.outcome == Outcome::released && strike.moves > 0;
    }
    score.false_notes = score.released - matched;
    score.missed = score.true_contacts - matched;
    score.timing_median_ms = median(errors_ms);
    score.timing_p95_ms = quantile(errors_ms, 0.95);
    return score;
}

}  // namespace app
