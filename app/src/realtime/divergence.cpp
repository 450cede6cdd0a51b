#include "realtime/divergence.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "play/offline_run.h"
#include "play/play_setup.h"

namespace app {
namespace {

constexpr double kSameSpeed = 1e-6;  // relative: far below a step of MIDI or 24 bits
constexpr double kNextToS = 0.03;    // as notes are matched with contacts
constexpr double kEarlierS = 2;      // a delay acts on what follows: arming, bodies that still move
constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

/// A filter that was started again comes near to one that was not, but never to the last bit.
bool same_speed(const Strike& a, const Strike& b) {
    return std::abs(a.speed_mps - b.speed_mps) <= kSameSpeed * b.speed_mps;
}

std::vector<Strike> offline_strikes(const tracking::Trace& trace, const Kit& kit, PlayOptions options,
                                    const StickGeometry& stick) {
    options.frames = options.audio = false;
    options.solo.reset();
    const std::unique_ptr<sim::Simulation> simulation = make_simulation(kit, 0);
    const KitStage stage(kit, trace.sticks.size(), stick);
    OfflineRun run(trace, kit, options, stick, *simulation, stage, nullptr, nullptr);
    run.run([](double) {});
    return run.strikes();
}

/// One lap's strikes beside the offline ones.
class LapComparison {
public:
    LapComparison(RealtimeOutcome& outcome, std::uint64_t lap, double end_s)
        : outcome_(outcome), lap_(lap), end_s_(end_s) {
        for (const Strike& strike : outcome.lap_strikes)
            if (outcome.play.strikes[strike.id - 1].onset_s - strike.onset_s >=
                    (static_cast<double>(lap) - 0.5) * outcome.realtime.period_s &&
                outcome.play.strikes[strike.id - 1].onset_s - strike.onset_s <
                    (static_cast<double>(lap) + 0.5) * outcome.realtime.period_s)
                own_.push_back(&strike);
    }

    void compare(const std::vector<Strike>& offline) {
        std::vector<bool> taken(own_.size(), false);
        for (const Strike& strike : offline) {
            if (strike.outcome != Outcome::released) continue;
            // What lies beyond the run's end could not be.
            if (strike.scheduled_at_s > end_s_) continue;
            ++outcome_.offline_strikes;
            const std::ptrdiff_t match = nearest(strike, taken);
            if (match >= 0) taken[static_cast<std::size_t>(match)] = true;
            const Strike* other = match < 0 ? nullptr : own_[static_cast<std::size_t>(match)];
            if (other && other->onset_sample == strike.onset_sample && same_speed(*other, strike)) continue;
            add(strike,
                !other                                       ? "not sounded"
                : other->onset_sample != strike.onset_sample ? "another onset"
                                                             : "another speed",
                strike.onset_s, other ? other->onset_s : kNone);
        }
        for (std::size_t i = 0; i < own_.size(); ++i)
            if (!taken[i] && own_[i]->outcome == Outcome::released)
                add(*own_[i], "sounded only here", kNone, own_[i]->onset_s);
    }

private:
    std::ptrdiff_t nearest(const Strike& strike, const std::vector<bool>& taken) const {
        std::ptrdiff_t best = -1;
        double least = kNextToS;
        for (std::size_t i = 0; i < own_.size(); ++i) {
            const Strike& other = *own_[i];
            if (taken[i] || other.outcome != Outcome::released || other.stick != strike.stick ||
                other.instrument != strike.instrument)
                continue;
            const double apart = std::abs(other.onset_s - strike.onset_s);
            if (apart <= least) least = apart, best = static_cast<std::ptrdiff_t>(i);
        }
        return best;
    }

    void add(const Strike& strike, const std::string& what, double offline_s, double here_s) {
        Divergence departure{lap_, strike.stick, strike.instrument, what, offline_s, here_s,
                             0,    "unexplained"};
        const double from_s = strike.scheduled_at_s - kEarlierS, to_s = strike.onset_s;
        std::map<std::uint32_t, double> before_s;  // the sample before, by stick
        for (const SampleTiming& sample : outcome_.realtime.samples) {
            if (sample.lap != lap_) continue;
            // What was skipped lies before the sample that came instead.
            const auto [before, first] = before_s.try_emplace(sample.stick, sample.t_s);
            const double begin_s = sample.skipped > 0 ? before->second : sample.t_s;
            before->second = sample.t_s;
            if (sample.t_s < from_s || begin_s > to_s) continue;
            const double late_s = std::max(sample.late_s, 0.0);
            if (late_s == 0 && sample.skipped == 0) continue;
            // How late the sample was with the sound, whatever else held it up.
            const double delay_s = static_cast<double>(sample.handed_ns - sample.due_ns) / 1e9;
            if (delay_s <= departure.delay_s) continue;
            departure.delay_s = delay_s;
            departure.cause = sample.skipped > 0 ? "samples skipped" : "sample late";
        }
        if (departure.delay_s == 0 && strike.onset_s > end_s_ - outcome_.realtime.release_margin_s)
            departure.cause = "the run ended";
        outcome_.departures.push_back(departure);
    }

    RealtimeOutcome& outcome_;
    std::uint64_t lap_;
    double end_s_;  // of the run, on the lap's clock
    std::vector<const Strike*> own_;
};

}  // namespace

void find_departures(RealtimeOutcome& outcome, const tracking::Trace& trace, const PlayOptions& options) {
    const std::vector<Strike> offline = offline_strikes(trace, outcome.kit, options, outcome.stick);
    for (std::uint64_t lap = 0; lap < outcome.realtime.laps; ++lap) {
        const double end_s =
            trace.t0_s() + outcome.realtime.seconds - static_cast<double>(lap) * outcome.realtime.period_s;
        LapComparison(outcome, lap, end_s).compare(offline);
    }
}

}  // namespace app
