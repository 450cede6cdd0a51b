#include <gtest/gtest.h>

#include <cmath>

#include "sim/world.h"

namespace sim {
namespace {

using Eigen::Vector3d;

const Superquadric kSphere{Vector3d::Constant(0.5), 1, 1};

Material softness(double young) {
    return {young, 0.3, 1000};
}

FidelityRequest asked(Fidelity fidelity, double error, int modes = 12) {
    FidelityRequest request;
    request.fidelity = fidelity;
    request.error = error;
    request.modes = modes;
    return request;
}

// A strike at v moves a pole by v sqrt(m c); c is proportional to 1 / E.
TEST(Fidelity, ErrorsGrowWithTheSpeedAndTheRootOfTheSoftness) {
    FidelityRequest request = asked(Fidelity::rigid, 0.01);
    const double once = choose_fidelity(kSphere, softness(1e6), request).expected_error;
    EXPECT_NEAR(choose_fidelity(kSphere, softness(1e4), request).expected_error, 10 * once, 1e-9 * once);
    request.impact_mps *= 3;
    EXPECT_NEAR(choose_fidelity(kSphere, softness(1e6), request).expected_error, 3 * once, 1e-9 * once);
}

// Uniform strains in closed form: of a sphere struck at a pole, the strain is uniaxial stress over the mean
// section: c = r^2 / (V E).
TEST(Fidelity, LinearBodyLeavesWhatUniformStrainDoesNotReach) {
    const double r = 0.5, volume = 4 * M_PI / 3 * r * r * r, mass = 1000 * volume;
    const double reached = 5 * std::sqrt(mass * r * r / (volume * 1e6)) / (2 * r);
    const double rigid = choose_fidelity(kSphere, softness(1e6), asked(Fidelity::rigid, 0)).expected_error;
    const double linear = choose_fidelity(kSphere, softness(1e6), asked(Fidelity::linear, 0)).expected_error;
    EXPECT_NEAR(rigid - linear, reached, 1e-9);
    EXPECT_GT(linear, 0);
}

TEST(Fidelity, AutomaticTakesTheCheapestThatIsGoodEnough) {
    const Material m = softness(1e6);
    const double rigid = choose_fidelity(kSphere, m, asked(Fidelity::rigid, 0)).expected_error;
    const double linear = choose_fidelity(kSphere, m, asked(Fidelity::linear, 0)).expected_error;
    const auto automatic = [&](double error) {
        return choose_fidelity(kSphere, m, asked(Fidelity::automatic, error));
    };
    EXPECT_EQ(automatic(rigid * 1.001).fidelity, Fidelity::rigid);
    EXPECT_EQ(automatic(rigid * 0.999).fidelity, Fidelity::linear);
    EXPECT_EQ(automatic(linear * 1.001).fidelity, Fidelity::linear);
    int before = 0;
    for (const double share : {0.999, 0.7, 0.5, 0.3, 0.1, 0.01}) {
        const FidelityChoice choice = automatic(share * linear);
        EXPECT_EQ(choice.fidelity, Fidelity::modal);
        EXPECT_LE(choice.expected_error, share * linear);
        EXPECT_GE(choice.modes, before);
        before = choice.modes;
        // Whole groups, and no fewer would do.
        const GroupCut cut =
            free_vibration_modes({kSphere, ModeDomain::superquadric, m, 1, choice.modes}).cut;
        EXPECT_EQ(cut.below, choice.modes);
        const FidelityChoice fewer = choose_fidelity(kSphere, m, asked(Fidelity::modal, 0, choice.modes - 1));
        EXPECT_GT(fewer.expected_error, choice.expected_error);
    }
    EXPECT_GT(automatic(0).modes, 69) << "all but some of the highest, in which the poles do not move";
    EXPECT_EQ(automatic(0).expected_error, 0);
}

TEST(Fidelity, NamedOnesAreKept) {
    for (const Fidelity named : {Fidelity::rigid, Fidelity::linear, Fidelity::modal}) {
        const FidelityChoice choice = choose_fidelity(kSphere, softness(1e3), asked(named, 1e-6));
        EXPECT_EQ(choice.fidelity, named);
        EXPECT_EQ(choice.modes, named == Fidelity::rigid ? 0 : named == Fidelity::linear ? 6 : 12);
    }
}

}  // namespace
}  // namespace sim
