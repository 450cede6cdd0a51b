#pragma once
#include <tracking/predictor.h>

#include <optional>
#include <span>
#include <string_view>
#include <vector>

namespace app {

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
    void differentiate();
    /// The node at or before a lead.
    [[nodiscard]] std::size_t node_before(double lead_s) const noexcept;

    AnswerForm form_;
    std::size_t sample_nodes_ = 0;  // 1 if the sample stands for lead 0
    bool answered_ = false;
    std::vector<Node> nodes_, next_;
};

}  // namespace app
