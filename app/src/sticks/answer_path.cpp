#include "sticks/answer_path.h"

#include <fmt/format.h>
#include <tracking/rotation.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>

#include "files/one_line.h"

namespace app {
namespace {

constexpr double kFarthestM = 1e6;
constexpr double kNormSlack = 0.01;

/// Rotation vector of the shorter way from one orientation to another, world frame.
Eigen::Vector3d turn_between(const Eigen::Quaterniond& from, const Eigen::Quaterniond& to) {
    return tracking::logarithm(to * from.conjugate());
}

/// Rates at the nodes from the slopes between them: of the parabola through three neighbours.
Eigen::Vector3d rate_at(std::size_t i, const std::vector<double>& steps,
                        const std::vector<Eigen::Vector3d>& slopes) {
    const std::size_t last = slopes.size();  // of the nodes
    if (last == 0) return Eigen::Vector3d::Zero();
    if (last == 1) return slopes[0];
    const std::size_t k = std::clamp<std::size_t>(i, 1, last - 1);  // the middle one of the three
    const double before = steps[k - 1], after = steps[k];
    const Eigen::Vector3d bend = (slopes[k] - slopes[k - 1]) / (before + after);  // half the acceleration
    if (i < k) return slopes[0] - before * bend;
    if (i > k) return slopes[k] + after * bend;
    return slopes[k - 1] + before * bend;
}

Eigen::Matrix3d symmetric(const double* n) {
    Eigen::Matrix3d m;
    m << n[0], n[1], n[2], n[1], n[3], n[4], n[2], n[4], n[5];
    return m;
}

bool positive(const Eigen::Matrix3d& m) {
    constexpr double kRounding = 1e-12;  // of the largest entry
    const Eigen::Vector3d values =
        Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(m, Eigen::EigenvaluesOnly).eigenvalues();
    return values.minCoeff() >= -kRounding * m.cwiseAbs().maxCoeff();
}

}  // namespace

AnswerForm parse_answer_form(std::string_view line) {
    AnswerForm form;
    const std::array<std::pair<std::string_view, bool*>, 3> optional = {
        {{"velocity", &form.velocity}, {"orientation", &form.orientation}, {"covariance", &form.covariance}}};
    std::string_view rest = line;
    const auto next = [&rest] {
        rest.remove_prefix(std::min(rest.find_first_not_of(" \t\r"), rest.size()));
        const std::string_view word = rest.substr(0, rest.find_first_of(" \t\r"));
        rest.remove_prefix(word.size());
        return word;
    };
    bool in_order = next() == "position";
    std::string_view word = next();
    for (const auto& [name, given] : optional)
        if (word == name) {
            *given = true;
            word = next();
        }
    in_order = in_order && word.empty();
    if (!in_order)
        throw std::runtime_error(fmt::format(
            "found \"{}\", expected \"position [velocity] [orientation] [covariance]\"", one_line(line, 60)));
    return form;
}

AnswerPath::AnswerPath(std::span<const double> leads_s, const AnswerForm& form)
    : form_(form), sample_nodes_(leads_s.front() > 0 ? 1 : 0) {
    nodes_.resize(leads_s.size() + sample_nodes_);
    for (std::size_t i = 0; i < leads_s.size(); ++i) nodes_[i + sample_nodes_].lead_s = leads_s[i];
    next_ = nodes_;
}

AnswerPath::Node AnswerPath::parse(std::size_t index, std::span<const double> numbers,
                                   const tracking::PosePrediction& sample) const {
    const auto refuse = [&](const std::string& found, const std::string& expected) {
        throw std::runtime_error(
            fmt::format("found {} at lead {} s, expected {}", found, nodes_[index].lead_s, expected));
    };
    const double* n = numbers.data() + (index - sample_nodes_) * form_.numbers();
    const auto three = [&n] {
        n += 3;
        return Eigen::Vector3d(n[-3], n[-2], n[-1]);
    };
    Node node{nodes_[index].lead_s, sample, Eigen::Matrix3d::Zero()};
    node.pose.position = three();
    if (!(node.pose.position.norm() <= kFarthestM))
        refuse(fmt::format("a position {} m away", node.pose.position.norm()), "metres, within 1000000");
    if (form_.velocity) node.pose.velocity = three();
    if (form_.orientation) {
        node.pose.orientation = Eigen::Quaterniond(n[0], n[1], n[2], n[3]);
        const double norm = node.pose.orientation.norm();
        if (!(std::abs(norm - 1) <= kNormSlack))
            refuse(fmt::format("a quaternion of norm {}", norm), "w x y z of norm 1");
        node.pose.orientation.normalize();
        n += 4;
    }
    if (form_.covariance) {
        node.covariance = symmetric(n);
        if (!positive(node.covariance))
            refuse("a covariance with a negative variance", "xx xy xz yy yz zz of a covariance [m^2]");
    }
    return node;
}

void AnswerPath::take(const tracking::PosePrediction& sample, std::span<const double> numbers) {
    for (std::size_t i = sample_nodes_; i < next_.size(); ++i) next_[i] = parse(i, numbers, sample);
    if (sample_nodes_ > 0) next_[0] = {0, sample, next_[1].covariance};
    differentiate();
    nodes_.swap(next_);
    answered_ = true;
}

void AnswerPath::differentiate() {
    std::vector<double> steps;
    std::vector<Eigen::Vector3d> slopes, turns;
    for (std::size_t i = 1; i < next_.size(); ++i) {
        const Node &a = next_[i - 1], &b = next_[i];
        steps.push_back(b.lead_s - a.lead_s);
        slopes.emplace_back((b.pose.position - a.pose.position) / steps.back());
        turns.emplace_back(turn_between(a.pose.orientation, b.pose.orientation) / steps.back());
    }
    for (std::size_t i = 0; i < next_.size(); ++i) {
        const bool stated = form_.velocity && i >= sample_nodes_;
        if (!stated) next_[i].pose.velocity = rate_at(i, steps, slopes);
        next_[i].pose.angular_velocity = rate_at(i, steps, turns);
    }
}

std::size_t AnswerPath::node_before(double lead_s) const noexcept {
    const auto after = std::upper_bound(nodes_.begin(), nodes_.end(), lead_s,
                                        [](double lead, const Node& node) { return lead < node.lead_s; });
    return static_cast<std::size_t>(std::max<std::ptrdiff_t>(after - nodes_.begin() - 1, 0));
}

tracking::PosePrediction AnswerPath::at(double lead_s) const noexcept {
    const std::size_t i = node_before(lead_s);
    const Node& a = nodes_[i];
    const double past = lead_s - a.lead_s;
    if (!(past > 0)) return a.pose;
    if (i + 1 == nodes_.size()) return tracking::pose_beyond(a.pose, past);
    return tracking::pose_between(a.pose, nodes_[i + 1].pose, nodes_[i + 1].lead_s - a.lead_s, past);
}

std::optional<tracking::PoseCovariance> AnswerPath::covariance_at(double lead_s) const noexcept {
    if (!form_.covariance || !answered_) return std::nullopt;
    const std::size_t i = node_before(lead_s);
    const Node& a = nodes_[i];
    tracking::PoseCovariance result;
    result.position = a.covariance;
    if (i + 1 < nodes_.size() && lead_s > a.lead_s) {
        const double s = (lead_s - a.lead_s) / (nodes_[i + 1].lead_s - a.lead_s);
        result.position += s * (nodes_[i + 1].covariance - a.covariance);
    }
    return result;
}

}  // namespace app
