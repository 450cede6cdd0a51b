// Contacts of recorded and predicted paths that are known in closed form.
#include "strikes/true_contacts.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "written_kit.h"

namespace app {
namespace {

using Height = std::function<double(double)>;  // of the tip [m] at a time [s]

TipTrack track_of(const Height& height, double first_s, double last_s, double interval_s) {
    TipTrack track;
    for (int i = 0; first_s + i * interval_s <= last_s; ++i) {
        track.t_s.push_back(first_s + i * interval_s);
        track.tip.emplace_back(0, height(track.t_s.back()), 0);
    }
    return track;
}

constexpr double kIntervalS = 1.0 / 120, kFallMps = 5.4, kReboundMps = 2.5;

/// Falls at 5.4 m/s through 0 at 1 ms, down to -16 mm, and rises at 2.5 m/s. Samples at multiples of 1/120 s see
/// the fall until 0, 5.4 mm above, and then the rebound, still inside: -5.1 mm at 8.3 ms.
double rebounding(double t) {
    constexpr double kContactS = 0.001, kDepthM = 0.016, kTurnS = kContactS + kDepthM / kFallMps;
    return t < kTurnS ? kFallMps * (kContactS - t) : -kDepthM + kReboundMps * (t - kTurnS);
}

TEST(TrueContacts, TheSpeedIsThatOfTheLastPieceBeforeTheContactAlsoIfTheReboundLiesInTheNext) {
    const TipTrack track = track_of(rebounding, -0.1, 0.1, kIntervalS);
    const double across = (track.tip[12].y() - track.tip[13].y()) / kIntervalS;
    ASSERT_NEAR(across, 1.26, 0.05) << "the piece that holds the rebound is much slower";
    const std::vector<TrueContact> on_plane = find_plane_contacts(track, 0);
    ASSERT_EQ(on_plane.size(), 1U);
    EXPECT_NEAR(on_plane[0].speed_mps, kFallMps, 1e-9);

    const Kit kit = WrittenKit(kFlatDrum).read();
    const double radius = kit.stick.radius_m;
    const TipTrack lifted = track_of([&](double t) { return rebounding(t) + radius; }, -0.1, 0.1, kIntervalS);
    const std::vector<TrueContact> on_drum =
        find_true_contacts(std::span(&lifted, 1), std::span(&kit.instruments[0].body, 1), radius);
    ASSERT_EQ(on_drum.size(), 1U);
    EXPECT_NEAR(on_drum[0].speed_mps, kFallMps, 1e-3) << "the head bulges by less than 0.1 mm";
}

TEST(TrueContacts, WithoutAPieceBeforeItTheSpeedIsThatOfThePieceThatEnters) {
    const auto fall = [](double t) { return 0.01 - 2 * t; };
    EXPECT_NEAR(find_plane_contacts(track_of(fall, 0, 0.05, 0.01), 0).at(0).speed_mps, 2, 1e-9);
    // After a gap the path begins anew.
    TipTrack track = track_of([](double) { return 0.5; }, -1, -0.9, 0.01);
    const TipTrack after = track_of(fall, 0, 0.05, 0.01);
    track.t_s.insert(track.t_s.end(), after.t_s.begin(), after.t_s.end());
    track.tip.insert(track.tip.end(), after.tip.begin(), after.tip.end());
    EXPECT_NEAR(find_plane_contacts(track, 0).at(0).speed_mps, 2, 1e-9);
}

TEST(TrueContacts, OfAStrokeThatStillAcceleratesTheSpeedIsThatOfThePieceThatEnters) {
    // 60 m/s^2 from rest at 0: 0.3 m/s on average from 0 to 10 ms, 0.9 m/s to 20 ms, where it goes in.
    const TipTrack track = track_of([](double t) { return 0.01 - 30 * t * std::abs(t); }, 0, 0.05, 0.01);
    EXPECT_NEAR(find_plane_contacts(track, 0).at(0).speed_mps, 0.9, 1e-9);
}

TEST(TrueContacts, TheTimeIsThatOfTheStraightPathBetweenTheSamples) {
    const TipTrack track = track_of([](double t) { return 0.3 - 3 * t; }, 0.001, 0.2, kIntervalS);
    const std::vector<TrueContact> contacts = find_plane_contacts(track, 0.1);
    ASSERT_EQ(contacts.size(), 1U);
    EXPECT_NEAR(contacts[0].t_s, 0.2 / 3, 1e-12);
    EXPECT_NEAR(contacts[0].point_world.y(), 0.1, 1e-12);
}

/// The parabola from height h at speed v up with acceleration a, as a path of Hermite pieces, which it is exactly.
sim::TipPath parabola(double h, double v, double a, double last_s) {
    sim::TipPath path;
    constexpr int kPieces = 4;
    for (int i = 0; i <= kPieces; ++i) {
        const double t = last_s * i / kPieces;
        path.nodes.push_back({t, {0.3 * t, h + v * t + 0.5 * a * t * t, 0}, {0.3, v + a * t, 0}});
    }
    return path;
}

TEST(PlaneContacts, AParabolaMeetsThePlaneAtItsRootWithItsSpeedThere) {
    const std::vector<sim::Contact> contacts = plane_contacts(parabola(0.1, -1, -20, 0.09), 0);
    ASSERT_EQ(contacts.size(), 1U);
    const double root = (-1 + std::sqrt(1 + 2 * 20 * 0.1)) / 20;  // 0.1 = t + 10 t^2
    EXPECT_NEAR(contacts[0].t_s, root, 1e-11);
    EXPECT_NEAR(contacts[0].speed_mps, 1 + 20 * root, 1e-9);
    EXPECT_NEAR(contacts[0].point_world.x(), 0.3 * root, 1e-11);
    EXPECT_FALSE(contacts[0].starts_inside);
}

TEST(PlaneContacts, ADipMustBe3MmDeepAndAStartInsideIsToldWithItsDepth) {
    // Lowest at 0.03 s, at -depth: v = -a 0.03, h = a 0.03^2 / 2 - depth.
    constexpr double kAcceleration = 60, kLowestS = 0.03;
    const auto dip = [&](double depth) {
        return plane_contacts(parabola(kAcceleration * kLowestS * kLowestS / 2 - depth,
                                       -kAcceleration * kLowestS, kAcceleration, 0.09),
                              0);
    };
    EXPECT_TRUE(dip(0.0028).empty());
    EXPECT_EQ(dip(0.0032).size(), 1U);
    const std::vector<sim::Contact> inside = plane_contacts(parabola(-0.004, 1, 0, 0.09), 0);
    ASSERT_EQ(inside.size(), 1U);
    EXPECT_TRUE(inside[0].starts_inside);
    EXPECT_NEAR(inside[0].depth_m, 0.004, 1e-15);
}

}  // namespace
}  // namespace app
