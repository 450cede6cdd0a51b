#include "tracking/training.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <stdexcept>
#include <string>
#include <tuple>

#include "learned/contact_training.h"
#include "learned/learned_path.h"
#include "learned/network_training.h"
#include "learned/training_examples.h"

namespace tracking {
namespace {

constexpr double kMostContactLoss = 0.7;  // of the shares': a network that knows less would silence strokes

constexpr std::size_t kSightingsOfStick = 30, kMostExamples = 300000, kMostValidation = 30000;
constexpr double kUsualRateHz = 60, kNoiseM = 0.25e-3;
constexpr Eigen::Index kBatch = 256;
constexpr double kRate = 2e-3, kWarmUpSteps = 500;
constexpr float kDecay = 0.1F;
constexpr double kShaftWeight = 0.5;  // of the shaft in the loss, beside the position
constexpr std::size_t kReports = 24;  // of the progress
constexpr double kSettlingS = 0.5;
constexpr double kFirstLogSpread = -3;
constexpr double kSpreadWeight = 0.05;  // of the errors' likelihood, beside the loss

/// Of the sticks held out, or of the others [s].
double duration_of(std::span<const TrainingStick> sticks, bool held_out) {
    double sum = 0;
    for (const TrainingStick& s : sticks)
        if (s.held_out == held_out && !s.stick.samples.empty())
            sum += s.stick.samples.back().t_s - s.stick.samples.front().t_s;
    return sum;
}

/// `all`: also of the sticks held out.
Examples learning_examples(std::span<const TrainingStick> sticks, std::uint64_t seed, bool all) {
    const double expected = (duration_of(sticks, false) + (all ? duration_of(sticks, true) : 0)) *
                            kSightingsOfStick * kUsualRateHz;
    const double share = std::min(1.0, static_cast<double>(kMostExamples) / (1.1 * expected));
    ExampleCollector collector(kMostExamples);
    for (std::size_t k = 0; k < kSightingsOfStick; ++k)
        for (std::size_t i = 0; i < sticks.size(); ++i) {
            if (sticks[i].held_out && !all) continue;
            const Sighting sighting = random_sighting(mixed_seed(seed, k, i), false);
            collector.add(sticks[i], sighting, share * std::min(1.0, kUsualRateHz / sighting.sensor.rate_hz));
        }
    return std::move(collector).finish();
}

/// What the sticks held out look like to the sensor that scores are stated for.
Examples usual_examples(std::span<const TrainingStick> sticks, bool orientation) {
    const double expected = duration_of(sticks, true) * kUsualRateHz;
    Sighting usual;
    usual.sensor.rate_hz = kUsualRateHz;
    usual.sensor.noise_m = kNoiseM;
    usual.orientation = orientation;
    ExampleCollector collector(kMostValidation);
    for (const TrainingStick& stick : sticks)
        if (stick.held_out)
            collector.add(stick, usual,
                          std::min(1.0, static_cast<double>(kMostValidation) / (1.1 * expected)), kSettlingS);
    return std::move(collector).finish();
}

/// What each squared residual counts in the loss.
struct LossWeights {
    Eigen::VectorXf of_output = Eigen::VectorXf::Zero(2 * kNodes);  ///< lead x (position, shaft)
    std::vector<float> of_example;

