#include "tracking/drummer.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <stdexcept>

#include "drummer/tip_path.h"
#include "trace/parameter_check.h"
#include "trace/random_stream.h"
#include "trace/text_cursor.h"
#include "tracking/rotation.h"

namespace tracking {
namespace {

constexpr double kClosest = 0.030;  // s between two strokes of a stick
const Eigen::Vector3d kTipAxis(0, 0, -1);

constexpr ParameterCheck kDrummer{"drummer"};

void check(const DrummerParameters& p, double duration_s) {
    kDrummer.require_within(p.rate_hz, 1, 1e5, "rate_hz");
    kDrummer.require_within(duration_s, 1 / p.rate_hz, 36000, "duration");
    kDrummer.require_within(p.stick_length_m, 0.05, 2, "stick_length_m");
    kDrummer.require_within(p.rise_m, 0.01, 0.9 * p.stick_length_m, "rise_m");
    kDrummer.require_within(p.restitution, 0.05, 1, "restitution");
    kDrummer.require_within(p.depth_m, 1e-4, 0.05, "depth_m");
    kDrummer.require_within(p.noise_m, 0, 1, "noise_m");
    kDrummer.require_within(p.noise_rad, 0, 1, "noise_rad");
}

void check(const Stroke& stroke, double duration_s, const DrummerParameters& p) {
    const bool word = !stroke.stick.empty() && stroke.stick.find_first_of(" \t,\"'") == std::string::npos &&
                      first_unprintable(stroke.stick) == std::string::npos;
    kDrummer.require(word, "stick name " + in_quotes(stroke.stick), "a word");
    kDrummer.require_within(stroke.t_s, 0, duration_s, "stroke time");
    kDrummer.require(stroke.target.allFinite() && stroke.target.norm() <= 100, "a target far away",
                     "one within 100 m");
    kDrummer.require(std::abs(stroke.normal.norm() - 1) < 1e-6,
                     "a normal of length " + std::to_string(stroke.normal.norm()), "length 1");
    kDrummer.require_within(stroke.speed_mps, 0.2, 25, "stroke speed");
    if (stroke.kind == StrokeKind::feint)
        kDrummer.require_within(stroke.turn_height_m, 0.001, 0.9 * p.stick_length_m - p.rise_m / 2,
                                "turn_height_m");
}

std::map<std::string, std::vector<Stroke>> by_stick(const std::vector<Stroke>& score) {
    std::map<std::string, std::vector<Stroke>> sticks;
    for (const Stroke& stroke : score) sticks[stroke.stick].push_back(stroke);
    for (auto& [name, strokes] : sticks) {
        std::stable_sort(strokes.begin(), strokes.end(),
                         [](const Stroke& a, const Stroke& b) { return a.t_s < b.t_s; });
        for (std::size_t i = 1; i < strokes.size(); ++i)
            kDrummer.require(strokes[i].t_s - strokes[i - 1].t_s >= kClosest,
                             "strokes of stick '" + name + "' at " + std::to_string(strokes[i - 1].t_s) +
                                 " and " + std::to_string(strokes[i].t_s) + " s",
                             "at least 30 ms between a stick's strokes");
    }
    return sticks;
}

/// The hand stays behind (+z) and slightly above the foot of the tip, a stick's length away; the stick turns
/// about it. What the turn changes in the distance the hand makes up along the stick, so that the tip is
/// exactly where it should be.
PoseSample pose_at(const TipPath& path, double t, double length) {
    const Eigen::Vector3d behind = Eigen::Vector3d(0, 0.25, 1).normalized();
    const Eigen::Vector3d tip = path.at(t);
    const Eigen::Vector3d to_hand = path.foot_at(t) + length * behind - tip;
    kDrummer.require(to_hand.norm() > 0.05 * length,
                     "a tip that meets the hand at " + std::to_string(t) + " s",
                     "a lower rise or a longer stick");
    const Eigen::Vector3d back = to_hand.normalized();
    PoseSample sample;
    sample.t_s = t;
    sample.position = tip + length * back;
    sample.orientation = rotation_between(kTipAxis, -back).normalized();
    sample.has_orientation = true;
    return sample;
}

StickTrace play(const std::string& name, const TipPath& path, double duration_s,
                const DrummerParameters& parameters, RandomStream& noise) {
    StickTrace trace{name, {}};
    const auto count =
        static_cast<std::size_t>(std::floor(duration_s * parameters.rate_hz * (1 + 1e-12))) + 1;
    trace.samples.reserve(count);
    for (std::size_t k = 0; k < count; ++k) {
        PoseSample sample =
            pose_at(path, static_cast<double>(k) / parameters.rate_hz, parameters.stick_length_m);
        sample.position += noise.normal_vector(parameters.noise_m);
        const Eigen::Vector3d turn = noise.normal_vector(parameters.noise_rad);
        sample.orientation = (exponential(turn) * sample.orientation).normalized();
        trace.samples.push_back(sample);
    }
    return trace;
}

}  // namespace

Trace synthesise(const std::vector<Stroke>& score, double duration_s, const DrummerParameters& parameters) {
    check(parameters, duration_s);
    kDrummer.require(!score.empty(), "an empty score", "at least one stroke");
    for (const Stroke& stroke : score) check(stroke, duration_s, parameters);
    Trace trace;
    trace.rate_hz = parameters.rate_hz;
    trace.tip = parameters.stick_length_m * kTipAxis;
    trace.shaft = kTipAxis;
    RandomStream noise(parameters.seed);
    int lowered = 0;
    for (const auto& [name, strokes] : by_stick(score)) {
        const TipPath path(strokes, parameters);
        lowered += path.lowered();
        trace.sticks.push_back(play(name, path, duration_s, parameters, noise));
    }
    trace.file = "synthetic";
    trace.source = "synthetic: drummer model, " + std::to_string(score.size()) + " strokes, " +
                   std::to_string(lowered) + " with less rise for lack of time, seed " +
                   std::to_string(parameters.seed);
    return trace;
}

}  // namespace tracking
