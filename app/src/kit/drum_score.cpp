#include "kit/drum_score.h"

#include <fmt/format.h>
#include <sim/simulation.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string_view>

#include "files/bad_input.h"

namespace app {
namespace {

/// An upright bell is struck on its side; a bar lies flat and is struck from above.
bool struck_on_side(const Instrument& instrument) {
    const Eigen::Vector3d& half = instrument.body.shape.semi_axes;
    return instrument.kind == "bell" && half.y() > 0.5 * half.x();
}

/// A point of an instrument's surface at rest, grown by the tip's radius, and the outward unit normal there.
/// World frame [m].
struct StrikeTarget {
    Eigen::Vector3d point, normal;
};

/// Where a player strikes: from above, upright bells from the player's side (body +z, a little above).
/// `across` and `along` shift the place from the middle of that side, as shares (below 1) of the half extents
/// to the body's right (x) and away from its front (-z, for bells up).
StrikeTarget strike_target(const Instrument& instrument, double tip_radius_m, double across, double along) {
    const sim::BodyDefinition& body = instrument.body;
    const Eigen::Vector3d& half = body.shape.semi_axes;
    const bool side = struck_on_side(instrument);
    const Eigen::Vector3d inside_body = side ? Eigen::Vector3d(across * half.x(), along * half.y(), 0)
                                             : Eigen::Vector3d(across * half.x(), 0, -along * half.z());
    const Eigen::Vector3d outwards_body =
        side ? Eigen::Vector3d(0, 0.4, 1).normalized() : Eigen::Vector3d::UnitY();
    Eigen::Vector3d inside = body.world_from_body * inside_body;
    Eigen::Vector3d outside =
        inside + body.world_from_body.linear() * outwards_body * (2 * half.norm() + tip_radius_m + 0.1);
    // Halves points, not a parameter as entry_between() does: the bundled traces keep their last digits.
    constexpr int kHalvings = 60;
    for (int i = 0; i < kHalvings; ++i) {
        const Eigen::Vector3d middle = 0.5 * (inside + outside);
        (sim::rest_distance(body, middle, tip_radius_m).distance > 0 ? outside : inside) = middle;
    }
    return {outside, sim::rest_distance(body, outside, tip_radius_m).normal.normalized()};
}

/// The parts that scores are written for: the bundled drums.
enum Part { snare, hi_hat, tom_1, tom_2, floor_tom, bass_drum, crash, ride };
constexpr std::array<std::string_view, 8> kParts = {"snare",     "hi-hat",    "tom 1", "tom 2",
                                                    "floor tom", "bass drum", "crash", "ride"};

enum Hand { left, right };

constexpr double kLooseS = 0.004;

/// Writes strokes onto a kit.
class Writer {
public:
    /// Strokes come up to `looseness_s` early or late, as human ones do; the loudest are on time.
    Writer(const Kit& kit, double looseness_s) : kit_(kit), looseness_s_(looseness_s) {}

    /// A hit `at` seconds. Each hand has its own place on an instrument, a hand's width from the other's.
    tracking::Stroke& hit(double at, Hand hand, Part part, double speed) {
        const Instrument& instrument = instrument_of(part);
        const bool disc = instrument.kind == "cymbal";
        const double across = (hand == left ? -1 : 1) * (disc ? 0.3 : 0.28);
        const StrikeTarget target =
            strike_target(instrument, kit_.stick.radius_m, across, disc ? -0.5 : -0.1);
        tracking::Stroke stroke;
        stroke.t_s = at + (speed > kOnTimeMps ? 0 : looseness_s_ * next_deviation());
        stroke.stick = hand == left ? "left" : "right";
        stroke.target = target.point;
        stroke.normal = target.normal;
        stroke.speed_mps = speed;
        strokes_.push_back(stroke);
        return strokes_.back();
    }

    /// A feint that would have struck at `speed`, and turns `height` metres above the surface `at` seconds.
    void feint(double at, Hand hand, Part part, double speed, double height) {
        tracking::Stroke& stroke = hit(at, hand, part, speed);
        stroke.kind = tracking::StrokeKind::feint;
        stroke.turn_height_m = height;
    }

