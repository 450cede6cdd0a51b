#include "learned/contact_training.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>

#include "filter/sample_clock.h"
#include "learned/contact_view.h"
#include "learned/network_training.h"
#include "learned/sighting.h"
#include "trace/random_stream.h"

namespace tracking {
namespace {

constexpr std::size_t kSightings = 40, kHeldOutSightings = 2, kPlanesAtOnce = 6;
constexpr std::size_t kMostContactExamples = 300000, kMostContactsHeldOut = 30000;
constexpr double kContactDepthM = 0.003, kTurnM = 0.025;
constexpr Eigen::Index kContactBatch = 256;
constexpr std::size_t kExamplesOfStep = 32, kFewestContactExamples = 8192;  // short trainings need fewer
constexpr std::size_t kMostContactSteps = 20000, kContactChecks = 24;
constexpr std::size_t kMostContactHidden = 64;  // so that a model stays under 200 kB
constexpr double kContactRate = 2e-3, kContactWarmUp = 500;
constexpr float kContactDecay = 0.1F;
constexpr auto kNone = static_cast<int>(ContactTimes::kBins);

struct TipPoint {
    double t_s;
    Eigen::Vector3d tip;
};
using TipPoints = std::vector<TipPoint>;

double height_of(const Plane& plane, const TipPoint& point) {
    return plane.normal.dot(point.tip - plane.point);
}

/// When the tip enters a plane that it then goes deep into, straight between samples.
std::vector<double> entries(const TipPoints& path, const Plane& plane) {
    std::vector<double> times;
    bool armed = false;
    double entered_s = std::numeric_limits<double>::quiet_NaN();  // since the tip is beneath
    for (std::size_t i = 0; i < path.size(); ++i) {
        const double now = height_of(plane, path[i]);
        const bool anew = i == 0 || path[i].t_s - path[i - 1].t_s > kGapS;
        if (anew) armed = now > 0;
        if (anew || now > 0) entered_s = std::numeric_limits<double>::quiet_NaN();
        if (!anew && armed && now <= 0)
            if (const double before = height_of(plane, path[i - 1]); before > 0)
                entered_s = std::lerp(path[i - 1].t_s, path[i].t_s, before / (before - now));
        if (armed && entered_s == entered_s && now <= -kContactDepthM) {
            times.push_back(entered_s);
            armed = false;
        }
        armed = armed || now >= kContactDepthM;
    }
    return times;
}

/// Heights along a normal at which the tip turns back up: falls and rises of at least kTurnM.
std::vector<double> turning_heights(const TipPoints& path, const Eigen::Vector3d& normal) {
    std::vector<double> lows;
    double extreme = normal.dot(path.front().tip);  // the highest or the lowest since the last turn
    bool falling = false;
    for (const TipPoint& point : path) {
        const double height = normal.dot(point.tip);
        extreme = falling ? std::min(extreme, height) : std::max(extreme, height);
        if (std::abs(height - extreme) < kTurnM) continue;
        if (falling) lows.push_back(extreme);
        falling = !falling;
        extreme = height;
    }
    return lows;
}

template <class T>
const T& any_of(const std::vector<T>& values, RandomStream& random) {
    const auto at = static_cast<std::size_t>(random.uniform() * static_cast<double>(values.size()));
    return values[std::min(at, values.size() - 1)];
}

Plane random_plane(const TipPoints& path, RandomStream& random) {
    constexpr double kTilted = 0.25, kTiltRad = 0.25, kNearTurns = 0.6, kAmongTurns = 0.3;
    constexpr double kAmongM = 0.02, kAmongUpM = 0.01, kLeastOverM = 0.005, kMostOverM = 0.065,
                     kLowShare = 0.8;
    Plane plane;
    if (random.uniform() < kTilted)
        plane.normal = (plane.normal + random.normal_vector(kTiltRad)).normalized();
    const std::vector<double> lows = turning_heights(path, plane.normal);
    double height = 0;
    if (!lows.empty() && random.uniform() < kNearTurns) {
        height = any_of(lows, random);
        height += random.uniform() < kAmongTurns ? kAmongUpM + kAmongM * random.normal()
                                                 : std::lerp(kLeastOverM, kMostOverM, random.uniform());
    } else {
        std::vector<double> heights;
        for (const TipPoint& point : path) heights.push_back(plane.normal.dot(point.tip));
        std::sort(heights.begin(), heights.end());
        heights.resize(std::max<std::size_t>(
            1, static_cast<std::size_t>(kLowShare * static_cast<double>(heights.size()))));
        height = any_of(heights, random);
    }
    plane.point = height * plane.normal;
    return plane;
}

struct ContactExamples {
    Eigen::MatrixXf inputs;      ///< kContactInputs x examples
    std::vector<int> bins;       ///< of the next contact; kNone
    std::vector<float> weights;  ///< mean 1; those of a recording sum to the root of their number
    std::vector<std::size_t> recordings;

