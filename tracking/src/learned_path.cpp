#include "learned_path.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "tracking/rotation.h"

namespace tracking {
namespace {

/// Before the first lead the spread is that of the first, in proportion to the lead down to this part of it.
constexpr double kLeastShare = 0.2;
// exp() of what a network says stays within what a stick can do.
constexpr double kLeastLogSpread = -12, kMostLogSpread = 2, kMostRegression = 20;

double lead_of(std::size_t node) {
    return node == 0 ? 0 : kPathLeads[node - 1];
}

}  // namespace

Eigen::Vector3d ErrorShape::whitened(const Eigen::Vector3d& e) const noexcept {
    const Eigen::Vector3d w(e[0], e[1] + regression[0] * e[0],
                            e[2] + regression[1] * e[0] + regression[2] * e[1]);
    return (-log_spread).array().exp() * w.array();
}

Eigen::Matrix3d ErrorShape::covariance() const noexcept {
    // The inverse of the unit lower triangle, times the spreads.
    Eigen::Matrix3d root;
    root << 1, 0, 0, -regression[0], 1, 0, regression[0] * regression[2] - regression[1], -regression[2], 1;
    root *= log_spread.array().exp().matrix().asDiagonal();
    return root * root.transpose();
}

ErrorShape shape_of(const Eigen::Ref<const Eigen::VectorXf>& outputs, std::size_t lead) noexcept {
    const Eigen::Matrix<double, kShapeNumbers, 1> y =
        outputs.segment<kShapeNumbers>(static_cast<Eigen::Index>(kPathMeans + kShapeNumbers * lead))
            .cast<double>();
    const auto logarithm = [](double x) { return std::clamp(x, kLeastLogSpread, kMostLogSpread); };
    return {y.head<3>().unaryExpr(logarithm),
            y.segment<3>(3).cwiseMin(kMostRegression).cwiseMax(-kMostRegression), logarithm(y[6])};
}

LearnedPath::LearnedPath(const PathFrame& frame, const PathOutputs& outputs,
                         const Eigen::Quaterniond& orientation)
    : frame_(frame), orientation_(orientation), outputs_(outputs) {
    for (std::size_t l = 0; l < kNodes; ++l) {
        const auto at = static_cast<Eigen::Index>(6 * l);
        Eigen::Matrix<double, 6, 1>& value = nodes_[l + 1].value;
        value.head<3>() = frame.speed * frame.to_world(outputs.segment<3>(at));
        value.tail<3>() = frame.speed / kLever * frame.to_world(outputs.segment<3>(at + 3));
    }
    set_slopes();
}

void LearnedPath::set_slopes() noexcept {
    for (std::size_t i = 0; i <= kNodes; ++i) {
        const std::size_t middle = std::clamp<std::size_t>(i, 1, kNodes - 1);
        const Node &a = nodes_[middle - 1], &b = nodes_[middle], &c = nodes_[middle + 1];
        const double ab = lead_of(middle) - lead_of(middle - 1), bc = lead_of(middle + 1) - lead_of(middle);
        const Eigen::Matrix<double, 6, 1> before = (b.value - a.value) / ab, after = (c.value - b.value) / bc;
        const Eigen::Matrix<double, 6, 1> bend = (after - before) / (ab + bc);  // half the second derivative
        nodes_[i].slope = before + bend * (2 * lead_of(i) - lead_of(middle - 1) - lead_of(middle));
    }
}

LearnedPath::Node LearnedPath::added(double lead_s) const noexcept {
    std::size_t i = 0;
    while (i < kNodes && lead_of(i + 1) <= lead_s) ++i;
    if (i == kNodes) return {nodes_[i].value, Eigen::Matrix<double, 6, 1>::Zero()};
    const Node &a = nodes_[i], &b = nodes_[i + 1];
    const double step = lead_of(i + 1) - lead_of(i), s = (lead_s - lead_of(i)) / step;
    const double from_b = s * s * (3 - 2 * s), va = s * (1 - s) * (1 - s), vb = s * s * (s - 1);
    const double slope = 6 * s * (1 - s), wa = (1 - s) * (1 - 3 * s), wb = s * (3 * s - 2);
    return {a.value + from_b * (b.value - a.value) + step * (va * a.slope + vb * b.slope),
            slope / step * (b.value - a.value) + wa * a.slope + wb * b.slope};
}

PosePrediction LearnedPath::after(double lead_s) const noexcept {
    const Node add = added(lead_s);
    const double fading = 1 - kFadingRate * fading_way(lead_s);  // of a velocity, at that lead
    PosePrediction pose;
    pose.position = frame_.faded_position(lead_s) + add.value.head<3>();
    pose.velocity = fading * frame_.velocity + add.slope.head<3>();
    pose.orientation = orientation_;
    if (!frame_.has_direction()) return pose;
    const Eigen::Vector3d base = frame_.faded_direction(lead_s), sum = base + add.value.tail<3>();
    const double length = sum.norm();
    if (!(length > 1e-6)) return pose;
    const Eigen::Vector3d direction = sum / length;
    const Eigen::Vector3d rate = fading * frame_.angular_velocity.cross(base) + add.slope.tail<3>();
    pose.angular_velocity = direction.cross(rate / length);
    pose.orientation = (rotation_between(frame_.direction, direction) * orientation_).normalized();
    return pose;
}

PoseCovariance LearnedPath::covariance_at(std::size_t node) const noexcept {
    const ErrorShape shape = shape_of(outputs_, node);
    Eigen::Matrix3d axes;  // columns: forward, up, across
    axes << frame_.cosine, 0, -frame_.sine, 0, 1, 0, frame_.sine, 0, frame_.cosine;
    const double shaft = frame_.speed / kLever * std::exp(shape.log_shaft);
    PoseCovariance covariance;
    covariance.position = frame_.speed * frame_.speed * axes * shape.covariance() * axes.transpose();
    covariance.velocity = covariance.position / (kPathLeads[node] * kPathLeads[node]);
    covariance.rotation = shaft * shaft * Eigen::Matrix3d::Identity();
    return covariance;
}

PoseCovariance LearnedPath::covariance(double lead_s) const noexcept {
    std::size_t i = 0;
    while (i < kNodes && kPathLeads[i] <= lead_s) ++i;
    const auto sum = [](double share_a, const PoseCovariance& a, double share_b, const PoseCovariance& b) {
        return PoseCovariance{share_a * a.position + share_b * b.position,
                              share_a * a.velocity + share_b * b.velocity,
                              share_a * a.rotation + share_b * b.rotation};
    };
    if (i == 0 || i == kNodes) {
        const PoseCovariance at = covariance_at(i == 0 ? 0 : kNodes - 1);
        const double share = std::max(kLeastShare, lead_s / kPathLeads[i == 0 ? 0 : kNodes - 1]);
        return sum(share * share, at, 0, at);
    }
    const double share = (lead_s - kPathLeads[i - 1]) / (kPathLeads[i] - kPathLeads[i - 1]);
    return sum(1 - share, covariance_at(i - 1), share, covariance_at(i));
}

SampleStatus Learned::correct(const PoseSample& sample) noexcept {
    const SampleStatus status = clock_.judge(sample);
    if (!is_taken(status)) return status;
    clock_.advance(sample.t_s);
    if (status == SampleStatus::reinitialised) {
        history_.restart();
        orientation_.setIdentity();
    }
    history_.push(sample);
    if (sample.has_orientation) orientation_ = sample.orientation.normalized();
    PathFrame frame;
    PathOutputs outputs = PathOutputs::Zero();
    if (history_.held() > 1) {
        StickHistory::Inputs inputs;
        frame = history_.look(inputs);
        evaluate(model_->layers, inputs, outputs);
    } else {
        frame.position = sample.position;
    }
    path_ = LearnedPath(frame, outputs, orientation_);
    return status;
}

}  // namespace tracking