    [[nodiscard]] DrumScore finish(double duration_s) { return {std::move(strokes_), duration_s}; }

private:
    /// In [-1, 1], the same for every run.
    double next_deviation() {
        count_ += 7;
        return static_cast<double>(count_ % 17) / 8 - 1;
    }

    [[nodiscard]] const Instrument& instrument_of(Part part) const {
        for (const Instrument& instrument : kit_.instruments)
            if (instrument.name == kParts[part]) return instrument;
        return kit_.instruments[part % kit_.instruments.size()];
    }

    static constexpr double kOnTimeMps = 6.6;

    const Kit& kit_;
    double looseness_s_;
    int count_ = 0;
    std::vector<tracking::Stroke> strokes_;
};

/// Two bars of eighths at 120 a minute from `begin`: right hand on the ride, left hand on hi-hat and snare.
void groove(Writer& write, double begin) {
    constexpr double eighth = 0.25;
    for (int i = 0; i < 16; ++i) {
        const double at = begin + i * eighth;
        const bool bass = i == 0 || i == 8;
        write.hit(at, right, bass ? bass_drum : ride, bass ? 5.5 : i % 2 == 0 ? 3.5 : 2.4);
        if (i % 4 == 2) write.hit(at, left, snare, 5.0);
        if (i % 4 == 0) write.hit(at, left, hi_hat, 3.0);
        if (i == 7 || i == 15) write.hit(at, left, snare, 2.2);
    }
}

/// Alternating strokes `step` seconds apart, right hand first, growing louder; each part in turn gets `each`
/// strokes.
void fill(Writer& write, double begin, double step, const std::vector<Part>& parts, int each, double soft,
          double loud) {
    const int count = static_cast<int>(parts.size()) * each;
    for (int i = 0; i < count; ++i) {
        const double growing = soft + (loud - soft) * i / (count - 1);
        const double accent = i % each == 0 ? 1.0 : 0.8;
        write.hit(begin + i * step, i % 2 == 0 ? right : left, parts[static_cast<std::size_t>(i / each)],
                  growing * accent);
    }
}

DrumScore flourish(const Kit& kit) {
    constexpr double start = 0.5, bar = 2.0;
    Writer write(kit, kLooseS);
    groove(write, start);
    fill(write, start + 2 * bar, 0.125, {snare, tom_1, tom_2, floor_tom}, 4, 3.0, 6.5);
    fill(write, start + 3 * bar, 1.0 / 12, {snare, tom_1, tom_2, floor_tom}, 4, 3.0, 6.0);
    fill(write, start + 3 * bar + 16.0 / 12, 1.0 / 12, {tom_2, snare}, 4, 4.0, 6.5);
    write.hit(start + 4 * bar, right, ride, 5.0);
    write.hit(start + 4 * bar + 0.25, right, floor_tom, 6.0);
    write.hit(start + 4 * bar + 0.25, left, snare, 6.0);
    write.hit(start + 4 * bar + 0.75, right, crash, 8.0);
    write.hit(start + 4 * bar + 0.75, left, crash, 8.0);
    return write.finish(10);
}

DrumScore feints(const Kit& kit) {
    // h: hit, e: feint that turns early, high above the head, l: late, close to it.
    constexpr std::string_view kPlan = "hehlhehhelehhelhehlehhelhehhlehelhhelhhh";
    constexpr std::array<Part, 4> kRound = {snare, tom_1, tom_2, floor_tom};
    constexpr double kStep = 0.23, kStart = 0.6;
    Writer write(kit, kLooseS);
    int early = 0, late = 0;
    for (std::size_t i = 0; i < kPlan.size(); ++i) {
        const double at = kStart + kStep * static_cast<double>(i);
        const Hand hand = i % 2 == 0 ? right : left;
        const Part part = kRound[(i / 3) % kRound.size()];
        const double speed = 2.5 + 0.5 * static_cast<double>(i * 7 % 6);
        if (kPlan[i] == 'h') write.hit(at, hand, part, speed);
        if (kPlan[i] == 'e')
            write.feint(at, hand, part, 2.5 + 0.25 * (early % 3), 0.13 + 0.01 * (early % 4)), ++early;
        if (kPlan[i] == 'l') write.feint(at, hand, part, speed, 0.010 + 0.003 * (late % 4)), ++late;
    }
    return write.finish(10);
}

DrumScore roll(const Kit& kit) {
    Writer write(kit, 0);
    double at = 0.5;
    for (int i = 0; at < 4.5; ++i) {  // 6 to 8 Hz a hand
        write.hit(at, i % 2 == 0 ? right : left, snare, i % 8 == 0 ? 4.0 : 3.0);
        at += 0.5 / (6 + 2 * (at - 0.5) / 4);
    }
    constexpr double kFast = 1.0 / 15;
    for (int i = 0; i < 30; ++i) write.hit(4.7 + i * kFast, i % 2 == 0 ? right : left, snare, 2.5);
    for (int i = 0; i < 24; ++i) write.hit(7.1 + i * kFast, right, snare, 1.5);
    write.hit(9.1, right, snare, 5.0);
    write.hit(9.13, left, snare, 4.0);
    return write.finish(10);
}

/// How deep hits go. A hit of 6.5 m/s that goes 16 mm deep lasts 10 ms, longer than the 8.3 ms between
/// samples at 120 Hz, so that the sampled path shows every contact; no hit goes through a body thinner than
/// that.
double hit_depth(const Kit& kit) {
    constexpr double kDeepest = 0.016, kShare = 1.6;
    double depth = kDeepest;
    for (const Instrument& instrument : kit.instruments)
        depth = std::min(depth, kShare * (instrument.body.shape.semi_axes.minCoeff() + kit.stick.radius_m));
    return depth;
}

double rounded(double value, double unit_inverse) {
    return std::round(value * unit_inverse) / unit_inverse;
}

void round_samples(tracking::Trace& trace) {
    constexpr double kPerUnit = 1e6;
    for (tracking::StickTrace& stick : trace.sticks)
        for (tracking::PoseSample& sample : stick.samples) {
            for (double& x : sample.position) x = rounded(x, kPerUnit);
            for (double& x : sample.orientation.coeffs()) x = rounded(x, kPerUnit);
        }
}

}  // namespace

const std::vector<std::string>& score_names() {
    static const std::vector<std::string> names = {"flourish", "feints", "roll"};
    return names;
}

DrumScore make_score(const std::string& name, const Kit& kit) {
    constexpr std::array<DrumScore (*)(const Kit&), 3> kScores = {flourish, feints, roll};
    const auto at = std::ranges::find(score_names(), name) - score_names().begin();
    if (at < std::ssize(kScores)) return kScores[static_cast<std::size_t>(at)](kit);
    throw BadInput(
        fmt::format("error: found score \"{}\", expected one of {}", name, fmt::join(score_names(), ", ")));
}

tracking::Trace synthesise_score(const std::string& name, const Kit& kit, const SyntheticSensor& sensor) {
    const DrumScore score = make_score(name, kit);
    tracking::DrummerParameters drummer;
    drummer.rate_hz = sensor.rate_hz;
    drummer.seed = sensor.seed;
    drummer.stick_length_m = kit.stick.length_m;
    drummer.depth_m = hit_depth(kit);
    drummer.noise_m = 1e-3 * sensor.noise_mm;
    drummer.noise_rad = 0.004 * sensor.noise_mm;
    tracking::Trace trace = tracking::synthesise(score.strokes, score.duration_s, drummer);
    round_samples(trace);
    trace.source = fmt::format("{}; score {} on kit {}, {} Hz, noise {} mm", trace.source, name, kit.name,
                               sensor.rate_hz, sensor.noise_mm);
    return trace;
}

}  // namespace app
