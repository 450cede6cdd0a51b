#include "play/strike_marks.h"

#include <gtest/gtest.h>
#include <render/renderer.h>

#include <cmath>
#include <numbers>

#include "files/assets.h"
#include "pictures/kit_stage.h"

namespace app {
namespace {

Strike strike(Outcome outcome, double scheduled_at_s, double contact_s, double onset_s, double decided_at_s) {
    Strike s;
    s.outcome = outcome;
    s.scheduled_at_s = scheduled_at_s, s.contact_s = contact_s;
    s.onset_s = onset_s, s.decided_at_s = decided_at_s;
    return s;
}

TEST(StrikeMarks, OfANoteThatSoundsInTimeLateOrNotAtAllForAQuarterOfASecond) {
    const std::vector<Strike> strikes = {
        strike(Outcome::released, 0.90, 1.0, 1.0, 0.99), strike(Outcome::released, 1.01, 1.0, 1.02, 1.01),
        strike(Outcome::cancelled, 0.95, 1.1, 1.1, 1.03), strike(Outcome::pending, 1.00, 1.1, 1.1, 0)};
    const auto kinds = [&](double T) {
        std::string found;
        for (const StrikeMark& mark : strike_marks(strikes, T)) found += "rlc"[int(mark.kind)];
        return found;
    };
    EXPECT_EQ(kinds(0.99), "");
    EXPECT_EQ(kinds(1.0), "r");
    EXPECT_EQ(kinds(1.025), "lr");
    EXPECT_EQ(kinds(1.04), "clr");
    EXPECT_EQ(kinds(1.255), "cl");
    EXPECT_EQ(kinds(1.29), "");
}

TEST(RecordedPose, LiesStraightBetweenSamplesAndNowhereBeyondThem) {
    tracking::StickTrace stick;
    const Eigen::Quaterniond turned(Eigen::AngleAxisd(1.0, Eigen::Vector3d::UnitX()));
    stick.samples = {{1, {0, 0, 0}, Eigen::Quaterniond::Identity(), true}, {3, {2, 4, 6}, turned, true}};
    EXPECT_FALSE(recorded_pose(stick, 0.99));
    EXPECT_FALSE(recorded_pose(stick, 3.01));
    EXPECT_EQ(recorded_pose(stick, 1)->position, Eigen::Vector3d(0, 0, 0));
    EXPECT_EQ(recorded_pose(stick, 3)->position, Eigen::Vector3d(2, 4, 6));
    EXPECT_LT((recorded_pose(stick, 1.5)->position - Eigen::Vector3d(0.5, 1, 1.5)).norm(), 1e-15);
    EXPECT_NEAR(Eigen::AngleAxisd(recorded_pose(stick, 1.5)->orientation).angle(), 0.25, 1e-12);
}

/// The pixel at a world point of a stage seen from above, by what `is` says of red, green and blue.
struct FromAbove {
    FromAbove(const KitStage& stage, const Annotations& annotations) : scene(stage.scene(640, 480)) {
        render::Renderer(scene).draw(stage.frame({}, {}, 0, annotations), image);
    }
    [[nodiscard]] Eigen::Vector3i at(const Eigen::Vector3d& point) const {
        const Eigen::Vector3f from_eye = point.cast<float>() - scene.camera.eye;
        const float focal =
            240 / std::tan(scene.camera.vertical_fov_deg * std::numbers::pi_v<float> / 360) / -from_eye.y();
        const auto x = static_cast<std::size_t>(320 + focal * from_eye.x());
        const auto y = static_cast<std::size_t>(240 + focal * from_eye.z());
        const std::uint8_t* pixel = image.rgb.data() + 3 * (640 * y + x);
        return {pixel[0], pixel[1], pixel[2]};
    }
    render::SceneDescription scene;
    render::Image image;
};

KitStage stage_from_above(Shown shown, std::size_t sticks) {
    CameraChoice top;
    top.side = CameraSide::top;
    return KitStage(read_kit(find_kit("drums")), sticks, StickGeometry{}, top, shown);
}

TEST(Annotations, MarksAreDiscsWhereStrikesMetGreenOrangeOrRedByTheirEnd) {
    const KitStage stage = stage_from_above({.ghosts = false, .marks = true}, 0);
    const auto place = [](double x) { return Eigen::Vector3d(x, 1.3, -0.5); };  // over the kit
    Annotations annotations;
    for (const MarkKind kind : {MarkKind::cancelled, MarkKind::released, MarkKind::late})
        annotations.marks.push_back({kind, place(0.2 * int(kind)), Eigen::Vector3d::UnitY()});
    const FromAbove with(stage, annotations), without(stage, {});
    for (const double beside : {0.0, 0.02, -0.02}) {
        const Eigen::Vector3i green = with.at(place(beside)), orange = with.at(place(0.2 + beside)),
                              red = with.at(place(0.4 + beside));
        EXPECT_GT(green[1], 2 * green[0]) << green.transpose();
        EXPECT_GT(orange[0], orange[1] + 30) << orange.transpose();
        EXPECT_GT(orange[1], orange[2] + 30) << orange.transpose();
        EXPECT_GT(red[0], 2 * red[1]) << red.transpose();
    }
    // 40 mm from its middle a disc of 30 mm shows nothing, apart from its shadow, which falls to the right and away.
    EXPECT_EQ(with.at(place(-0.04)), without.at(place(-0.04)));
}

TEST(Annotations, GhostsLieWhereTheStickWasMeasuredIsPredictedAndIs) {
    const KitStage stage = stage_from_above({.ghosts = true, .marks = false}, 1);
    const auto pose = [](double x) {
        tracking::PosePrediction at;
        at.position = {x, 1.3, -0.5};  // the tip of a stick along -z
        return at;
    };
    Annotations annotations;
    annotations.ghosts = {{pose(-0.2), pose(0), pose(0.2)}};
    const FromAbove with(stage, annotations);
    const auto middle = [&](double x) { return with.at({x, 1.3, -0.4}); };
    EXPECT_GT(middle(-0.2)[2], 2 * middle(-0.2)[0]) << "measured: blue";
    EXPECT_GT(middle(0)[0], middle(0)[2] + 50) << "predicted: yellow";
    EXPECT_GT(middle(0)[1], middle(0)[2] + 50);
    EXPECT_GT(middle(0.2)[1], 2 * middle(0.2)[0]) << "true: green";
    annotations.ghosts[0].truth.reset();
    EXPECT_NE(FromAbove(stage, annotations).at({0.2, 1.3, -0.4}), middle(0.2));
}

TEST(Annotations, AStageWithoutThemHasNoneOfTheirObjects) {
    const std::size_t plain = stage_from_above({}, 2).scene(64, 48).objects.size();
    EXPECT_EQ(stage_from_above({.ghosts = true, .marks = true}, 2).scene(64, 48).objects.size(),
              plain + 6 + 36);
    EXPECT_EQ(stage_from_above({}, 2).frame({}, {}).visible.size(), plain);
}

}  // namespace
}  // namespace app
