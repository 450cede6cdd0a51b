#include "sticks/prediction_file.h"

#include <fmt/format.h>
#include <tracking/input.h>
#include <tracking/rotation.h>
#include <tracking/trace_rows.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>

#include "files/bad_input.h"

namespace app {
namespace fs = std::filesystem;
namespace {

/// 1e-9 s, and what writing t as a double can cost.
double lead_tolerance_s(double t_s) {
    return 1e-9 + 4 * std::numeric_limits<double>::epsilon() * std::abs(t_s);
}

/// The stamps that are newer than all before, but the first.
std::vector<double> stamps_after_first(std::span<const tracking::PoseSample> samples) {
    std::vector<double> stamps;
    double newest = -std::numeric_limits<double>::infinity();
    for (const tracking::PoseSample& sample : samples)
        if (sample.t_s > newest) stamps.push_back(newest = sample.t_s);
    if (!stamps.empty()) stamps.erase(stamps.begin());
    return stamps;
}

class Replay : public tracking::Predictor {
public:
    explicit Replay(StickPredictions predictions)
        : predictions_(std::move(predictions)), held_(tracking::make_predictor("hold")) {}

    [[nodiscard]] tracking::SampleStatus correct(const tracking::PoseSample& sample) noexcept override {
        const tracking::SampleStatus status = held_->correct(sample);
        if (is_taken(status)) ++taken_;
        return status;
    }
    [[nodiscard]] tracking::PosePrediction predict(double lead_s) const noexcept override {
        tracking::PosePrediction pose = held_->predict(0);
        if (taken_ < 2 || taken_ - 2 >= predictions_.rows.size()) return pose;
        const tracking::PoseSample& row = predictions_.rows[taken_ - 2];
        const double share = predictions_.lead_s > 0 ? lead_s / predictions_.lead_s : 1;
        const Eigen::Vector3d step = row.position - pose.position;
        pose.position = share == 1 ? row.position : (pose.position + share * step).eval();
        if (predictions_.lead_s > 0) pose.velocity = step / predictions_.lead_s;
        if (row.has_orientation) turn(pose, row.orientation, share);
        return pose;
    }
    [[nodiscard]] double time_s() const noexcept override { return held_->time_s(); }

private:
    /// Turns the pose by `share` of the shorter way to another orientation.
    void turn(tracking::PosePrediction& pose, const Eigen::Quaterniond& to, double share) const {
        const Eigen::Vector3d whole = tracking::logarithm(to * pose.orientation.conjugate());
        pose.orientation = share == 1 ? to : tracking::exponential(share * whole) * pose.orientation;
        if (predictions_.lead_s > 0) pose.angular_velocity = whole / predictions_.lead_s;
    }

    StickPredictions predictions_;
    std::unique_ptr<tracking::Predictor> held_;  // `hold`: judges samples, keeps the newest pose
    std::size_t taken_ = 0;
};

}  // namespace

PredictionFile read_prediction_file(const fs::path& file) {
    PredictionFile result;
    const std::string text = tracking::read_bytes(file.string());
    result.rows = tracking::parse_trace(text, file.string());  // refuses what cannot be read
    result.lines.resize(result.rows.sticks.size());
    tracking::TraceRows rows(file.string(), tracking::RowOrder::strict);
    std::istringstream lines(text.substr(text.starts_with("\xEF\xBB\xBF") ? 3 : 0));
    std::string line;
    try {
        for (std::size_t number = 1; std::getline(lines, line); ++number) {
            line.erase(line.find_last_not_of(" \t\r") + 1);
            if (line.empty()) continue;
            if (const auto row = rows.take(line)) result.lines[row->stick].push_back(number);
        }
    } catch (const tracking::TraceError&) {  // a recording that is no table
        throw BadInput(
            fmt::format("{}: error: found a recording in another format, expected rows as `musicworld "
                        "predict` writes",
                        file.string()));
    }
    return result;
}

StickPredictions match_predictions(const PredictionFile& file, const std::string& stick,
                                   std::span<const tracking::PoseSample> samples) {
    const std::vector<tracking::StickTrace>& sticks = file.rows.sticks;
    const auto found = std::ranges::find(sticks, stick, &tracking::StickTrace::name);
    if (found == sticks.end())
        throw BadInput(
            fmt::format("{}: error: found no predictions of stick {}, expected a row for every "
                        "sample from the second on",
                        file.rows.file, stick));
    const std::vector<std::size_t>& lines = file.lines[static_cast<std::size_t>(found - sticks.begin())];
    const std::vector<double> stamps = stamps_after_first(samples);
    if (found->samples.size() != stamps.size())
        throw BadInput(
            fmt::format("{}:{}:1: error: found {} rows of stick {}, the last one here, expected {}: one for "
                        "every sample from the second on; were they made from the same samples?",
                        file.rows.file, lines.back(), lines.size(), stick, stamps.size()));
    StickPredictions result{found->samples.front().t_s - stamps.front(), found->samples};
    for (std::size_t i = 0; i < stamps.size(); ++i) {
        const double t = result.rows[i].t_s, lead = t - stamps[i];
        if (!(lead >= 0) || std::abs(lead - result.lead_s) > lead_tolerance_s(t))
            throw BadInput(fmt::format(
                "{}:{}:1: error: found t = {}, {} s after its sample, expected {} s as in the first row; "
                "t is the time predicted for",
                file.rows.file, lines[i], t, lead, std::max(result.lead_s, 0.0)));
    }
    return result;
}

std::unique_ptr<tracking::Predictor> make_replay(StickPredictions predictions) {
    return std::make_unique<Replay>(std::move(predictions));
}

}  // namespace app
