#include "tracking/contact_times.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "learned/contact_view.h"
#include "learned/network.h"

namespace tracking {
namespace {

constexpr double kFarthestS = 0.25;  // distance over speed
constexpr double kNearS = 0.005;     // where the logarithm of the distance begins
constexpr std::size_t kFewest = 3;   // samples

static_assert(TipView::kInputs == StickHistory::kInputs);

double distance_s(const TipView& view, const Plane& plane) {
    return plane.normal.dot(view.tip - plane.point) / view.speed;
}

/// The network's answer. Allocates nothing. One product after the other in a fixed order.
void evaluate(const PathModel::Layers& layers, const ContactInputs& inputs,
              ContactOutputs& outputs) noexcept {
    using Hidden = Eigen::Matrix<float, Eigen::Dynamic, 1, 0, static_cast<int>(PathModel::kMostHidden), 1>;
    const auto& [first, second, last] = layers;
    Hidden h1 = first.bias;
    h1.noalias() += first.weights * inputs;
    h1 = h1.cwiseMax(kLeak * h1);
    Hidden h2 = second.bias;
    h2.noalias() += second.weights * h1;
    h2 = h2.cwiseMax(kLeak * h2);
    outputs = last.bias;
    outputs.noalias() += last.weights * h2;
}

}  // namespace

double ContactTimes::probability_between(double from_s, double to_s) const noexcept {
    const auto until = [&](double t_s) {
        const double at = std::clamp(t_s / kBinS, 0.0, static_cast<double>(kBins));
        const auto bin = std::min(static_cast<std::size_t>(at), kBins - 1);
        return std::lerp(before[bin], before[bin + 1], at - static_cast<double>(bin));
    };
    return until(to_s) - until(from_s);
}

double ContactTimes::reached_s(double probability) const noexcept {
    for (std::size_t bin = 0; bin < kBins; ++bin)
        if (before[bin + 1] >= probability && before[bin + 1] > before[bin])
            return kBinS *
                   (static_cast<double>(bin) + (probability - before[bin]) / (before[bin + 1] - before[bin]));
    return std::numeric_limits<double>::infinity();
}

double ContactTimes::median_s() const noexcept {
    return std::min(reached_s(0.5 * probability()), kHorizonS);
}

TipHistory::TipHistory(const Eigen::Vector3d& shaft, const Eigen::Vector3d& tip)
    : tip_(tip), history_(std::make_unique<StickHistory>(shaft)) {}
TipHistory::TipHistory(TipHistory&& other) noexcept = default;
TipHistory& TipHistory::operator=(TipHistory&& other) noexcept = default;
TipHistory::~TipHistory() = default;

void TipHistory::restart() noexcept {
    history_->restart();
}

void TipHistory::push(PoseSample sample) noexcept {
    sample.position += sample.orientation.normalized() * tip_;
    history_->push(sample);
}

bool TipHistory::look(TipView& view) const noexcept {
    if (history_->held() < kFewest) return false;
    StickHistory::Inputs inputs;
    const PathFrame frame = history_->look(inputs);
    view.tip = frame.position;
    view.velocity = frame.velocity;
    view.cosine = frame.cosine;
    view.sine = frame.sine;
    view.speed = frame.speed;
    std::copy(inputs.data(), inputs.data() + inputs.size(), view.inputs.begin());
    return true;
}

bool in_reach(const TipView& view, const Plane& plane) noexcept {
    const double d = distance_s(view, plane);
    return d < kFarthestS && d > 0;
}

void look_at(const TipView& view, const Plane& plane, ContactInputs& inputs) noexcept {
    constexpr auto kOwn = static_cast<Eigen::Index>(TipView::kInputs);
    inputs.head<kOwn>() = Eigen::Map<const Eigen::Matrix<float, kOwn, 1>>(view.inputs.data());
    PathFrame frame;
    frame.cosine = view.cosine;
    frame.sine = view.sine;
    const Eigen::Vector3f normal = frame.to_frame(plane.normal);
    inputs.segment<3>(kPlaneNormal) = normal;
    const double d = distance_s(view, plane);
    Eigen::Index next = kPlaneNormal + 3;
    inputs[next++] = static_cast<float>(std::clamp(d, 0.0, kFarthestS));
    inputs[next++] = static_cast<float>(std::asinh(d / kNearS));
    for (std::size_t k = 0; k < StickHistory::kSpans; ++k)
        inputs[next++] = normal.dot(inputs.segment<3>(static_cast<Eigen::Index>(3 * k)));
}

ContactTimes contact_times(const PathModel& model, const TipView& view, const Plane& plane) noexcept {
    ContactTimes times;
    if (!in_reach(view, plane)) return times;
    ContactInputs inputs;
    look_at(view, plane, inputs);
    ContactOutputs outputs;
    evaluate(*model.contacts, inputs, outputs);
    const Eigen::Array<double, static_cast<int>(kContactOutputs), 1> odds =
        (outputs.array() - outputs.maxCoeff()).cast<double>().exp();
    const double all = odds.sum();
    double sum = 0;
    for (std::size_t bin = 0; bin < ContactTimes::kBins; ++bin) {
        sum += odds[static_cast<Eigen::Index>(bin)];
        times.before[bin + 1] = sum / all;
    }
    return times;
}

}  // namespace tracking