    explicit LossWeights(const Examples& e) : of_example(e.speed) {
        for (float& weight : of_example) weight *= weight;
        scale(e);
        std::map<std::size_t, std::pair<double, double>> recordings;  // loss of the fading velocity, count
        for (Eigen::Index i = 0; i < e.count(); ++i) {
            auto& [sum, count] = recordings[e.recording[static_cast<std::size_t>(i)]];
            sum += loss(e, i);
            count += 1;
        }
        double sum = 0;
        for (std::size_t i = 0; i < of_example.size(); ++i) {
            const auto& [loss, count] = recordings[e.recording[i]];
            of_example[i] *= static_cast<float>(std::sqrt(count) / std::max(loss, 1e-9));
            sum += of_example[i];
        }
        for (float& weight : of_example)
            weight *= static_cast<float>(static_cast<double>(of_example.size()) / sum);
        scale(e);
    }

private:
    [[nodiscard]] double loss(const Examples& e, Eigen::Index i) const {
        double sum = 0;
        for (Eigen::Index j = 0; j < of_output.size(); ++j)
            sum += static_cast<double>(of_output[j]) *
                   static_cast<double>(e.means.col(i).segment<3>(3 * j).squaredNorm());
        return sum * static_cast<double>(of_example[static_cast<std::size_t>(i)]);
    }
    /// The fading velocity then has a loss of 1, and of kShaftWeight, at each lead.
    void scale(const Examples& e) {
        for (Eigen::Index j = 0; j < of_output.size(); ++j) {
            double sum = 0, known = 0;
            for (Eigen::Index i = 0; i < e.count(); ++i) {
                sum += static_cast<double>(of_example[static_cast<std::size_t>(i)]) *
                       static_cast<double>(e.means.col(i).segment<3>(3 * j).squaredNorm());
                known += static_cast<double>(e.known(j, i));
            }
            of_output[j] = sum > 0 ? static_cast<float>((j % 2 == 0 ? 1 : kShaftWeight) * known / sum) : 0;
        }
    }
};

/// Weights of the squares of an example's residuals.
Eigen::VectorXf weights_of(const Examples& e, const LossWeights& loss, Eigen::Index i) {
    Eigen::VectorXf weights(kPathMeans);
    for (Eigen::Index j = 0; j < loss.of_output.size(); ++j)
        weights.segment<3>(3 * j).setConstant(e.known(j, i) * loss.of_output[j] *
                                              loss.of_example[static_cast<std::size_t>(i)]);
    return weights;
}

/// Examples drawn at random with replacement, half of them mirrored.
struct Batch {
    Eigen::MatrixXf inputs = Eigen::MatrixXf(StickHistory::kInputs, kBatch),
                    means = Eigen::MatrixXf(kPathMeans, kBatch), weights = means;

    void draw(const Examples& e, const LossWeights& loss, RandomStream& random) {
        for (Eigen::Index b = 0; b < kBatch; ++b) {
            const auto i = std::min(
                e.count() - 1, static_cast<Eigen::Index>(random.uniform() * static_cast<double>(e.count())));
            inputs.col(b) = e.inputs.col(i);
            means.col(b) = e.means.col(i);
            if (random.uniform() < 0.5) mirror(inputs.col(b), means.col(b));
            weights.col(b) = weights_of(e, loss, i);
        }
    }
};

double rate_at(std::size_t step, std::size_t steps) {
    const double share = static_cast<double>(step) / static_cast<double>(steps);
    return kRate * std::min(1.0, static_cast<double>(step) / kWarmUpSteps) * 0.5 *
           (1 + std::cos(std::numbers::pi * share));
}

/// A residual of position in units of what the network says of it, and of the shaft, at a lead: whitened as
/// ErrorShape says.
Eigen::Vector3d whitened(const Eigen::Ref<const Eigen::VectorXf>& outputs, const Eigen::VectorXf& residual,
                         std::size_t lead) {
    return shape_of(outputs.tail<kPathSpreads>(), lead)
        .whitened(residual.segment<3>(static_cast<Eigen::Index>(6 * lead)).cast<double>());
}
double whitened_shaft(const Eigen::Ref<const Eigen::VectorXf>& outputs, const Eigen::VectorXf& residual,
                      std::size_t lead) {
    return static_cast<double>(residual.segment<3>(static_cast<Eigen::Index>(6 * lead + 3)).norm()) *
           std::exp(-shape_of(outputs.tail<kPathSpreads>(), lead).log_shaft);
}

/// One training of one network.
class Learner {
public:
    Learner(const Examples& learning, const TrainingOptions& options)
        : learning_(learning),
          options_(options),
          random_(mixed_seed(options.seed, 2, 0)),
          layers_(initial_layers(StickHistory::kInputs, options.hidden, kPathOutputs, random_)) {
        for (std::size_t lead = 0; lead < kNodes; ++lead) {
            const auto at = static_cast<Eigen::Index>(kPathMeans + kShapeNumbers * lead);
            layers_[2].bias.segment<3>(at).setConstant(kFirstLogSpread);
            layers_[2].bias[at + 6] = kFirstLogSpread;
        }
    }

