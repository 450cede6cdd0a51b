#include "play/choked_bodies.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace app {
namespace {

constexpr double kStopsS = 0.1;
constexpr double kLongestS = 60;

/// Time in which the slowest motion of a body falls below 1e-4.
double dies_away_s(const sim::BodyDefinition& body) {
    double slowest = std::log(1000) / body.visual.decay_s;  // [1/s]
    if (const sim::Stand& stand = body.stand; stand.hinged) {
        const double omega = 2 * std::numbers::pi * stand.frequency_hz, ratio = stand.damping_ratio;
        slowest = std::min(slowest, omega * (ratio > 1 ? 1 / (ratio + std::sqrt(ratio * ratio - 1)) : ratio));
    }
    return slowest > 0 ? std::min(std::log(1e4) / slowest, kLongestS) : kLongestS;
}

}  // namespace

ChokedBodies::ChokedBodies(const Kit& kit, double t0_s, double render_lead_s)
    : t0_s_(t0_s), render_lead_s_(render_lead_s) {
    for (const Instrument& instrument : kit.instruments)
        bodies_.push_back({instrument.voice.choke_group, dies_away_s(instrument.body)});
}

void ChokedBodies::take(const audio::Note& note, double s) {
    using Kind = audio::Note::Kind;
    const double at_s = t0_s_ + static_cast<double>(note.onset_sample) / audio::kSampleRate;
    const std::string& group = bodies_.at(note.voice).group;
    for (std::uint32_t i = 0; i < bodies_.size(); ++i) {
        const bool chokes = note.kind == Kind::choke ? i == note.voice
                                                     : note.kind == Kind::stroke && i != note.voice &&
                                                           !group.empty() && bodies_[i].group == group;
        if (chokes) end(i, at_s, s);
    }
}

void ChokedBodies::end(std::uint32_t instrument, double c, double s) {
    std::vector<Choke>& all = bodies_.at(instrument).chokes;
    all.insert(std::ranges::upper_bound(all, c, {}, &Choke::at_s), {c, std::max(c, s + render_lead_s_)});
}

double ChokedBodies::weight(const sim::Impulse& impulse, double T) const {
    const std::vector<Choke>& all = bodies_.at(impulse.body).chokes;
    double left = 1;
    for (auto choke = std::ranges::upper_bound(all, impulse.t_s, {}, &Choke::at_s);
         choke != all.end() && choke->at_s < T && left > 0; ++choke)
        left = std::min(left, std::clamp(1 - (T - choke->begins_s) / kStopsS, 0.0, 1.0));
    return left * left * (3 - 2 * left);
}

void ChokedBodies::folded(const Folded& strike) {
    moving_.push_back(strike);
}

std::vector<ChokedBodies::Folded> ChokedBodies::take_stopped(double s) {
    std::vector<Folded> stopped;
    std::erase_if(moving_, [&](const Folded& strike) {
        if (s - strike.impulse.t_s > bodies_.at(strike.impulse.body).dies_away_s) return true;
        if (weight(strike.impulse, s) > 0) return false;
        stopped.push_back(strike);
        return true;
    });
    return stopped;
}

}  // namespace app
