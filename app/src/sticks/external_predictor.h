#pragma once
#include <tracking/predictor.h>

#include <exception>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "process/line_child.h"
#include "sticks/answer_path.h"

namespace app {

/// How long an external predictor is waited for.
struct ExternalPatience {
    double start_s = 10, answer_s = 2;
};

/// A predictor of one's own: a child process that gets one sample a line and answers where the stick will be
/// at the leads that it was told at the start. The line protocol is in assets/predictors/README.md.
///
/// Between the leads its answers are interpolated (AnswerPath). Samples that are not newer or not finite are
/// not sent; before the sample after a gap of more than kGapS the child is told to start anew. A sample is
/// sent when correct() gets it, so the child is causal by construction.
///
/// correct() waits for the answer, at most ExternalPatience::answer_s (the child's first line: start_s). When
/// the child ends, hangs or answers anything but what it announced, the predictor keeps what went wrong,
/// answers `not_finite` from then on, and predicts its last good path; see require_working().
class ExternalPredictor : public tracking::Predictor {
public:
    /// Starts `sh -c COMMAND` and waits for its first line. Throws std::runtime_error, one line.
    ExternalPredictor(const std::string& command, std::span<const double> leads_s, const std::string& stick,
                      ExternalPatience patience = {});

    [[nodiscard]] tracking::SampleStatus correct(const tracking::PoseSample& sample) noexcept override;
    [[nodiscard]] tracking::PosePrediction predict(double lead_s) const noexcept override {
        return path_.at(lead_s);
    }
    [[nodiscard]] double time_s() const noexcept override { return held_->time_s(); }
    [[nodiscard]] std::optional<tracking::PoseCovariance> covariance(double lead_s) const noexcept override {
        return path_.covariance_at(lead_s);
    }

    /// As before the first sample: times may begin again. The child is told to start anew.
    void begin_anew() { held_ = tracking::make_predictor("hold"); }
    /// What went wrong; null while all is well.
    [[nodiscard]] const std::exception_ptr& failure() const noexcept { return failure_; }

private:
    /// Sends a sample, after `restart` if the child is to start anew, and takes the answer.
    void exchange(const tracking::PoseSample& sample, bool anew);

    std::string place_;                          // for messages
    std::vector<double> leads_s_;                // ascending, each once
    std::unique_ptr<tracking::Predictor> held_;  // `hold`: judges samples, keeps the newest pose
    ExternalPatience patience_;
    std::optional<LineChild> child_;
    AnswerForm form_;
    AnswerPath path_;
    std::vector<double> numbers_;  // of one answer
    std::string line_;             // to send
    std::size_t answers_ = 0;
    std::exception_ptr failure_;
};

}  // namespace app