    /// Returns the steps taken: all, unless `goes_on` says no. It gets the share of them that is done.
    std::size_t learn(const std::function<bool(double)>& goes_on) {
        const LossWeights loss(learning_);
        const std::size_t steps = options_.steps, every = std::max<std::size_t>(1, steps / kReports);
        for (std::size_t step = 1; step <= steps; ++step) {
            batch_.draw(learning_, loss, random_);
            improve(static_cast<float>(rate_at(step, steps)));
            const bool reports = step % every == 0 || step == steps;
            if (reports && !goes_on(static_cast<double>(step) / static_cast<double>(steps))) return step;
        }
        return steps;
    }
    [[nodiscard]] const Layers& layers() const { return layers_; }

private:
    void improve(float rate) {
        run_forward(layers_, batch_.inputs, activations_);
        slope_.topRows<kPathMeans>() =
            (activations_.outputs.topRows<kPathMeans>() - batch_.means).cwiseProduct(batch_.weights) /
            static_cast<float>(kBatch);
        for (Eigen::Index b = 0; b < kBatch; ++b) set_spread_slopes(b);
        run_backward(layers_, batch_.inputs, activations_, slope_, gradient_);
        for (std::size_t i = 0; i < layers_.size(); ++i) adams_[i].step(layers_[i], gradient_[i], rate);
    }
    /// Slopes of the negative logarithm of the likelihood of normal errors, sum(l + w^2 / 2) with the whitened
    /// residual w, by what the network says of them; the residual is taken as given. What lies beyond kFarthest
    /// standard deviations counts as if it lay there.
    void set_spread_slopes(Eigen::Index b) {
        static constexpr double kFarthest = 5;
        const Eigen::VectorXf residual = activations_.outputs.col(b).head<kPathMeans>() - batch_.means.col(b);
        const auto outputs = activations_.outputs.col(b);
        const auto within = [](double x) { return std::clamp(x, -kFarthest, kFarthest); };
        for (std::size_t lead = 0; lead < kNodes; ++lead) {
            Eigen::Matrix<double, kShapeNumbers, 1> slope = Eigen::Matrix<double, kShapeNumbers, 1>::Zero();
            const auto at = static_cast<Eigen::Index>(6 * lead);
            if (batch_.weights(at, b) > 0) {
                const Eigen::Vector3d w = whitened(outputs, residual, lead).unaryExpr(within);
                const ErrorShape shape = shape_of(outputs.tail<kPathSpreads>(), lead);
                const auto of_regression = [&](int i, int j) {
                    return w[i] *
                           within(std::exp(-shape.log_spread[i]) * static_cast<double>(residual[at + j]));
                };
                slope << 1 - w[0] * w[0], 1 - w[1] * w[1], 1 - w[2] * w[2], of_regression(1, 0),
                    of_regression(2, 0), of_regression(2, 1), 0;
            }
            if (batch_.weights(at + 3, b) > 0) {
                const double w = within(whitened_shaft(outputs, residual, lead));
                slope[6] = 3 - w * w;
            }
            slope_.col(b).segment<kShapeNumbers>(
                static_cast<Eigen::Index>(kPathMeans + kShapeNumbers * lead)) =
                (kSpreadWeight / static_cast<double>(kBatch) * slope).cast<float>();
        }
    }

