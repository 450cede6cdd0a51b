// Cost of a sample: the update and the two predictions (1/30 and 1/15 s) of one stick, for each estimator,
// and for two peers that filter the same nine states the straightforward way: fixed-size Eigen matrices, and
// OpenCV's KalmanFilter where it is installed. Items are samples; with --benchmark_out the context says which
// versions ran.
#include <benchmark/benchmark.h>

#include <Eigen/Core>
#include <Eigen/LU>
#include <array>
#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "tracking/path_model.h"
#include "tracking/predictor.h"
#ifdef MUSICWORLD_OPENCV
#include <opencv2/core/version.hpp>
#include <opencv2/video/tracking.hpp>
#endif

namespace {

using tracking::PosePrediction;
using tracking::PoseSample;

constexpr double kRate = 60, kPictureLead = 1.0 / 30, kSoundLead = 1.0 / 15;

/// Strokes at 4 Hz with 0.25 mm of rough noise, stamps with 1 ms of jitter; long enough that no step repeats.
std::vector<PoseSample> strokes(bool with_orientation) {
    std::vector<PoseSample> samples(4096);
    std::uint32_t random = 1;
    const auto noise = [&] { return (random = random * 1664525U + 1013904223U) / 4294967296.0 - 0.5; };
    for (std::size_t i = 0; i < samples.size(); ++i) {
        PoseSample& s = samples[i];
        s.t_s = static_cast<double>(i) / kRate + 1e-3 * noise();
        s.position = Eigen::Vector3d(0.1 * std::sin(3 * s.t_s), 0.9 + 0.2 * std::sin(25 * s.t_s), 0.3) +
                     0.0009 * Eigen::Vector3d(noise(), noise(), noise());
        s.has_orientation = with_orientation;
        s.orientation = Eigen::Quaterniond(
            Eigen::AngleAxisd(0.8 * std::sin(25 * s.t_s) + 0.002 * noise(), Eigen::Vector3d::UnitX()));
    }
    return samples;
}

/// Feeds the strokes again and again, later each time.
template <class Step>
void run(benchmark::State& state, const std::vector<PoseSample>& samples, const Step& step) {
    const double round = static_cast<double>(samples.size()) / kRate;
    double shift = 0;
    std::size_t next = 0;
    for (auto _ : state) {
        PoseSample sample = samples[next];
        sample.t_s += shift;
        step(sample);
        if (++next == samples.size()) next = 0, shift += round;
    }
    state.SetItemsProcessed(state.iterations());
}

/// A network of that many units; what it answers is noise, what it costs is not. None of 0.
std::shared_ptr<const tracking::PathModel> network(Eigen::Index hidden) {
    if (hidden == 0) return {};
    constexpr Eigen::Index kInputs = 88, kOutputs = 65;  // others are refused
    tracking::PathModel model;
    const std::array<Eigen::Index, 4> sizes = {kInputs, hidden, hidden, kOutputs};
    std::uint32_t random = 1;
    for (std::size_t i = 0; i < model.layers.size(); ++i) {
        model.layers[i].weights.resize(sizes[i + 1], sizes[i]);
        model.layers[i].bias.setZero(sizes[i + 1]);
        for (float& weight : model.layers[i].weights.reshaped())
            weight = static_cast<float>((random = random * 1664525U + 1013904223U) / 4294967296.0 - 0.5) /
                     std::sqrt(static_cast<float>(sizes[i]));
    }
    return std::make_shared<const tracking::PathModel>(
        tracking::parse_path_model(tracking::format_path_model(model), "network"));
}

void predictor(benchmark::State& state, const std::string& specification, Eigen::Index hidden,
               bool with_orientation) {
    const auto tested = tracking::make_predictor(specification, -Eigen::Vector3d::UnitZ(), network(hidden));
    run(state, strokes(with_orientation), [&](const PoseSample& sample) {
        benchmark::DoNotOptimize(tested->correct(sample));
        PosePrediction picture = tested->predict(kPictureLead), sound = tested->predict(kSoundLead);
        benchmark::DoNotOptimize(picture);
        benchmark::DoNotOptimize(sound);
    });
}

// The peers' model: constant acceleration of density 1e3 m^2/s^5, as `ca:q=1e9`, state p, v, a of x, y, z.
constexpr double kDensity = 1e3, kVariance = 0.25e-3 * 0.25e-3;
using Matrix9 = Eigen::Matrix<double, 9, 9>;

Matrix9 transition(double dt) {
    Matrix9 f = Matrix9::Identity();
    f.block<3, 3>(0, 3) = f.block<3, 3>(3, 6) = dt * Eigen::Matrix3d::Identity();
    f.block<3, 3>(0, 6) = dt * dt / 2 * Eigen::Matrix3d::Identity();
    return f;
}

Matrix9 process_noise(double dt) {
    const double q[3][3] = {{std::pow(dt, 5) / 20, std::pow(dt, 4) / 8, dt * dt * dt / 6},
                            {std::pow(dt, 4) / 8, dt * dt * dt / 3, dt * dt / 2},
                            {dt * dt * dt / 6, dt * dt / 2, dt}};
    Matrix9 noise = Matrix9::Zero();
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j)
            noise.block<3, 3>(3 * i, 3 * j) = kDensity * q[i][j] * Eigen::Matrix3d::Identity();
    return noise;
}

