#include "learned/learned_path.h"

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

ErrorShape shape_of(const Eigen::Ref<const Eigen::VectorXf>& spreads, std::size_t lead) noexcept {
    const Eigen::Matrix<double, kShapeNumbers, 1> y =
        spreads.segment<kShapeNumbers>(static_cast<Eigen::Index>(kShapeNumbers * lead)).cast<double>();
    const auto logarithm = [](double x) { return std::clamp(x, kLeastLogSpread, kMostLogSpread); };
    return {y.head<3>().unaryExpr(logarithm),
            y.segment<3>(3).cwiseMin(kMostRegression).cwiseMax(-kMostRegression), logarithm(y[6])};
}

LearnedPath::Added LearnedPath::added(double lead_s, Eigen::Index first) const noexcept {
    const auto at = [&](std::size_t node) -> Eigen::Vector3d {
        if (node == 0) return Eigen::Vector3d::Zero();
        return means_.segment<3>(static_cast<Eigen::Index>(6 * (node - 1)) + first).cast<double>();
    };
    std::size_t i = 0;
    while (i < kNodes && lead_of(i + 1) <= lead_s) ++i;
    if (i == kNodes) return {at(i), Eigen::Vector3d::Zero()};
    const auto slope_at = [&](std::size_t node) -> Eigen::Vector3d {
        const std::size_t middle = std::clamp<std::size_t>(node, 1, kNodes - 1);
        const Eigen::Vector3d a = at(middle - 1), b = at(middle), c = at(middle + 1);
        const double ab = lead_of(middle) - lead_of(middle - 1), bc = lead_of(middle + 1) - lead_of(middle);
        const Eigen::Vector3d before = (b - a) / ab, after = (c - b) / bc;
        const Eigen::Vector3d bend = (after - before) / (ab + bc);  // half the second derivative
        return before + bend * (2 * lead_of(node) - lead_of(middle - 1) - lead_of(middle));
    };
    const Eigen::Vector3d a = at(i), b = at(i + 1), of_a = slope_at(i), of_b = slope_at(i + 1);
    const double step = lead_of(i + 1) - lead_of(i), s = (lead_s - lead_of(i)) / step;
    const double from_b = s * s * (3 - 2 * s), va = s * (1 - s) * (1 - s), vb = s * s * (s - 1);
    const double inner = 6 * s * (1 - s), wa = (1 - s) * (1 - 3 * s), wb = s * (3 * s - 2);
    return {a + from_b * (b - a) + step * (va * of_a + vb * of_b),
            inner / step * (b - a) + wa * of_a + wb * of_b};
}

PosePrediction LearnedPath::after(double lead_s) const noexcept {
    const Added to_position = added(lead_s, 0);
    const double fading = 1 - kFadingRate * fading_way(lead_s);  // of a velocity, at that lead
    PosePrediction pose;
    pose.position = frame_.faded_position(lead_s) + frame_.speed * frame_.to_world(to_position.value);
    pose.velocity = fading * frame_.velocity + frame_.speed * frame_.to_world(to_position.slope);
    pose.orientation = orientation_;
    if (!frame_.has_direction()) return pose;
    const double of_shaft = frame_.speed / kLever;
    const Added to_shaft = added(lead_s, 3);
    const Eigen::Vector3d base = frame_.faded_direction(lead_s),
                          sum = base + of_shaft * frame_.to_world(to_shaft.value);
    const double length = sum.norm();
    if (!(length > 1e-6)) return pose;
    const Eigen::Vector3d direction = sum / length;
    const Eigen::Vector3d rate =
        fading * frame_.angular_velocity.cross(base) + of_shaft * frame_.to_world(to_shaft.slope);
    pose.angular_velocity = direction.cross(rate / length);
    pose.orientation = (rotation_between(frame_.direction, direction) * orientation_).normalized();
    return pose;
}

PoseCovariance LearnedPath::covariance_at(std::size_t node, const PathSpreads& spreads) const noexcept {
    const ErrorShape shape = shape_of(spreads, node);
    Eigen::Matrix3d axes;  // columns: forward, up, across
    axes << frame_.cosine, 0, -frame_.sine, 0, 1, 0, frame_.sine, 0, frame_.cosine;
    const double shaft = frame_.speed / kLever * std::exp(shape.log_shaft);
    PoseCovariance covariance;
    covariance.position = frame_.speed * frame_.speed * axes * shape.covariance() * axes.transpose();
    covariance.velocity = covariance.position / (kPathLeads[node] * kPathLeads[node]);
    covariance.rotation = shaft * shaft * Eigen::Matrix3d::Identity();
    return covariance;
}