    [[nodiscard]] Eigen::Index count() const { return static_cast<Eigen::Index>(bins.size()); }
    [[nodiscard]] bool full() const { return count() == inputs.cols(); }
};

bool flagged_between(const std::vector<double>& flags, double from_s, double to_s) {
    constexpr double kAroundS = 0.05;
    const auto next = std::lower_bound(flags.begin(), flags.end(), from_s - kAroundS);
    return next != flags.end() && *next <= to_s + kAroundS;
}

/// The tip's path without what is flagged.
TipPoints trusted_path(const StickTrace& seen, const TrainingStick& source, double slower) {
    TipPoints path;
    for (const PoseSample& sample : seen.samples)
        if (!flagged_between(source.flagged_s, sample.t_s / slower, sample.t_s / slower))
            path.push_back({sample.t_s, sample.position + sample.orientation * source.tip});
    return path;
}

/// Adds a `share` of what is seen of the planes near the tip, at random.
void add_examples(ContactExamples& examples, const TrainingStick& source, const Sighting& sighting,
                  double share) {
    const StickTrace truth = sighting.seen(source.stick);
    const TipPoints path = trusted_path(truth, source, sighting.slower);
    if (path.empty()) return;
    RandomStream random(mixed_seed(sighting.sensor.seed, 7, source.recording));
    std::vector<std::pair<Plane, std::vector<double>>> planes;
    for (std::size_t i = 0; i < kPlanesAtOnce; ++i) {
        const Plane plane = random_plane(path, random);
        planes.emplace_back(plane, entries(path, plane));
    }
    TipHistory history(source.shaft, source.tip);
    TipView view;
    SampleClock clock;
    for (PoseSample sample : sense(truth, sighting.sensor)) {
        // A tip away from the tracked point is not known without the orientation.
        sample.has_orientation = sample.has_orientation && (sighting.orientation || !source.tip.isZero(0));
        const SampleStatus status = clock.judge(sample);
        if (!is_taken(status)) continue;
        if (status == SampleStatus::reinitialised) history.restart();
        clock.advance(sample.t_s);
        history.push(sample);
        const double end_s = sample.t_s + ContactTimes::kHorizonS;
        if (end_s > path.back().t_s || !history.look(view) ||
            flagged_between(source.flagged_s, sample.t_s / sighting.slower, end_s / sighting.slower))
            continue;
        for (const auto& [plane, contacts] : planes) {
            const bool chosen = random.uniform() <= share;
            if (!chosen || !in_reach(view, plane) || examples.full()) continue;
            const auto next = std::upper_bound(contacts.begin(), contacts.end(), sample.t_s);
            const int bin =
                next == contacts.end()
                    ? kNone
                    : static_cast<int>(std::min<double>(kNone, (*next - sample.t_s) / ContactTimes::kBinS));
            ContactInputs inputs;
            look_at(view, plane, inputs);
            examples.inputs.col(examples.count()) = inputs;
            examples.bins.push_back(bin);
            examples.recordings.push_back(source.recording);
        }
    }
}

ContactExamples collect_contacts(std::span<const TrainingStick> sticks, bool held_out, std::size_t most,
                                 std::uint64_t seed) {
    constexpr double kUsualHz = 60, kInReach = 0.5;  // rate; share of the planes
    const std::size_t sightings =
        held_out ? kHeldOutSightings : std::max<std::size_t>(2, kSightings * most / kMostContactExamples);
    double seconds = 0;
    for (const TrainingStick& s : sticks)
        if (s.held_out == held_out && !s.stick.samples.empty())
            seconds += s.stick.samples.back().t_s - s.stick.samples.front().t_s;
    const double expected = seconds * static_cast<double>(sightings * kPlanesAtOnce) * kUsualHz * kInReach;
    ContactExamples examples;
    examples.inputs.resize(kContactInputs, static_cast<Eigen::Index>(most));
    for (std::size_t k = 0; k < sightings; ++k)
        for (std::size_t i = 0; i < sticks.size(); ++i) {
            if (sticks[i].held_out != held_out || sticks[i].stick.samples.empty()) continue;
            const Sighting sighting = random_sighting(mixed_seed(seed, 100 + k, i), held_out);
            add_examples(examples, sticks[i], sighting,
                         std::min(1.0, static_cast<double>(most) / expected) *
                             std::min(1.0, kUsualHz / sighting.sensor.rate_hz));
        }
    examples.inputs.conservativeResize(Eigen::NoChange, examples.count());
    std::map<std::size_t, double> counts;
    for (const std::size_t recording : examples.recordings) counts[recording] += 1;
    double sum = 0;
    for (const auto& [recording, count] : counts) sum += std::sqrt(count);
    for (const std::size_t recording : examples.recordings)
        examples.weights.push_back(
            static_cast<float>(static_cast<double>(examples.count()) / (sum * std::sqrt(counts[recording]))));
    return examples;
}

/// Mean cross entropy of the softmax of the outputs; writes its slope by them.
double cross_entropy(const Eigen::MatrixXf& outputs, const std::vector<int>& bins,
                     const std::vector<float>& weights, Eigen::MatrixXf& slope) {
    double loss = 0;
    slope.resizeLike(outputs);
    for (Eigen::Index b = 0; b < outputs.cols(); ++b) {
        const int bin = bins[static_cast<std::size_t>(b)];
        const float weight = weights[static_cast<std::size_t>(b)];
        ContactOutputs p = (outputs.col(b).array() - outputs.col(b).maxCoeff()).exp();
        p /= p.sum();
        loss -= static_cast<double>(weight * std::log(std::max(p[bin], 1e-12F)));
        p[bin] -= 1;
        slope.col(b) = p * (weight / static_cast<float>(outputs.cols()));
    }
    return loss / static_cast<double>(outputs.cols());
}

double entropy_of_shares(const ContactExamples& e) {
    std::map<int, double> shares;
    for (std::size_t i = 0; i < e.bins.size(); ++i)
        shares[e.bins[i]] += static_cast<double>(e.weights[i]) / static_cast<double>(e.bins.size());
    double entropy = 0;
    for (const auto& [bin, share] : shares) entropy -= share * std::log(share);
    return entropy;
}

class ContactLearner {
public:
    ContactLearner(const ContactExamples& learning, const ContactExamples& held_out,
                   const TrainingOptions& options, std::size_t steps)
        : learning_(learning),
          held_out_(held_out),
          random_(mixed_seed(options.seed, 9, 0)),
          layers_(initial_layers(kContactInputs, std::min(options.hidden, kMostContactHidden),
                                 kContactOutputs, random_)),
          steps_(steps) {}

