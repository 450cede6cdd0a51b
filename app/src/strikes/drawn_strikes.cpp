#include "strikes/drawn_strikes.h"

#include <algorithm>

namespace app {
namespace {

constexpr double kFadeS = 0.1;
constexpr double kLongAgoS = 2;  // no cancelled strike comes back after that

bool same(const sim::Impulse& a, const sim::Impulse& b) {
    return a.t_s == b.t_s && a.point_body == b.point_body && a.impulse_body == b.impulse_body;
}

double toward(double value, double target, double step) {
    return value < target ? std::min(target, value + step) : std::max(target, value - step);
}

}  // namespace

sim::Impulse impulse_of(const Strike& strike) {
    return {strike.instrument, strike.contact_s, strike.point_body, strike.impulse_body};
}

void DrawnStrikes::start(double T, std::span<const Strike> strikes) {
    const auto settled = [&](const Strike& strike) {
        if (strike.outcome == Outcome::cancelled) return strike.decided_at_s < T - kLongAgoS;
        return seen_.contains(strike.id) && folded_.contains(strike.id);
    };
    while (first_open_ < strikes.size() && settled(strikes[first_open_])) ++first_open_;
    for (std::size_t i = first_open_; i < strikes.size(); ++i) {
        const Strike& strike = strikes[i];
        if (strike.outcome == Outcome::cancelled || strike.contact_s > T || seen_.contains(strike.id))
            continue;
        seen_.insert(strike.id);
        drawn_.push_back({strike.id, impulse_of(strike)});
    }
}

std::vector<sim::WeightedImpulse> DrawnStrikes::frame(double T, std::span<const Strike> strikes) {
    const double step = (T - last_s_) / kFadeS;
    last_s_ = T;
    const auto is_replaced = [&](const Drawn& d) {
        const Strike& strike = strikes[d.id - 1];
        return strike.outcome == Outcome::released && !same(d.first, impulse_of(strike));
    };
    for (Drawn& d : drawn_) {
        const Strike& strike = strikes[d.id - 1];
        const bool replaced = is_replaced(d);
        d.first_weight =
            toward(d.first_weight, replaced || strike.outcome == Outcome::cancelled ? 0 : 1, step);
        if (replaced) d.final_weight = toward(d.final_weight, 1, step);
    }
    start(T, strikes);

    std::vector<sim::WeightedImpulse> result;
    for (const Drawn& d : drawn_) {
        const bool is_folded = folded_.contains(d.id), replaced = is_replaced(d);
        const double first_excess = d.first_weight - (is_folded && !replaced ? 1 : 0);
        const double final_excess = d.final_weight - (is_folded && replaced ? 1 : 0);
        if (first_excess != 0) result.push_back({d.first, first_excess});
        if (final_excess != 0) result.push_back({impulse_of(strikes[d.id - 1]), final_excess});
    }
    std::erase_if(drawn_, [&](const Drawn& d) {
        const bool faded = d.first_weight == 0 && strikes[d.id - 1].outcome == Outcome::cancelled;
        if (faded) seen_.erase(d.id);
        const bool replaced_settled = d.final_weight == 1 && d.first_weight == 0;
        const bool first_settled =
            d.first_weight == 1 && d.final_weight == 0 && same(d.first, impulse_of(strikes[d.id - 1]));
        return faded || (folded_.contains(d.id) && (replaced_settled || first_settled));
    });
    return result;
}

}  // namespace app