PoseCovariance LearnedPath::covariance(double lead_s, const PathSpreads& spreads) const noexcept {
    std::size_t i = 0;
    while (i < kNodes && kPathLeads[i] <= lead_s) ++i;
    const auto sum = [](double share_a, const PoseCovariance& a, double share_b, const PoseCovariance& b) {
        PoseCovariance both;
        both.position = share_a * a.position + share_b * b.position;
        both.velocity = share_a * a.velocity + share_b * b.velocity;
        both.rotation = share_a * a.rotation + share_b * b.rotation;
        return both;
    };
    if (i == 0 || i == kNodes) {
        const PoseCovariance at = covariance_at(i == 0 ? 0 : kNodes - 1, spreads);
        const double share = std::max(kLeastShare, lead_s / kPathLeads[i == 0 ? 0 : kNodes - 1]);
        return sum(share * share, at, 0, at);
    }
    const double share = (lead_s - kPathLeads[i - 1]) / (kPathLeads[i] - kPathLeads[i - 1]);
    return sum(1 - share, covariance_at(i - 1, spreads), share, covariance_at(i, spreads));
}

Learned::Learned(const PathModel& model, const Eigen::Vector3d& shaft, double memory_s)
    : network_(model), history_(shaft) {
    if (!(memory_s > 0)) return;
    online_.emplace(network_, memory_s);
    examples_.resize(static_cast<std::size_t>(kPathLeads.back() / kExampleS) + 3);
}

SampleStatus Learned::correct(const PoseSample& sample) noexcept {
    const SampleStatus status = clock_.judge(sample);
    if (!is_taken(status)) return status;
    clock_.advance(sample.t_s);
    if (status == SampleStatus::reinitialised) {
        forget();
        orientation_.setIdentity();
    }
    history_.push(sample);
    if (sample.has_orientation) orientation_ = sample.orientation.normalized();
    answered_ = history_.held() > 1;
    if (!answered_) {
        PathFrame frame;
        frame.position = sample.position;
        path_ = LearnedPath(frame, PathMeans::Zero(), orientation_);
        return status;
    }
    if (online_) learn();
    StickHistory::Inputs inputs;
    const PathFrame frame = history_.look(inputs);
    network_.find_hidden(inputs, hidden_);
    path_ = LearnedPath(frame, network_.means(hidden_), orientation_);
    if (online_) remember(frame);
    return status;
}

PathSpreads Learned::spreads() const noexcept {
    return answered_ ? network_.spreads(hidden_) : PathSpreads(PathSpreads::Zero());
}

void Learned::forget() noexcept {
    history_.restart();
    count_ = 0;
}

void Learned::remember(const PathFrame& frame) noexcept {
    const double now_s = clock_.time_s(), dt_s = now_s - last_example_s_;
    if (dt_s < kExampleS || count_ == examples_.size()) return;
    examples_[(first_ + count_++) % examples_.size()] = {now_s, std::min(dt_s, kGapS), frame, hidden_};
    last_example_s_ = now_s;
}

/// The truth is the path between samples.
void Learned::learn() noexcept {
    for (; count_ > 0 && examples_[first_].t_s + kPathLeads.back() <= clock_.time_s();
         first_ = (first_ + 1) % examples_.size(), --count_) {
        const Example& e = examples_[first_];
        PathMeans residuals;
        bool known = true, known_shaft = e.frame.has_direction();
        for (std::size_t l = 0; l < kNodes && known; ++l) {
            const double lead_s = kPathLeads[l];
            const auto at = static_cast<Eigen::Index>(6 * l);
            Eigen::Vector3d position, direction;
            known = history_.find(e.t_s + lead_s, position, direction);
            if (!known) break;
            residuals.segment<3>(at) =
                e.frame.to_frame((position - e.frame.faded_position(lead_s)) / e.frame.speed);
            residuals.segment<3>(at + 3).setZero();
            if (known_shaft)
                residuals.segment<3>(at + 3) =
                    e.frame.to_frame(kLever / e.frame.speed * (direction - e.frame.faded_direction(lead_s)));
        }
        if (!known || !online_->learn(e.hidden, residuals, known_shaft, e.frame.speed, e.dt_s)) continue;
        const Eigen::MatrixXf& weights = online_->weights();
        network_.set_means(weights.leftCols(weights.cols() - 1), weights.rightCols<1>());
    }
}

}  // namespace tracking
