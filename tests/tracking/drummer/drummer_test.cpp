#include "tracking/drummer.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "drummer/tip_path.h"

namespace tracking {
namespace {

using Eigen::Vector3d;

Stroke stroke(double t, const std::string& stick, const Vector3d& target, double speed) {
    Stroke one;
    one.t_s = t;
    one.stick = stick;
    one.target = target;
    one.speed_mps = speed;
    return one;
}

DrummerParameters noise_free(double rate) {
    DrummerParameters parameters;
    parameters.rate_hz = rate;
    parameters.noise_m = 0;
    parameters.noise_rad = 0;
    return parameters;
}

std::vector<double> heights(const StickTrace& stick, const Trace& trace, const Vector3d& target,
                            const Vector3d& normal) {
    std::vector<double> all;
    for (const PoseSample& sample : stick.samples)
        all.push_back((sample.position + sample.orientation * trace.tip.value() - target).dot(normal));
    return all;
}

/// Two hands over three slanted surfaces: hits of 1 to 8 m/s, every fourth a feint.
std::vector<Stroke> varied_score() {
    std::vector<Stroke> score;
    for (int i = 0; i < 40; ++i) {
        Stroke one = stroke(0.4 + 0.21 * i, i % 2 == 0 ? "left" : "right",
                            {0.25 * (i % 3) - 0.25, 0.7 + 0.1 * (i % 3), -0.4}, 1 + i % 8);
        one.normal = Vector3d(0.1 * (i % 3), 1, 0.3).normalized();
        if (i % 4 == 3) one.kind = StrokeKind::feint;
        score.push_back(one);
    }
    std::reverse(score.begin(), score.end());  // any order is allowed
    return score;
}

TEST(Drummer, NoiseFreeContactsHaveTheScoresSpeedsAndTheirDwellBeforeTheLowestPoint) {
    constexpr double kRate = 20000;
    for (const double speed : {0.5, 2.0, 4.0, 10.0}) {
        const Trace trace = synthesise({stroke(1, "a", {0.1, 0.7, -0.3}, speed)}, 2, noise_free(kRate));
        const std::vector<double> h = heights(trace.sticks[0], trace, {0.1, 0.7, -0.3}, Vector3d::UnitY());
        const std::size_t below = static_cast<std::size_t>(
            std::find_if(h.begin(), h.end(), [](double x) { return x < 0; }) - h.begin());
        const double fraction = h[below - 1] / (h[below - 1] - h[below]);
        const double contact = (static_cast<double>(below) - 1 + fraction) / kRate;
        const double dwell = std::numbers::pi / 2 * 0.006 / speed;
        EXPECT_NEAR(contact, 1 - dwell, 0.1 / kRate) << speed;  // interpolation inside one sample
        EXPECT_NEAR((h[below - 2] - h[below - 1]) * kRate, speed, 0.01 * speed)
            << speed;  // difference over one sample
        const auto lowest = std::min_element(h.begin(), h.end());
        EXPECT_NEAR(static_cast<double>(lowest - h.begin()) / kRate, 1, 1 / kRate) << speed;
        EXPECT_NEAR(*lowest, -0.006, 1e-6) << speed;  // a sample lies at t = 1
        const auto above = std::find_if(lowest, h.end(), [](double x) { return x > 0; });
        EXPECT_NEAR((*(above + 1) - *above) * kRate, 0.6 * speed, 0.02 * speed) << speed;
    }
}

TEST(Drummer, TipIsAStickLengthFromTheHandAlongMinusZTo1e12AndOrientationsAreUnit) {
    const DrummerParameters parameters = noise_free(240);
    const Trace trace = synthesise(varied_score(), 9.5, parameters);
    EXPECT_EQ(trace.tip.value(), Vector3d(0, 0, -parameters.stick_length_m));
    EXPECT_EQ(trace.shaft.value(), Vector3d(0, 0, -1));
    EXPECT_EQ(trace.rate_hz, 240);
    EXPECT_TRUE(trace.source.starts_with("synthetic: "));
    std::vector<Stroke> left;
    for (const Stroke& one : varied_score())
        if (one.stick == "left") left.insert(left.begin(), one);
    const TipPath path(left, parameters);
    for (const PoseSample& sample : trace.sticks[0].samples) {
        EXPECT_NEAR((path.at(sample.t_s) - sample.position).norm(), parameters.stick_length_m, 1e-12);
        EXPECT_LT((sample.position + sample.orientation * trace.tip.value() - path.at(sample.t_s)).norm(),
                  1e-12);
        EXPECT_NEAR(sample.orientation.norm(), 1, 1e-12);
    }
}

TEST(Drummer, TheHandMovesLessThanAFifthOfTheTipsWay) {
    const Trace trace =
        synthesise({stroke(1, "a", {0, 0.7, 0}, 4), stroke(1.5, "a", {0, 0.7, 0}, 4)}, 2, noise_free(240));
    double hand = 0, tip = 0;
    const auto& samples = trace.sticks[0].samples;
    const auto tip_of = [&](const PoseSample& s) {
        return Vector3d(s.position + s.orientation * trace.tip.value());
    };
    for (std::size_t i = 1; i < samples.size(); ++i) {
        hand += (samples[i].position - samples[i - 1].position).norm();
        tip += (tip_of(samples[i]) - tip_of(samples[i - 1])).norm();
    }
    EXPECT_LT(hand, 0.2 * tip);
    EXPECT_GT((samples[0].position - tip_of(samples[0])).z(), 0.3);  // the hand is behind the tip
}

TEST(Drummer, FeintsReachTheirTurnAndNeverComeCloser) {
    for (const double speed : {0.5, 2.0, 4.0, 8.0, 12.0})
        for (const double turn : {0.01, 0.03, 0.1}) {
            Stroke feint = stroke(0.6, "a", {0, 0.7, 0}, speed);
            feint.kind = StrokeKind::feint;
            feint.turn_height_m = turn;
            Stroke second = feint;
            second.t_s = 0.75;
            const Trace trace = synthesise({feint, second}, 1.5, noise_free(10000));
            const std::vector<double> h = heights(trace.sticks[0], trace, feint.target, feint.normal);
            EXPECT_GE(*std::min_element(h.begin(), h.end()), turn - 1e-12) << speed << " " << turn;
            EXPECT_NEAR(h[6000], turn, 1e-9) << speed << " " << turn;
            EXPECT_NEAR(h[7500], turn, 1e-9) << speed << " " << turn;
        }
}

TEST(Drummer, AFeintIsTheUnfeintedStrokeUntilItBrakes) {
    Stroke hit = stroke(1, "a", {0, 0.7, 0}, 4);
    Stroke feint = hit;
    feint.kind = StrokeKind::feint;
    const std::vector<double> a = [&] {
        const Trace t = synthesise({hit}, 1.2, noise_free(10000));
        return heights(t.sticks[0], t, hit.target, hit.normal);
    }();
    const std::vector<double> b = [&] {
        const Trace t = synthesise({feint}, 1.2, noise_free(10000));
        return heights(t.sticks[0], t, hit.target, hit.normal);
    }();
    // Lined up by the time at which each first falls below 0.15 m after its apex, the paths agree down to
    // 0.07 m: a feint of 4 m/s that brakes at 500 m/s^2 leaves the stroke at some 50 mm.
    const auto falls = [](const std::vector<double>& h) {
        std::size_t i = static_cast<std::size_t>(std::max_element(h.begin(), h.end()) - h.begin());
        while (h[i] > 0.15) ++i;
        return i;
    };
    const std::size_t i = falls(a), j = falls(b);
    for (std::size_t k = 0; a[i + k] > 0.07; ++k)
        EXPECT_NEAR(a[i + k], b[j + k], 1e-3);  // up to one sample of shift
}

/// Largest acceleration of the tip outside contact, by second differences.
double strongest_outside_contact(const TipPath& path, double begin, double end,
                                 const std::vector<Stroke>& strokes) {
    constexpr double kStep = 1e-4;
    double strongest = 0;
    for (double t = begin; t < end; t += kStep) {
        double nearest = 1;
        for (const Stroke& one : strokes)
            if (one.kind == StrokeKind::hit)
                nearest = std::min(nearest, (one.speed_mps < 3 ? 0.1 : 1.0) * std::abs(t - one.t_s));
        if (nearest < 0.012) continue;
        strongest = std::max(
            strongest, (path.at(t + kStep) - 2 * path.at(t) + path.at(t - kStep)).norm() / (kStep * kStep));
    }
    return strongest;
}

TEST(Drummer, TheTipsPathIsC1WithLessThan2000MetresPerSecondSquaredOutsideContact) {
    for (const char* name : {"left", "right"}) {
        std::vector<Stroke> strokes;
        for (const Stroke& one : varied_score())
            if (one.stick == name) strokes.insert(strokes.begin(), one);
        const TipPath path(strokes, noise_free(240));
        // Within one step a jump of the velocity would show as jump/step: 0.2 m/s is 2000 m/s^2.
        EXPECT_LT(strongest_outside_contact(path, 0, 9.5, strokes), TipPath::kStrongest) << name;
        // Over all, contact included, the velocity is continuous: the strongest is speed^2/depth at contact.
        double jump = 0;
        for (double t = 0; t < 9.5; t += 1e-5)
            jump = std::max(jump, (path.at(t + 1e-5) - 2 * path.at(t) + path.at(t - 1e-5)).norm() / 1e-5);
        EXPECT_LT(jump, 1.2e-5 * 8 * 8 / 0.006) << name;
    }
}

TEST(Drummer, RollsOf8And15HertzAHandLowerTheRiseAndKeepEveryHit) {
    for (const double rate : {8.0, 15.0}) {
        std::vector<Stroke> score;
        for (int i = 0; i < 30; ++i) score.push_back(stroke(0.5 + i / rate, "a", {0, 0.7, 0}, 3));
        const Trace trace = synthesise(score, 5, noise_free(4000));
        const std::vector<double> h = heights(trace.sticks[0], trace, score[0].target, score[0].normal);
        int entries = 0;
        double top = 0;
        for (std::size_t i = 2001; i + 1 < h.size() && static_cast<double>(i) < 4000 * (0.5 + 29 / rate);
             ++i) {
            entries += h[i - 1] >= 0 && h[i] < 0 ? 1 : 0;
            if (static_cast<double>(i) > 4000 * 0.51) top = std::max(top, h[i]);
        }
        EXPECT_EQ(entries, 29);
        EXPECT_GT(top, 0.02) << rate;
        EXPECT_LT(top, 1.0 / rate)
            << rate;  // up and down again at up to 3 m/s within a period, less half for turning
        EXPECT_NE(trace.source.find("29 with less rise"), std::string::npos) << trace.source;
    }
}

TEST(Drummer, IsAFunctionOfTheSeedAndItsNoiseHasTheStatedSize) {
    DrummerParameters parameters;
    const std::string first = format_trace(synthesise(varied_score(), 9.5, parameters));
    EXPECT_EQ(first, format_trace(synthesise(varied_score(), 9.5, parameters)));
    parameters.seed = 2;
    EXPECT_NE(first, format_trace(synthesise(varied_score(), 9.5, parameters)));

    parameters.rate_hz = 1000;
    const Trace noisy = synthesise(varied_score(), 9.5, parameters);
    const Trace clean = synthesise(varied_score(), 9.5, noise_free(1000));
    double position = 0, turn = 0, n = 0;
    for (std::size_t s = 0; s < 2; ++s)
        for (std::size_t i = 0; i < noisy.sticks[s].samples.size(); ++i, ++n) {
            const PoseSample& a = noisy.sticks[s].samples[i];
            const PoseSample& b = clean.sticks[s].samples[i];
            position += (a.position - b.position).squaredNorm() / 3;
            turn += std::pow(a.orientation.angularDistance(b.orientation), 2) / 3;
        }
    // 57000 deviates: their standard deviation is known to 0.3 %; five times that is allowed.
    EXPECT_NEAR(std::sqrt(position / n) / parameters.noise_m, 1, 0.015);
    EXPECT_NEAR(std::sqrt(turn / n) / parameters.noise_rad, 1, 0.015);
}

TEST(Drummer, ItsTraceIsReadBackAsWritten) {
    const std::string text = format_trace(synthesise(varied_score(), 9.5, {}));
    EXPECT_EQ(format_trace(parse_trace(text, "a.csv")), text);
}

TEST(Drummer, RefusesImpossibleScores) {
    const auto refused = [](const std::vector<Stroke>& score, double duration = 2,
                            DrummerParameters parameters = {}) {
        try {
            (void)synthesise(score, duration, parameters);
            return false;
        } catch (const std::invalid_argument& error) {
            return std::string(error.what()).find("expected") != std::string::npos;
        }
    };
    const Stroke one = stroke(1, "a", {0, 0.7, 0}, 4);
    EXPECT_FALSE(refused({one}));
    EXPECT_TRUE(refused({}));
    EXPECT_TRUE(refused({one, stroke(1.029, "a", {0, 0.7, 0}, 4)}));
    EXPECT_FALSE(refused({one, stroke(1.031, "a", {0, 0.7, 0}, 4)}));
    EXPECT_FALSE(refused({one, stroke(1.029, "b", {0, 0.7, 0}, 4)}));
    EXPECT_TRUE(refused({one, stroke(1.05, "a", {0.6, 0.7, 0}, 4)}));  // 0.6 m in 50 ms
    EXPECT_TRUE(refused({one}, 0.5));
    EXPECT_TRUE(refused({stroke(1, "a b", {0, 0.7, 0}, 4)}));
    EXPECT_TRUE(refused({stroke(1, "a", {0, NAN, 0}, 4)}));
    EXPECT_TRUE(refused({stroke(1, "a", {0, 0.7, 0}, 0.1)}));
    Stroke slanted = one;
    slanted.normal = {0, 2, 0};
    EXPECT_TRUE(refused({slanted}));
    DrummerParameters parameters;
    parameters.restitution = 0;
    EXPECT_TRUE(refused({one}, 2, parameters));
}

}  // namespace
}  // namespace tracking
