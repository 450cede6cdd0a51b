#include "traces/live_predict.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <iterator>
#include <stdexcept>

#include "files/bad_input.h"
#include "process/clock.h"
#include "process/stop_signals.h"
#include "report/table.h"
#include "sensors/source_clock.h"
#include "statistics/statistics.h"
#include "sticks/predictors.h"
#include "strikes/strike_forecast.h"
#include "traces/predict.h"

namespace app {
namespace {

constexpr std::size_t kMostDelays = 10'000'000;

/// One stick of a live source.
struct LiveStick {
    std::unique_ptr<tracking::Predictor> predictor;
    std::optional<StrikeForecast> strikes;
    SourceClock clock;
    std::optional<double> first_s;  ///< the source's
    double newest_s = 0;            ///< of what time_of() gave
    double latest_s = 0;            ///< of all times, since the first
    double pauses_s = 0;            ///< one for each jump of the clock
    bool started = false, oriented = false;
};

class LivePredictor {
public:
    LivePredictor(const LivePredictOptions& options, PredictionSink& sink)
        : options_(options),
          sink_(sink),
          maker_(picture_specification(options.predictor)),
          source_(open_source(options.source)),
          sticks_(StickNames::kMostSticks) {}

    LivePredictResult run() {
        const StopSignals signals;
        SourceSample sample;
        std::int64_t first_ns = 0;
        while (!StopSignals::stopped()) {
            if (options_.seconds > 0 && first_ns != 0 && to_s(monotonic_ns() - first_ns) >= options_.seconds)
                break;
            const SourceStatus status = source_->next(sample, monotonic_ns() + kSourcePatienceNs);
            if (status == SourceStatus::ended) break;
            if (status != SourceStatus::sample) continue;
            if (first_ns == 0) first_ns = sample.read_ns;
            take(sample);
        }
        LivePredictResult result;
        result.answers = answers_;
        result.left_out = left_out_;
        result.unsent = sink_.unsent();
        result.faults = source_->faults();
        if (delays_s_.empty()) return result;
        result.p50_s = quantile(delays_s_, 0.5);
        result.p99_s = quantile(delays_s_, 0.99);
        result.most_s = *std::ranges::max_element(delays_s_);
        return result;
    }

private:
    void take(const SourceSample& taken) {
        tracking::PoseSample sample = taken.sample;
        LiveStick& stick = sticks_[taken.stick];
        const std::string& name = source_->sticks().names()[taken.stick];
        if (!stick.predictor) start(stick, name);
        const std::optional<double> t_s = time_of(taken, stick);
        if (!t_s || (stick.started && !(*t_s > stick.newest_s))) {
            ++left_out_;
            return;
        }
        sample.t_s = stick.newest_s = *t_s;
        const double behind_s = tracking::feed(*stick.predictor, sample);
        stick.oriented = stick.oriented || sample.has_orientation;
        if (!std::exchange(stick.started, true)) return;
        prediction_.stick = name;
        prediction_.t_s = taken.has_time ? taken.sample.t_s + source_->head().base_s : sample.t_s;
        prediction_.oriented = stick.oriented;
        prediction_.poses.clear();
        for (const double lead_s : options_.leads_s)
            prediction_.poses.push_back({lead_s, stick.predictor->predict(lead_s + behind_s),
                                         stick.predictor->covariance(lead_s + behind_s)});
        if (stick.strikes) {
            prediction_.strike.reset();
            if (const auto next = stick.strikes->after(*stick.predictor, sample.t_s, behind_s))
                prediction_.strike = {next->in_s, next->probability,
                                      options_.kit->instruments[next->body].name};
        }
        sink_.send(prediction_);
        ++answers_;
        if (delays_s_.size() < kMostDelays) delays_s_.push_back(to_s(monotonic_ns() - taken.read_ns));
    }

    /// The time that the predictor is told: the source's, unchanged but for jumps of its clock, at which the
    /// predictor starts anew. None for a sample that cannot be of its stick's clock.
    std::optional<double> time_of(const SourceSample& taken, LiveStick& stick) const {
        const double t_s = taken.sample.t_s;
        if (!taken.has_time) return to_s(taken.read_ns);
        if (source_->replayed()) return t_s;
        const double shift_s = stick.clock.shift_s();
        if (!stick.first_s) stick.first_s = t_s;
        // Samples may come faster or slower than they were taken: a clock that has never been seen late or early.
        stick.latest_s = std::max(stick.latest_s, t_s + shift_s - *stick.first_s);
        if (!stick.clock.map(t_s, stick.latest_s)) return std::nullopt;
        if (stick.clock.shift_s() != shift_s) stick.pauses_s += 2 * tracking::kGapS;
        return t_s + stick.clock.shift_s() + stick.pauses_s;
    }

    void start(LiveStick& stick, const std::string& name) {
        const StickDefinition definition = options_.kit ? options_.kit->stick : StickDefinition();
        const StickGeometry geometry =
            stick_geometry(source_->head().keys, definition, options_.tip, options_.shaft);
        std::vector<double> leads_s = options_.leads_s;
        if (options_.kit) {
            stick.strikes.emplace(geometry, bodies_of(*options_.kit));
            std::ranges::copy(StrikeForecast::leads(), std::back_inserter(leads_s));
        }
        stick.predictor = maker_.make(leads_s, {name, geometry.shaft});
    }

    const LivePredictOptions& options_;
    PredictionSink& sink_;
    PredictorMaker maker_;
    std::unique_ptr<SampleSource> source_;
    std::vector<LiveStick> sticks_;  // by the source's index
    Prediction prediction_;
    std::uint64_t answers_ = 0, left_out_ = 0;
    std::vector<double> delays_s_;
};

class RowSink final : public PredictionSink {
public:
    void send(const Prediction& p) override {
        if (!std::exchange(headed_, true)) fmt::print("{}", predicted_row_header());
        for (const PredictedPose& at : p.poses)
            fmt::print("{}", predicted_row(p.stick, {p.t_s + at.lead_s, at.pose.position, at.pose.orientation,
                                                     p.oriented}));
        if (std::fflush(stdout) != 0) throw std::runtime_error("error: cannot write to standard output");
    }

private:
    bool headed_ = false;
};

}  // namespace

std::unique_ptr<PredictionSink> make_row_sink() {
    return std::make_unique<RowSink>();
}

LivePredictResult predict_live(const LivePredictOptions& options, PredictionSink& sink) {
    return LivePredictor(options, sink).run();
}

}  // namespace app
