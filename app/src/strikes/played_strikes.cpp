#include "strikes/played_strikes.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace app {

void PlayedStrikes::advance_to(double s) {
    for (std::size_t model = 0; model < schedulers_.size(); ++model) {
        schedulers_[model].advance_to(s);
        take_released(model);
    }
}

void PlayedStrikes::restart() {
    for (StrikeScheduler& scheduler : schedulers_) scheduler.restart(0);
}

void PlayedStrikes::sample(std::size_t model, double s, std::span<const sim::Contact> contacts,
                           std::span<const double> measured, std::span<const double> filtered) {
    schedulers_[model].sample(0, s, contacts, measured, filtered);
    (void)schedulers_[model].take_changes();
}

void PlayedStrikes::select(std::size_t model, double s, std::span<const double> measured) {
    selected_ = model;
    for (std::size_t part = 0; part < shut_.size(); ++part) {
        Shut& shut = shut_[part];
        if (!shut.since_s || s < *shut.since_s) continue;
        shut.lowest = std::min(shut.lowest, measured[part]);
        if (measured[part] >= rules_.rearm_m && measured[part] >= shut.lowest + rules_.rearm_m) shut = {};
    }
}

std::vector<Strike> PlayedStrikes::finish() {
    for (std::size_t model = 0; model < schedulers_.size(); ++model) {
        schedulers_[model].finish();
        take_released(model);
    }
    return std::move(played_);
}

void PlayedStrikes::take_released(std::size_t model) {
    for (const std::uint64_t id : schedulers_[model].take_released()) {
        const Strike& strike = schedulers_[model].strikes()[id - 1];
        const double stood_by_s = unplayed_s_[selected_][strike.instrument];
        if (model == selected_ || std::abs(strike.onset_s - stood_by_s) <= rules_.late_s)
            play(strike);
        else
            unplayed_s_[model][strike.instrument] = strike.onset_s;
    }
}

void PlayedStrikes::play(const Strike& strike) {
    Shut& shut = shut_[strike.instrument];
    if (schedulers_.size() > 1 && shut.since_s) return;
    shut = {strike.onset_s};
    played_.push_back(strike);
    played_.back().id = played_.size();
}

}  // namespace app