    [[nodiscard]] LearnedContacts learn() {
        LearnedContacts best{layers_, static_cast<std::size_t>(learning_.count()), steps_,
                             std::numeric_limits<double>::infinity(), entropy_of_shares(held_out_)};
        for (std::size_t step = 1; step <= steps_; ++step) {
            draw();
            run_forward(layers_, inputs_, activations_);
            (void)cross_entropy(activations_.outputs, bins_, weights_, slope_);
            run_backward(layers_, inputs_, activations_, slope_, gradient_);
            const double share = static_cast<double>(step) / static_cast<double>(steps_);
            const double rate = kContactRate * std::min(1.0, static_cast<double>(step) / kContactWarmUp) *
                                0.5 * (1 + std::cos(std::numbers::pi * share));
            for (std::size_t i = 0; i < layers_.size(); ++i)
                adams_[i].step(layers_[i], gradient_[i], static_cast<float>(rate));
            if (step % std::max<std::size_t>(1, steps_ / kContactChecks) != 0 && step != steps_) continue;
            run_forward(layers_, held_out_.inputs, activations_);
            const double loss =
                cross_entropy(activations_.outputs, held_out_.bins, held_out_.weights, slope_);
            if (loss < best.loss) best.loss = loss, best.layers = layers_;
        }
        return best;
    }

private:
    /// Examples at random, half of them mirrored.
    void draw() {
        for (Eigen::Index b = 0; b < kContactBatch; ++b) {
            const auto i = std::min(
                learning_.count() - 1,
                static_cast<Eigen::Index>(random_.uniform() * static_cast<double>(learning_.count())));
            auto input = inputs_.col(b);
            input = learning_.inputs.col(i);
            if (random_.uniform() < 0.5) {
                for (std::size_t v = 0; v < StickHistory::kVectors; ++v)
                    input[static_cast<Eigen::Index>(3 * v + 2)] *= -1;
                input[kPlaneNormal + 2] *= -1;
            }
            bins_[static_cast<std::size_t>(b)] = learning_.bins[static_cast<std::size_t>(i)];
            weights_[static_cast<std::size_t>(b)] = learning_.weights[static_cast<std::size_t>(i)];
        }
    }

    const ContactExamples &learning_, &held_out_;
    RandomStream random_;
    Layers layers_, gradient_ = layers_;
    std::size_t steps_;
    std::array<Adam, 3> adams_ = {Adam(layers_[0], kContactDecay), Adam(layers_[1], kContactDecay),
                                  Adam(layers_[2], kContactDecay)};
    Activations activations_;
    Eigen::MatrixXf inputs_ = Eigen::MatrixXf(kContactInputs, kContactBatch), slope_;
    std::vector<int> bins_ = std::vector<int>(kContactBatch);
    std::vector<float> weights_ = std::vector<float>(kContactBatch);
};

}  // namespace

std::optional<LearnedContacts> train_contacts(std::span<const TrainingStick> sticks,
                                              const TrainingOptions& options) {
    const std::size_t steps = std::min(options.steps, kMostContactSteps);
    ContactExamples learning = collect_contacts(
                        sticks, false,
                        std::clamp(kExamplesOfStep * steps, kFewestContactExamples, kMostContactExamples),
                        options.seed),
                    held_out = collect_contacts(sticks, true, kMostContactsHeldOut, options.seed);
    if (learning.count() < kContactBatch || held_out.count() == 0) return std::nullopt;
    const InputScaling scaling(learning.inputs, {kPlaneNormal + 2});
    scaling.apply(learning.inputs);
    scaling.apply(held_out.inputs);
    LearnedContacts learned = ContactLearner(learning, held_out, options, steps).learn();
    scaling.fold_into(learned.layers[0]);
    return learned;
}

}  // namespace tracking