/// The text-book filter of nine states with Joseph's form, in fixed-size Eigen matrices.
struct EigenFilter {
    using Matrix93 = Eigen::Matrix<double, 9, 3>;
    Eigen::Matrix<double, 9, 1> x = Eigen::Matrix<double, 9, 1>::Zero();
    Matrix9 p = Matrix9::Identity();
    Eigen::Matrix<double, 3, 9> h = Eigen::Matrix<double, 3, 9>::Identity();
    double t = 0;

    void correct(const PoseSample& sample) {
        const double dt = sample.t_s - t;
        t = sample.t_s;
        const Matrix9 f = transition(dt);
        x = (f * x).eval();
        p = (f * p * f.transpose() + process_noise(dt)).eval();
        const Eigen::Matrix3d r = kVariance * Eigen::Matrix3d::Identity();
        const Eigen::Matrix3d s = h * p * h.transpose() + r;
        const Matrix93 k = p * h.transpose() * s.inverse();
        x += k * (sample.position - h * x);
        const Matrix9 keep = Matrix9::Identity() - k * h;
        p = (keep * p * keep.transpose() + k * r * k.transpose()).eval();
    }
    [[nodiscard]] Eigen::Vector3d predict(double lead) const { return h * (transition(lead) * x); }
};

void eigen_nine_states(benchmark::State& state) {
    EigenFilter filter;
    run(state, strokes(false), [&](const PoseSample& sample) {
        filter.correct(sample);
        Eigen::Vector3d picture = filter.predict(kPictureLead), sound = filter.predict(kSoundLead);
        benchmark::DoNotOptimize(picture);
        benchmark::DoNotOptimize(sound);
    });
}

#ifdef MUSICWORLD_OPENCV
cv::Mat to_mat(const Matrix9& m) {
    cv::Mat out(9, 9, CV_64F);
    for (int i = 0; i < 9; ++i)
        for (int j = 0; j < 9; ++j) out.at<double>(i, j) = m(i, j);
    return out;
}

void opencv_nine_states(benchmark::State& state) {
    cv::KalmanFilter filter(9, 3, 0, CV_64F);
    filter.measurementMatrix = cv::Mat::eye(3, 9, CV_64F);
    filter.measurementNoiseCov = kVariance * cv::Mat::eye(3, 3, CV_64F);
    filter.errorCovPost = cv::Mat::eye(9, 9, CV_64F);
    filter.statePost = cv::Mat::zeros(9, 1, CV_64F);
    cv::Mat measured(3, 1, CV_64F);
    const cv::Mat to_picture = to_mat(transition(kPictureLead)), to_sound = to_mat(transition(kSoundLead));
    double t = 0;
    run(state, strokes(false), [&](const PoseSample& sample) {
        filter.transitionMatrix = to_mat(transition(sample.t_s - t));
        filter.processNoiseCov = to_mat(process_noise(sample.t_s - t));
        t = sample.t_s;
        for (int i = 0; i < 3; ++i) measured.at<double>(i) = sample.position[i];
        filter.predict();
        filter.correct(measured);
        cv::Mat picture = to_picture * filter.statePost, sound = to_sound * filter.statePost;
        benchmark::DoNotOptimize(picture.data);
        benchmark::DoNotOptimize(sound.data);
    });
}
#endif

void add(const std::string& name, const std::string& specification, Eigen::Index hidden) {
    for (const bool with_orientation : {false, true})
        benchmark::RegisterBenchmark((name + (with_orientation ? "/pose" : "/position")).c_str(), predictor,
                                     specification, hidden, with_orientation);
}

}  // namespace

int main(int argc, char** argv) {
    for (const std::string& name : tracking::predictor_names()) {
        if (name == "auto") continue;
        add(name, name, 0);
    }
    for (const std::string& name : tracking::model_predictor_names())
        for (const Eigen::Index hidden : {32, 64, 128})
            add(name + "/" + std::to_string(hidden) + "_units", name, hidden);
    add("ca:gate=5", "ca:gate=5", 0);
    add("ca:steady=60", "ca:steady=60", 0);
    benchmark::RegisterBenchmark("peer_eigen_nine_states/position", eigen_nine_states);
    benchmark::AddCustomContext("eigen", std::to_string(EIGEN_WORLD_VERSION) + "." +
                                             std::to_string(EIGEN_MAJOR_VERSION) + "." +
                                             std::to_string(EIGEN_MINOR_VERSION));
#ifdef MUSICWORLD_OPENCV
    benchmark::RegisterBenchmark("peer_opencv_nine_states/position", opencv_nine_states);
    benchmark::AddCustomContext("opencv", CV_VERSION);
#endif
    benchmark::Initialize(&argc, argv);
    if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 2;
    benchmark::RunSpecifiedBenchmarks();
    benchmark::Shutdown();
    return 0;
}
