#pragma once
#include <tracking/predictor.h>

#include <exception>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace app {

class LineChild;

/// What an external predictor answers for each lead, in this order, as its first line announced.
struct AnswerForm {
    bool velocity = false;     ///< after the position: 3 numbers [m/s]
    bool orientation = false;  ///< then 4: w x y z, body to world
    bool covariance = false;   ///< then 6: xx xy xz yy yz zz of the position [m^2]

    [[nodiscard]] std::size_t numbers() const {
        return 3U + (velocity ? 3U : 0U) + (orientation ? 4U : 0U) + (covariance ? 6U : 0U);
    }
};

/// Reads "position [velocity] [orientation] [covariance]". Throws std::runtime_error "found ..., expected
/// ...".
[[nodiscard]] AnswerForm parse_answer_form(std::string_view line);

/// The path through a predictor's answers at fixed leads.
///
/// At a lead that was answered it is the answer. Between: positions by cubic Hermite pieces, orientations by
/// slerp. Velocities that were not answered are those of the parabola through three neighbours (exact for
/// constant acceleration; at the ends, the outer parabola's), angular velocities likewise from the rotations
/// between neighbours. The newest sample stands for lead 0 where that was not asked for; beyond the last
/// lead velocity and angular velocity stay. Orientations that are not answered stay as in the sample.
class AnswerPath {
public:
    AnswerPath() = default;
    /// `leads_s` ascending, each once, >= 0, not empty.
    AnswerPath(std::span<const double> leads_s, const AnswerForm& form);

    /// The path of the answer to a sample: form.numbers() for each lead. Throws std::runtime_error "found
    /// ..., expected ..." for numbers that cannot be (and then leaves the path as it was): positions beyond
    /// 1e6 m, quaternions whose norm is not within 1 % of 1, covariances that are not positive semidefinite.
    void take(const tracking::PosePrediction& sample, std::span<const double> numbers);

    [[nodiscard]] tracking::PosePrediction at(double lead_s) const noexcept;
    /// Linear between the answers, held outside; none if the form has none or nothing was answered yet.
    [[nodiscard]] std::optional<tracking::PoseCovariance> covariance_at(double lead_s) const noexcept;

private:
    struct Node {
        double lead_s = 0;
        tracking::PosePrediction pose;
        Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
    };
    [[nodiscard]] Node parse(std::size_t index, std::span<const double> numbers,
                             const tracking::PosePrediction& sample) const;
    void differentiate(std::vector<Node>& nodes) const;
    /// The node at or before a lead.
    [[nodiscard]] std::size_t node_before(double lead_s) const noexcept;

    AnswerForm form_;
    std::size_t sample_nodes_ = 0;  // 1 if the sample stands for lead 0
    bool answered_ = false;
    std::vector<Node> nodes_;
};

/// How long an external predictor is waited for.
struct ExternalPatience {
    double start_s = 10, answer_s = 2;
};

/// A predictor of one's own: a child process that gets one sample a line and answers where the stick will be
/// at the leads that it got at the start. The line protocol is in assets/predictors/README.md.
///
/// Between the leads its answers are interpolated (AnswerPath). Samples that are not newer or not finite are
/// not sent; before the sample after a gap of more than kGapS the child gets `restart`. A sample is
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
    ~ExternalPredictor() override;

    [[nodiscard]] tracking::SampleStatus correct(const tracking::PoseSample& sample) noexcept override;
    [[nodiscard]] tracking::PosePrediction predict(double lead_s) const noexcept override {
        return path_.at(lead_s);
    }
    [[nodiscard]] double time_s() const noexcept override { return held_->time_s(); }
    [[nodiscard]] std::optional<tracking::PoseCovariance> covariance(double lead_s) const noexcept override {
        return path_.covariance_at(lead_s);
    }

    /// As before the first sample: times may begin again. The child gets `restart`.
    void begin_anew() { held_ = tracking::make_predictor("hold"); }
    void require_working() const override {
        if (failure_) std::rethrow_exception(failure_);
    }

private:
    /// Sends a sample, after `restart` if the child is to start anew, and takes the answer.
    void exchange(const tracking::PoseSample& sample, bool anew);

    std::string place_;                          // for messages
    std::vector<double> leads_s_;                // ascending, each once
    std::unique_ptr<tracking::Predictor> held_;  // `hold`: judges samples, keeps the newest pose
    ExternalPatience patience_;
    std::unique_ptr<LineChild> child_;
    AnswerForm form_;
    AnswerPath path_;
    std::vector<double> numbers_;  // of one answer
    std::string line_;             // to send
    std::size_t answers_ = 0;
    std::exception_ptr failure_;
};

}  // namespace app