    const Examples& learning_;
    const TrainingOptions& options_;
    RandomStream random_;
    Layers layers_, gradient_ = layers_;
    std::array<Adam, 3> adams_ = {Adam(layers_[0], kDecay), Adam(layers_[1], kDecay),
                                  Adam(layers_[2], kDecay)};
    Batch batch_;
    Activations activations_;
    Eigen::MatrixXf slope_ = Eigen::MatrixXf(kPathOutputs, kBatch);
};

/// Squared errors over what the spreads say of them, ascending, of position (k = 0) or shaft (3) at a lead.
std::vector<double> normalised_squares(const Layers& layers, const std::array<Examples, 2>& held_out,
                                       std::size_t lead, std::size_t k) {
    std::vector<double> squares;
    for (const Examples& e : held_out) {
        Activations a;
        run_forward(layers, e.inputs, a);
        for (Eigen::Index i = 0; i < e.count(); ++i) {
            if (!(e.known(static_cast<Eigen::Index>(2 * lead + (k == 3 ? 1 : 0)), i) > 0)) continue;
            const Eigen::VectorXf residual = a.outputs.col(i).head<kPathMeans>() - e.means.col(i);
            const double of_shaft = whitened_shaft(a.outputs.col(i), residual, lead);
            squares.push_back(k == 3 ? of_shaft * of_shaft
                                     : whitened(a.outputs.col(i), residual, lead).squaredNorm());
        }
    }
    std::sort(squares.begin(), squares.end());
    return squares;
}

double share_below(const std::vector<double>& ascending, double limit) {
    const auto above = std::upper_bound(ascending.begin(), ascending.end(), limit);
    return static_cast<double>(above - ascending.begin()) / static_cast<double>(ascending.size());
}

/// The factor of variances with which the regions of 50 and 95 % hold what they say as nearly as can be; an error
/// of 1 % of the latter counts as one of 2.5 % of the former.
double calibrating_factor(const std::vector<double>& squares) {
    constexpr int kTries = 64;
    constexpr double kImportance = 2.5;
    double best = 1, least = std::numeric_limits<double>::infinity();
    for (int i = 0; i <= kTries; ++i) {
        const double factor = std::exp2(8.0 * i / kTries - 3);
        const double miss = std::max(std::abs(share_below(squares, kRadius50 * factor) - 0.5),
                                     kImportance * std::abs(share_below(squares, kRadius95 * factor) - 0.95));
        if (miss < least) least = miss, best = factor;
    }
    return best;
}

/// What is to be added to the biases of the last layer, so that regions of the held-out errors hold what they say.
Eigen::VectorXf calibration(const Layers& layers, const std::array<Examples, 2>& held_out) {
    Eigen::VectorXf shifts = Eigen::VectorXf::Zero(kPathOutputs);
    for (std::size_t lead = 0; lead < kNodes; ++lead)
        for (const std::size_t k : {0, 3}) {
            const std::vector<double> squares = normalised_squares(layers, held_out, lead, k);
            if (squares.empty()) continue;
            const auto first = static_cast<Eigen::Index>(kPathMeans + kShapeNumbers * lead);
            shifts.segment(k == 3 ? first + 6 : first, k == 3 ? 1 : 3)
                .setConstant(static_cast<float>(0.5 * std::log(calibrating_factor(squares))));
        }
    return shifts;
}

/// RMS in mm of the tracked point's residuals, and of what the network has to predict, at a lead.
std::pair<double, double> rms_mm(const Layers& layers, const Examples& e, std::size_t lead) {
    Activations a;
    run_forward(layers, e.inputs, a);
    double sum = 0, fading = 0, count = 0;
    const auto at = static_cast<Eigen::Index>(6 * lead);
    for (Eigen::Index i = 0; i < e.count(); ++i) {
        if (!(e.known(static_cast<Eigen::Index>(2 * lead), i) > 0)) continue;
        const double unit = 1e3 * static_cast<double>(e.speed[static_cast<std::size_t>(i)]);
        const Eigen::Vector3f truth = e.means.col(i).segment<3>(at);
        sum += unit * unit * static_cast<double>((a.outputs.col(i).segment<3>(at) - truth).squaredNorm());
        fading += unit * unit * static_cast<double>(truth.squaredNorm());
        count += 1;
    }
    return {std::sqrt(sum / count), std::sqrt(fading / count)};
}

std::vector<TrainingScore> scores_of(const Layers& layers, const std::array<Examples, 2>& held_out) {
    std::vector<TrainingScore> scores;
    for (std::size_t lead = 0; lead < kNodes; ++lead) {
        TrainingScore score;
        score.lead_s = kPathLeads[lead];
        std::tie(score.with_shaft_mm, score.fading_mm) = rms_mm(layers, held_out[0], lead);
        score.position_only_mm = rms_mm(layers, held_out[1], lead).first;
        const std::vector<double> squares = normalised_squares(layers, held_out, lead, 0);
        score.inside_50 = share_below(squares, kRadius50);
        score.inside_95 = share_below(squares, kRadius95);
        scores.push_back(score);
    }
    return scores;
}

void check(const TrainingOptions& options, const Examples& learning,
           const std::array<Examples, 2>& held_out) {
    const auto require = [](bool holds, const std::string& found, const std::string& expected) {
        if (!holds) throw std::invalid_argument("training: found " + found + ", expected " + expected);
    };
    require(options.hidden >= PathModel::kLeastHidden && options.hidden <= PathModel::kMostHidden,
            std::to_string(options.hidden) + " hidden units", "4 to 128");
    require(options.steps > 0, "no steps", "at least one");
    require(learning.count() >= kBatch, std::to_string(learning.count()) + " samples to learn from",
            "at least " + std::to_string(kBatch) + "; give longer or more recordings");
    for (const Examples& e : held_out)
        for (std::size_t lead = 0; lead < kNodes; ++lead)
            require(e.count() > 0 && e.known.row(static_cast<Eigen::Index>(2 * lead)).any(),
                    "nothing held out that can be scored " + std::to_string(kPathLeads[lead]) + " s ahead",
                    "more than 0.5 s of another recording, not all of it flagged");
}

/// A network of inputs as they are, and the steps that it took.
std::pair<Layers, std::size_t> learned_from(Examples examples, const TrainingOptions& options,
                                            const std::function<bool(double)>& goes_on) {
    const InputScaling scaling(examples.inputs);
    scaling.apply(examples.inputs);
    Learner learner(examples, options);
    const std::size_t steps = learner.learn(goes_on);
    Layers layers = learner.layers();
    scaling.fold_into(layers[0]);
    return {std::move(layers), steps};
}

}  // namespace

TrainingResult train_path_model(std::span<const TrainingStick> sticks, const TrainingOptions& options) {
    const auto goes_on = [&](double share) { return !options.progress || options.progress(share); };
    TrainingResult result;
    Layers& layers = result.model.layers;
    Examples learning = learning_examples(sticks, options.seed, false);
    result.examples = static_cast<std::size_t>(learning.count());
    const std::array<Examples, 2> held_out = {usual_examples(sticks, true), usual_examples(sticks, false)};
    check(options, learning, held_out);
    std::tie(layers, result.steps) =
        learned_from(std::move(learning), options, [&](double share) { return goes_on(0.5 * share); });
    const Eigen::VectorXf shifts = calibration(layers, held_out);
    layers[2].bias += shifts;
    result.scores = scores_of(layers, held_out);
    if (result.steps < options.steps) return result;

    learning = learning_examples(sticks, options.seed, true);
    result.examples = static_cast<std::size_t>(learning.count());
    std::tie(layers, result.steps) =
        learned_from(std::move(learning), options, [&](double share) { return goes_on(0.5 + 0.5 * share); });
    layers[2].bias += shifts;
    if (!options.contacts) return result;
    if (std::optional<LearnedContacts> contacts = train_contacts(sticks, options)) {
        if (contacts->loss < kMostContactLoss * contacts->loss_of_shares)
            result.model.contacts = std::move(contacts->layers);
        result.contact_examples = contacts->examples;
        result.contact_steps = contacts->steps;
        result.contact_loss = contacts->loss;
        result.contact_loss_of_shares = contacts->loss_of_shares;
    }
    return result;
}

}  // namespace tracking
