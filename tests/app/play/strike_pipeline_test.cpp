// What pictures add to the bodies' exact states, strike by strike.
#include "play/strike_pipeline.h"

#include <gtest/gtest.h>
#include <malloc.h>

#include <cmath>

namespace app {
namespace {

Strike strike_at(double contact_s, double push = 1) {
    Strike strike;
    strike.id = 1;
    strike.contact_s = contact_s;
    strike.impulse_body = Eigen::Vector3d(0, -push, 0);
    return strike;
}

/// Sum of weight times push over the impulses: what the body shows, in units of the push, plus what is folded
/// into its state.
double shown(const std::vector<sim::WeightedImpulse>& list, double folded = 0) {
    double sum = folded;
    for (const sim::WeightedImpulse& entry : list) sum -= entry.weight * entry.impulse.impulse_body.y();
    return sum;
}

constexpr double kFrame = 1.0 / 30;

// Small pieces that stay, between those that each sample takes and gives back, leave holes that nothing fits: an hour of
// live play would grow by 3 KiB a strike.
TEST(DrawnStrikes, AStrikeThatIsOverLeavesNoPieceOfItsOwnInMemory) {
    DrawnStrikes drawn;
    const std::size_t before = mallinfo2().uordblks;  // 0 under sanitizers
    for (std::uint64_t id = 1; id <= 10000; ++id) drawn.folded(id);
    EXPECT_LT(mallinfo2().uordblks - before, 65536U)
        << "two bytes a strike, in one row; a piece each is 480000";
}

TEST(DrawnStrikes, AContactIsDrawnFromTheFirstFrameAfterIt) {
    DrawnStrikes drawn;
    const Strike strike = strike_at(0.1);
    EXPECT_EQ(shown(drawn.frame(0.09, std::span(&strike, 1))), 0);
    EXPECT_EQ(shown(drawn.frame(0.11, std::span(&strike, 1))), 1);
}

TEST(DrawnStrikes, ACancelledContactFadesWithin100MsWithoutAJump) {
    DrawnStrikes drawn;
    Strike strike = strike_at(0.1);
    double T = 0.11;
    double last = shown(drawn.frame(T, std::span(&strike, 1)));
    strike.outcome = Outcome::cancelled;
    for (int i = 1; i <= 4; ++i) {
        const double now = shown(drawn.frame(T + i * kFrame, std::span(&strike, 1)));
        EXPECT_LE(now, last);
        EXPECT_LE(last - now, kFrame / 0.1 + 1e-9);  // one frame's share of 100 ms
        last = now;
    }
    EXPECT_EQ(last, 0);
}

TEST(DrawnStrikes, ACancelledContactThatWasNeverDrawnShowsNothing) {
    DrawnStrikes drawn;
    Strike strike = strike_at(0.1);
    EXPECT_EQ(shown(drawn.frame(0.05, std::span(&strike, 1))), 0);
    strike.outcome = Outcome::cancelled;
    EXPECT_TRUE(drawn.frame(0.2, std::span(&strike, 1)).empty());
}

TEST(DrawnStrikes, AReleasedContactThatMovedPassesOverToItsFinalImpulseSmoothlyAlsoWhileItIsFolded) {
    DrawnStrikes drawn;
    Strike strike = strike_at(0.1, 1);
    double last = shown(drawn.frame(0.11, std::span(&strike, 1)));
    strike.impulse_body.y() = -2;  // the last state before the release said 2
    strike.outcome = Outcome::released;
    for (int i = 1; i <= 6; ++i) {
        if (i == 2) drawn.folded(1);
        const double now = shown(drawn.frame(0.11 + i * kFrame, std::span(&strike, 1)), i >= 2 ? 2 : 0);
        EXPECT_LE(std::abs(now - last), kFrame / 0.1 + 1e-9);
        last = now;
    }
    EXPECT_EQ(last, 2);
    EXPECT_TRUE(drawn.frame(0.5, std::span(&strike, 1)).empty()) << "settled: the exact state says it all";
}

TEST(DrawnStrikes, AnUnmovedReleasedContactAddsNothingOnceItIsFolded) {
    DrawnStrikes drawn;
    Strike strike = strike_at(0.1);
    (void)drawn.frame(0.11, std::span(&strike, 1));
    strike.outcome = Outcome::released;
    drawn.folded(1);
    EXPECT_TRUE(drawn.frame(0.11 + kFrame, std::span(&strike, 1)).empty());
}

}  // namespace
}  // namespace app
