#include "pictures/motion_blur.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <fstream>
#include <iterator>
#include <set>

#include "files/assets.h"
#include "pictures/frame_thread.h"
#include "temporary_folder.h"

namespace app {
namespace {

/// Linear light of a byte, by the formula of IEC 61966-2-1.
double light(std::uint8_t byte) {
    const double v = byte / 255.0;
    return v <= 0.04045 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4);
}

/// Half of the way from a byte to the next, in linear light: what rounding may take.
double half_step(std::uint8_t byte) {
    return 0.5 * std::max(light(byte) - (byte > 0 ? light(byte - 1) : 0),
                          (byte < 255 ? light(byte + 1) : 1) - light(byte));
}

TEST(MotionBlur, TheShutterIsOpenUpToTheFramesTimeInOrder) {
    EXPECT_EQ(exposure_times(2, 0), std::vector<double>{2});
    const std::vector<double> times = exposure_times(2, 0.016);
    ASSERT_EQ(times.size(), std::size_t(kBlurMoments));
    EXPECT_EQ(times.back(), 2);
    for (std::size_t i = 1; i < times.size(); ++i)
        EXPECT_NEAR(times[i] - times[i - 1], 0.016 / kBlurMoments, 1e-12);
    EXPECT_GT(times.front(), 2 - 0.016) << "a shutter that is always open takes no moment twice";
}

TEST(MotionBlur, EqualPicturesAreKeptToTheBitAndOthersMeetInLinearLight) {
    render::Image all{256, 1, {}}, back{256, 1, {}};
    for (int i = 0; i < 256; ++i)
        for (int c = 0; c < 3; ++c) {
            all.rgb.push_back(std::uint8_t(i));
            back.rgb.push_back(std::uint8_t(255 - i));
        }
    LinearMean still, meeting;
    for (int i = 0; i < kBlurMoments; ++i) {
        still.add(all);
        meeting.add(i % 2 ? all : back);
    }
    EXPECT_EQ(still.mean().rgb, all.rgb);
    const render::Image mean = meeting.mean();
    EXPECT_EQ(mean.rgb[0], 188) << "half of white's light";
    for (std::size_t i = 0; i < mean.rgb.size(); ++i)  // and half a step of 1 / 65535 of either table
        EXPECT_NEAR(light(mean.rgb[i]), 0.5 * (light(all.rgb[i]) + light(back.rgb[i])),
                    half_step(mean.rgb[i]) + 2e-5);
}

/// A bright stick before the dark wall, `x` to the right [m]; it casts no shadow.
render::SceneDescription stick_alone() {
    render::SceneDescription scene;
    scene.objects.push_back({"stick", assets_folder() / "meshes" / "stick.obj", {}});
    scene.objects.back().look.body.color = Eigen::Vector3f(1, 1, 1);
    scene.width = 160, scene.height = 120, scene.shadow_size = 0;
    return scene;
}
render::FrameState stick_at(float x) {
    Eigen::Affine3f place(Eigen::Translation3f(x, 0.9f, 0.2f));
    place.rotate(Eigen::AngleAxisf(1.5f, Eigen::Vector3f::UnitX()));
    return {{place.matrix()}, {true}};
}

render::Image drawn(const TemporaryFolder& folder, FrameJob job) {
    FrameThread frames({stick_alone()}, stick_at(0), {160, 120, folder.path()});
    frames.push(std::move(job));
    frames.finish();
    std::ifstream in(folder.path() / "000000.png", std::ios::binary);
    return render::decode_png({std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()});
}

TEST(MotionBlur, AStillSceneIsAsWithoutBlurToTheBit) {
    const TemporaryFolder folder;
    const render::FrameState state = stick_at(0.1f);
    const render::Image sharp = drawn(folder, {.state = state});
    EXPECT_EQ(drawn(folder, {.state = state, .earlier = {7, between(state, state, 0.3f)}}).rgb, sharp.rgb);
}

TEST(MotionBlur, AMovingStickCoversTheWayThatItWentWithAllItsLight) {
    const TemporaryFolder folder;
    const render::FrameState from = stick_at(-0.3f), to = stick_at(0.3f);
    FrameJob job{.state = to};
    std::vector<render::Image> sharp;
    for (int i = 0; i + 1 < kBlurMoments; ++i) {
        job.earlier.push_back(between(from, to, float(i) / float(kBlurMoments - 1)));
        sharp.push_back(drawn(folder, {.state = job.earlier.back()}));
    }
    sharp.push_back(drawn(folder, {.state = to}));
    render::FrameState hidden = to;
    hidden.visible = {false};
    const render::Image empty = drawn(folder, {.state = hidden}), blurred = drawn(folder, std::move(job));

    std::set<int> columns;  // where the stick is much brighter than the wall
    double sum = 0, expected = 0, rounding = 0;
    for (std::size_t i = 0; i < blurred.rgb.size(); ++i) {
        if (blurred.rgb[i] > empty.rgb[i] + 10) columns.insert(int(i / 3) % 160);
        sum += light(blurred.rgb[i]);
        for (const render::Image& one : sharp) expected += light(one.rgb[i]) / kBlurMoments;
        rounding += half_step(blurred.rgb[i]) + 2e-5;
    }
    EXPECT_GT(expected, 0);
    EXPECT_NEAR(sum, expected, rounding);
    // Each byte by itself, too: no light has gone elsewhere.
    for (std::size_t i = 0; i < blurred.rgb.size(); ++i) {
        double mean = 0;
        for (const render::Image& one : sharp) mean += light(one.rgb[i]) / kBlurMoments;
        EXPECT_NEAR(light(blurred.rgb[i]), mean, half_step(blurred.rgb[i]) + 2e-5);
    }
    const auto column_of = [&](float x) {  // the middle of the stick's pixels
        const render::Image one = drawn(folder, {.state = stick_at(x)});
        double weighed = 0, all = 0;
        for (std::size_t i = 0; i < one.rgb.size(); ++i)
            if (one.rgb[i] > empty.rgb[i] + 40) weighed += int(i / 3) % 160, all += 1;
        EXPECT_GT(all, 0);
        return weighed / all;
    };
    const double left = column_of(-0.3f), right = column_of(0.3f);
    EXPECT_GT(right - left, 30);
    EXPECT_LE(*columns.begin(), left);
    EXPECT_GE(*columns.rbegin(), right - 1);
}

TEST(MotionBlur, BetweenTwoStatesATurnKeepsShapeAndThinThingsStayFinite) {
    Eigen::Affine3f a(Eigen::Translation3f(0, 1, 0)), b(Eigen::Translation3f(2, 1, 0));
    a.scale(Eigen::Vector3f(0.5f, 2, 1));
    b.rotate(Eigen::AngleAxisf(2, Eigen::Vector3f::UnitZ()));
    b.scale(Eigen::Vector3f(0.5f, 2, 1));
    const render::FrameState from{{a.matrix()}, {true}}, to{{b.matrix()}, {true}};
    Eigen::Affine3f half(Eigen::Translation3f(1, 1, 0));
    half.rotate(Eigen::AngleAxisf(1, Eigen::Vector3f::UnitZ()));
    half.scale(Eigen::Vector3f(0.5f, 2, 1));
    // float's rounding through an inverse and a decomposition
    EXPECT_LT((between(from, to, 0.5f).world_from_object[0] - half.matrix()).norm(), 1e-5f);
    EXPECT_EQ(between(to, to, 0.5f).world_from_object[0], b.matrix());
    render::FrameState absent = from;
    absent.visible = {false};
    EXPECT_EQ(between(absent, to, 0.5f).world_from_object[0], b.matrix());
    a.linear().col(1).setZero();
    EXPECT_EQ(between({{a.matrix()}, {true}}, to, 0.5f).world_from_object[0], b.matrix());
}

}  // namespace
}  // namespace app
