#include "learned/training_examples.h"

#include <algorithm>

#include "trace/random_stream.h"

namespace tracking {
namespace {

constexpr double kNearFlagS = 0.05;

bool near_any(const std::vector<double>& times, double t_s) {
    const auto next = std::lower_bound(times.begin(), times.end(), t_s - kNearFlagS);
    return next != times.end() && *next <= t_s + kNearFlagS;
}

}  // namespace

ExampleCollector::ExampleCollector(std::size_t reserve) {
    const auto count = static_cast<Eigen::Index>(reserve);
    examples_.inputs.resize(StickHistory::kInputs, count);
    examples_.means.resize(kPathMeans, count);
    examples_.known.resize(2 * kNodes, count);
    examples_.speed.reserve(reserve);
    examples_.recording.reserve(reserve);
}

void ExampleCollector::add(const TrainingStick& source, const Sighting& sighting, double share,
                           double from_s) {
    if (source.stick.samples.empty()) return;
    const StickTrace truth = sighting.seen(source.stick);
    const double first_s = truth.samples.front().t_s + from_s;
    const auto flagged = [&](const std::vector<double>& times, double t_s, double lead_s) {
        return near_any(times, t_s / sighting.slower) || near_any(times, (t_s + lead_s) / sighting.slower);
    };
    RandomStream random(mixed_seed(sighting.sensor.seed, 1, source.recording));
    StickHistory history(source.shaft);
    StickHistory::Inputs inputs;
    SampleClock clock;
    for (PoseSample sample : sense(truth, sighting.sensor)) {
        sample.has_orientation = sample.has_orientation && sighting.orientation;
        const SampleStatus status = clock.judge(sample);
        if (!is_taken(status)) continue;
        if (status == SampleStatus::reinitialised) history.restart();
        clock.advance(sample.t_s);
        history.push(sample);
        const bool chosen = random.uniform() <= share;
        if (!chosen || history.held() < 2 || sample.t_s < first_s ||
            count_ == static_cast<std::size_t>(examples_.inputs.cols()))
            continue;
        const PathFrame frame = history.look(inputs);
        const auto column = static_cast<Eigen::Index>(count_);
        auto means = examples_.means.col(column);
        auto known = examples_.known.col(column);
        means.setZero();
        known.setZero();
        for (std::size_t l = 0; l < kNodes; ++l) {
            const auto at = static_cast<Eigen::Index>(l);
            const std::optional<PoseSample> then = pose_at(truth, sample.t_s + kPathLeads[l]);
            if (!then || flagged(source.flagged_s, sample.t_s, kPathLeads[l])) continue;
            known[2 * at] = 1;
            means.segment<3>(6 * at) =
                frame.to_frame((then->position - frame.faded_position(kPathLeads[l])) / frame.speed);
            if (!frame.has_direction() || !then->has_orientation ||
                flagged(source.flagged_rotations_s, sample.t_s, kPathLeads[l]))
                continue;
            known[2 * at + 1] = 1;
            means.segment<3>(6 * at + 3) =
                frame.to_frame(kLever / frame.speed *
                               (then->orientation * source.shaft - frame.faded_direction(kPathLeads[l])));
        }
        if (known.isZero()) continue;
        examples_.inputs.col(column) = inputs;
        examples_.speed.push_back(static_cast<float>(frame.speed));
        examples_.recording.push_back(source.recording);
        ++count_;
    }
}

Examples ExampleCollector::finish() && {
    const auto count = static_cast<Eigen::Index>(count_);
    for (Eigen::MatrixXf* matrix : {&examples_.inputs, &examples_.means, &examples_.known})
        matrix->conservativeResize(Eigen::NoChange, count);
    return std::move(examples_);
}

void mirror(Eigen::Ref<Eigen::VectorXf> inputs, Eigen::Ref<Eigen::VectorXf> means) {
    for (std::size_t v = 0; v < StickHistory::kVectors; ++v) {
        float& across = inputs[static_cast<Eigen::Index>(3 * v + 2)];
        across = -across;
    }
    for (Eigen::Index i = 2; i < means.size(); i += 3) means[i] = -means[i];
}

}  // namespace tracking
