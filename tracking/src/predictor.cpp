#include "tracking/predictor.h"

#include <array>
#include <cmath>

#include "filter/extrapolators.h"
#include "filter/interacting_models.h"
#include "filter/kalman_predictor.h"
#include "filter/least_squares.h"
#include "filter/model_bank.h"
#include "filter/smoothers.h"
#include "learned/arbitrated.h"
#include "learned/learned_path.h"
#include "learned/rebounding.h"
#include "specification.h"
#include "trace/text_cursor.h"

namespace tracking {
namespace {

constexpr double kMetres = 1e-3;        // a mm; the parameters are in mm
constexpr double kSquareMetres = 1e-6;  // a mm^2
constexpr double kLeastDensity = 1e-6;
constexpr double kMostDensity = 1e18;

double square(double x) {
    return x * x;
}

/// 0: no sample is refused.
double gate(Specification& specification, double otherwise = 0) {
    return specification.number("gate", otherwise, 1, 1000);
}

/// `r`: the sensor's noise; `p0`, `v0`, `a0`: what is not known at the start; standard deviations in mm and
/// s.
void set_noise(Specification& specification, MotionModel& model) {
    const auto variance = [&](const char* key, double otherwise) {
        return kSquareMetres * square(specification.number(key, otherwise, 1e-9, 1e9));
    };
    model.measurement_variance = variance("r", 0.25);
    model.initial_variance.x() = variance("p0", 10);
    model.initial_variance.y() = variance("v0", 1000);
    // Zero where the model has no acceleration.
    if (model.initial_variance.z() > 0) model.initial_variance.z() = variance("a0", 1e4);
}

std::unique_ptr<Predictor> make_kalman(Specification& specification, MotionModel model) {
    set_noise(specification, model);
    return std::make_unique<KalmanPredictor>(
        model, KalmanOptions{gate(specification), specification.number("steady", 0, 1, 1e4)});
}

double density(Specification& specification, const char* key, double otherwise) {
    return kSquareMetres * specification.number(key, otherwise, kLeastDensity, kMostDensity);
}

MotionModel constant_velocity(double q, double decay = 0) {
    MotionModel model{MotionModel::ConstantVelocity{q}};
    if (decay > 0) model.kind = MotionModel::DecayingVelocity{decay, q};
    model.initial_variance.z() = 0;
    return model;
}

std::unique_ptr<Predictor> make_hold(Specification&) {
    return std::make_unique<Hold>();
}

std::unique_ptr<Predictor> make_naive(Specification& specification) {
    constexpr double kWindow = 1.0 / 15;
    const std::size_t n = specification.whole("n", 0, 1, SampleWindow::kCapacity);
    return std::make_unique<MovingAverage>(n > 0 ? SampleWindow::of_count(n)
                                                 : SampleWindow::of_time(kWindow));
}

std::unique_ptr<Predictor> make_difference(Specification&) {
    return std::make_unique<Difference>();
}

std::unique_ptr<Predictor> make_least_squares(Specification& specification) {
    const std::size_t degree = specification.whole("degree", 2, 0, LeastSquares::kMostDegree);
    const std::size_t n = specification.whole("n", degree + 2, degree + 1, LeastSquares::kMostSamples);
    return std::make_unique<LeastSquares>(static_cast<int>(degree), n);
}

std::unique_ptr<Predictor> make_double_exponential(Specification& specification) {
    return std::make_unique<DoubleExponential>(specification.number("a", 0.9, 0.001, 0.999));
}

std::unique_ptr<Predictor> make_one_euro(Specification& specification) {
    OneEuro::Options options{};
    options.least_cutoff_hz = specification.number("min", 10, 1e-3, 1e5);
    options.beta_hz_s_per_m = specification.number("beta", 0.1, 0, 1e3) / kMetres;
    options.derivative_cutoff_hz = specification.number("d", 30, 1e-3, 1e5);
    return std::make_unique<OneEuro>(options);
}

std::unique_ptr<Predictor> make_thesis(Specification& specification) {
    const Eigen::Vector3d xi = Eigen::Vector3d(1, 20, 63) * kMetres;  // (3.18)
    const double coupled = specification.word("q", "outer") ? 1 : 0;
    const AxisMatrix<double> q{square(xi.x()), coupled * xi.x() * xi.y(), coupled * xi.x() * xi.z(),
                               square(xi.y()), coupled * xi.y() * xi.z(), square(xi.z())};
    return make_kalman(specification, {MotionModel::FixedStep{q}});
}

std::unique_ptr<Predictor> make_cv(Specification& specification) {
    return make_kalman(specification, constant_velocity(density(specification, "q", 1e8),
                                                        specification.number("decay", 0, 1e-3, 1000)));
}

std::unique_ptr<Predictor> make_ca(Specification& specification) {
    return make_kalman(specification, {MotionModel::ConstantAcceleration{density(specification, "q", 1e9)}});
}

double decay_rate(Specification& specification, double otherwise) {
    return specification.number("alpha", otherwise, 1e-3, 1000);
}

std::unique_ptr<Predictor> make_singer(Specification& specification) {
    return make_kalman(specification, {MotionModel::Singer{decay_rate(specification, 3),
                                                           density(specification, "q", 1e10)}});
}

std::unique_ptr<Predictor> make_bank(Specification& specification) {
    ModelBank::Options options;
    options.models = {constant_velocity(density(specification, "cv", 1e7)),
                      MotionModel{MotionModel::ConstantAcceleration{density(specification, "ca", 3e8)}},
                      MotionModel{MotionModel::Singer{decay_rate(specification, 30),
                                                      density(specification, "singer", 1e11)}}};
    for (MotionModel& model : options.models) set_noise(specification, model);
    options.lead_s = specification.number("lead", 1.0 / 15, 1e-3, 0.25);
    options.score = specification.word("score", "likelihood") ? BankScore::likelihood : BankScore::distance;
    options.gate_sigmas = gate(specification);
    return std::make_unique<ModelBank>(options);
}

std::unique_ptr<Predictor> make_imm(Specification& specification) {
    MotionModel noise{MotionModel::Singer{1, 1}};
    set_noise(specification, noise);
    InteractingModels::Options options{};
    options.alpha = decay_rate(specification, 200);
    options.density = {density(specification, "q1", 1e9), density(specification, "q2", 3e10),
                       density(specification, "q3", 1e12)};
    options.switching_rate = specification.number("rate", 10, 1e-3, 1e4);
    options.measurement_variance = noise.measurement_variance;
    options.initial_variance = noise.initial_variance;
    options.gate_sigmas = gate(specification);
    return std::make_unique<InteractingModels>(options);
}

using Model = const PathModel&;

/// How slowly a network forgets what it learns while a stick moves [s].
double memory(Specification& specification) {
    return specification.number("memory", 100, 0, 1e6);
}

std::unique_ptr<Predictor> make_learned(Specification&, const Eigen::Vector3d& shaft, Model model) {
    return std::make_unique<Learned>(model, shaft);
}

std::unique_ptr<Predictor> make_online(Specification& specification, const Eigen::Vector3d& shaft,
                                       Model model) {
    return std::make_unique<Learned>(model, shaft, memory(specification));
}

/// `cv` whose velocity decays while its angular velocity does not, and which rebounds where strokes turn
/// back.
std::unique_ptr<Predictor> make_surface(Specification& specification) {
    const double q = density(specification, "q", 1e7);
    MotionModel fading = constant_velocity(q, specification.number("decay", 8, 1e-3, 1000)),
                lasting = constant_velocity(q);
    for (MotionModel* motion : {&fading, &lasting}) {
        set_noise(specification, *motion);
        if (!specification.has("r")) motion->measurement_variance = square(0.5 * kMetres);
    }
    const double sigmas = gate(specification, 5);
    return std::make_unique<Rebounding>(
        std::make_unique<KalmanPredictor>(fading, KalmanOptions{sigmas, 0, lasting}));
}

std::unique_ptr<Predictor> make_arbitrated(Specification& specification, const Eigen::Vector3d& shaft,
                                           Model model) {
    std::unique_ptr<Predictor> filter = make_surface(specification);
    return std::make_unique<Arbitrated>(std::move(filter), model, shaft, memory(specification));
}

/// One of the two makes it.
struct Entry {
    const char* name;
    std::unique_ptr<Predictor> (*make)(Specification&);
    std::unique_ptr<Predictor> (*make_of_model)(Specification&, const Eigen::Vector3d&, Model) = nullptr;
};

constexpr auto kPredictors = std::to_array<Entry>({{"hold", make_hold},
                                                   {"naive", make_naive},
                                                   {"difference", make_difference},
                                                   {"least-squares", make_least_squares},
                                                   {"double-exponential", make_double_exponential},
                                                   {"one-euro", make_one_euro},
                                                   {"thesis", make_thesis},
                                                   {"cv", make_cv},
                                                   {"ca", make_ca},
                                                   {"singer", make_singer},
                                                   {"bank", make_bank},
                                                   {"imm", make_imm},
                                                   {"surface", make_surface},
                                                   {"learned", nullptr, make_learned},
                                                   {"online", nullptr, make_online},
                                                   {"arbitrated", nullptr, make_arbitrated}});

std::vector<std::string> names_of(bool need_model) {
    std::vector<std::string> names;
    for (const Entry& entry : kPredictors)
        if ((entry.make_of_model != nullptr) == need_model) names.emplace_back(entry.name);
    return names;
}

}  // namespace

const std::vector<std::string>& predictor_names() {
    static const std::vector<std::string> names = names_of(false);
    return names;
}

const std::vector<std::string>& model_predictor_names() {
    static const std::vector<std::string> names = names_of(true);
    return names;
}

std::unique_ptr<Predictor> make_predictor(const std::string& text, const Eigen::Vector3d& shaft,
                                          const std::shared_ptr<const PathModel>& model) {
    Specification specification(text);
    std::string known;
    for (const Entry& entry : kPredictors) {
        known += std::string(known.empty() ? "" : ", ") + entry.name;
        if (specification.name() != entry.name) continue;
        if (entry.make_of_model != nullptr && model == nullptr)
            specification.fail("no model", "one of `musicworld train`");
        std::unique_ptr<Predictor> predictor = entry.make_of_model != nullptr
                                                   ? entry.make_of_model(specification, shaft, *model)
                                                   : entry.make(specification);
        specification.require_no_others();
        return predictor;
    }
    specification.fail("name " + in_quotes(specification.name()), "one of " + known);
}

PointMotion point_of(const PosePrediction& pose, const Eigen::Vector3d& point_body) noexcept {
    const Eigen::Vector3d arm = pose.orientation * point_body;
    return {pose.position + arm, pose.velocity + pose.angular_velocity.cross(arm)};
}

}  // namespace tracking
