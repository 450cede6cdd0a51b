#include "strikes/strike_decision.h"

#include <algorithm>
#include <cmath>

#include "strikes/true_contacts.h"

namespace app {
namespace {

constexpr double kRemembered = 20;    // strikes
constexpr double kErrorsKept = 0.98;  // of the sums of errors, a sample
constexpr double kSeenS = 0.02;       // an entry is known, at the latest, so long after it

using Contacts = std::vector<sim::Contact>;

/// The first contact with a body from outside.
Contacts::const_iterator first_with(const Contacts& contacts, std::size_t body) {
    return std::ranges::find_if(contacts, [&](const sim::Contact& contact) { return contact.body == body; });
}

/// In place of the first contact with its body, or added to it.
void put(Contacts& contacts, const sim::Contact& contact) {
    if (const auto first = first_with(contacts, contact.body); first != contacts.end()) contacts.erase(first);
    contacts.insert(std::ranges::upper_bound(contacts, contact.t_s, {}, &sim::Contact::t_s), contact);
}

}  // namespace

void StrikeDecision::Share::add(bool it_came) {
    const double kept = std::min(1.0, (kRemembered - 1) / std::max(of, 1.0));
    came = kept * came + (it_came ? 1 : 0);
    of = kept * of + 1;
}

double StrikeDecision::prior(Kind kind, bool known) {
    return kind != network_alone ? 0.95 : known ? 0.8 : 0.05;
}

double StrikeDecision::probability(Kind kind, bool known) const {
    const double weight = kind != network_alone ? kRemembered : 4;
    const Share& share = shares_[kind];
    return (prior(kind, known) * weight + share.came) / (weight + share.of);
}

double StrikeDecision::silent_until_s(std::size_t surface, Kind kind, const ExpectedStrikes& expected) const {
    const double p = probability(kind, expected.known);
    if (p <= false_cost_ * (1 - p)) return kNever;
    if (!expected.known || expected.times.empty() || !expected.times[surface]) return -kNever;
    const double before = prior(kind, true), least = false_cost_ * (1 - before);
    return expected.s + expected.times[surface]->reached_s(least / (least + before)) - kMatchWindow_s;
}

void StrikeDecision::restart() {
    std::ranges::fill(surfaces_, Surface{});
    forecasts_.clear();
}

void StrikeDecision::observe(const ExpectedStrikes& expected) {
    for (std::size_t i = 0; i < surfaces_.size(); ++i) {
        Surface& surface = surfaces_[i];
        const double now = expected.measured_m[i], filtered = expected.filtered_m[i];
        const auto passed = first_with(expected.passed, i);
        const bool went_through = surface.armed && passed != expected.passed.end();
        if (!surface.known) {
            surface.known = true;
            surface.armed = now > 0 && filtered > 0;
        } else if (!surface.armed) {
            surface.lowest_measured_m = std::min(surface.lowest_measured_m, now);
            surface.lowest_filtered_m = std::min(surface.lowest_filtered_m, filtered);
            surface.armed = now >= std::max(kRearm_m, surface.lowest_measured_m + kRearm_m) &&
                            filtered >= std::max(kRearm_m, surface.lowest_filtered_m + kRearm_m);
        }
        if (went_through) {
            strike(i, passed->t_s);
            surface = {true};
        } else if (now > 0) {
            surface.entered_s.reset();
        } else if (surface.armed && !surface.entered_s) {
            const double fall = surface.last_m - now;
            surface.entered_s =
                surface.last_m > 0 ? std::lerp(last_s_, expected.s, surface.last_m / fall) : expected.s;
        }
        if (surface.armed && surface.entered_s && now <= -kContactDepth_m) {
            strike(i, *surface.entered_s);
            surface = {true};
        }
        surface.last_m = now;
    }
    last_s_ = expected.s;
}

void StrikeDecision::strike(std::size_t surface, double t_s) {
    for (Forecast& forecast : forecasts_) {
        if (forecast.surface != surface || forecast.came) continue;
        const auto near = [&](const std::optional<double>& at_s) {
            return at_s && std::abs(*at_s - t_s) <= kMatchWindow_s;
        };
        forecast.came = near(forecast.path_s) || near(forecast.network_s);
        if (!forecast.came || !forecast.path_s || !forecast.network_s) continue;
        path_errors_s_ = kErrorsKept * path_errors_s_ + std::abs(*forecast.path_s - t_s);
        network_errors_s_ = kErrorsKept * network_errors_s_ + std::abs(*forecast.network_s - t_s);
        head_start_s_ *= kErrorsKept;
    }
}

void StrikeDecision::settle(double s) {
    std::erase_if(forecasts_, [&](const Forecast& forecast) {
        const double latest_s =
            std::max(forecast.path_s.value_or(-kNever), forecast.network_s.value_or(-kNever));
        if (latest_s + kMatchWindow_s + kSeenS > s) return false;
        if (forecast.counts) shares_[forecast.kind].add(forecast.came);
        return true;
    });
}

void StrikeDecision::decide(std::size_t surface, const ExpectedStrikes& expected, DecidedStrikes& decided) {
    const auto of_path = first_with(expected.confirmed, surface),
               of_network = first_with(expected.network, surface);
    const bool by_path = of_path != expected.confirmed.end(),
               by_network = of_network != expected.network.end();
    if ((!by_path && !by_network) || (by_path && of_path->starts_inside)) return;
    Forecast forecast{surface, !by_network ? path_alone : by_path ? both : network_alone};
    if (by_path) forecast.path_s = of_path->t_s;
    if (by_network) forecast.network_s = of_network->t_s;
    const double silent_until_s = this->silent_until_s(surface, forecast.kind, expected);
    const double ahead_s = expected.known ? head_start_s_ : -head_start_s_;
    if (forecast.kind == both ? network_errors_s_ < path_errors_s_ + ahead_s
                              : forecast.kind == network_alone && silent_until_s < kNever) {
        put(decided.kept, *of_network);
        put(decided.sounding, *of_network);
    }
    decided.silent_until_s[surface] = silent_until_s;
    const auto first = first_with(decided.sounding, surface);
    const bool is_last =
        first != decided.sounding.end() && first->t_s <= expected.s + expected.interval_s + margin_s_;
    forecast.counts = is_last || forecast.kind == network_alone;
    forecasts_.push_back(forecast);
}

DecidedStrikes StrikeDecision::after(const ExpectedStrikes& expected) {
    observe(expected);
    settle(expected.s);
    DecidedStrikes decided{expected.path, expected.confirmed, std::vector(surfaces_.size(), -kNever)};
    for (std::size_t i = 0; i < surfaces_.size(); ++i)
        if (surfaces_[i].armed && expected.measured_m[i] > 0) decide(i, expected, decided);
    return decided;
}

}  // namespace app
