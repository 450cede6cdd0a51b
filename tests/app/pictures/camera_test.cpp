#include "pictures/camera.h"

#include <gtest/gtest.h>
#include <render/renderer.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "files/assets.h"
#include "files/bad_input.h"
#include "pictures/kit_stage.h"
#include "temporary_folder.h"

namespace app {
namespace {

constexpr CameraSide kSides[] = {CameraSide::drummer, CameraSide::front, CameraSide::top, CameraSide::side};

/// Where the camera sees a point: -1 to 1 across and up the picture; by similar triangles, apart from the code.
Eigen::Vector2d seen(const render::Camera& camera, const Eigen::Vector3d& point, double aspect) {
    const Eigen::Vector3d eye = camera.eye.cast<double>();
    const Eigen::Vector3d forward = (camera.target.cast<double>() - eye).normalized();
    const Eigen::Vector3d upwards =
        std::abs(forward.y()) > 0.9999 ? Eigen::Vector3d(0, 0, -1) : Eigen::Vector3d(0, 1, 0);
    const Eigen::Vector3d right = forward.cross(upwards).normalized();
    const double depth = forward.dot(point - eye);
    EXPECT_GT(depth, 0.05) << "behind the eye";
    const double half = depth * std::tan(double(camera.vertical_fov_deg) * M_PI / 360);
    return {right.dot(point - eye) / (half * aspect), right.cross(forward).dot(point - eye) / half};
}

/// Corners of a box around it.
std::vector<Eigen::Vector3d> corners_around(const Instrument& instrument) {
    std::vector<Eigen::Vector3d> points;
    for (int i = 0; i < 8; ++i) {
        const Eigen::Vector3d signs(i % 2 ? 1 : -1, i / 2 % 2 ? 1 : -1, i / 4 ? 1 : -1);
        points.push_back(instrument.body.world_from_body *
                         signs.cwiseProduct(instrument.body.shape.semi_axes));
    }
    return points;
}

/// No point of the boxes around the instruments, and so none of these, lies nearer than 4 % to an edge of the
/// picture, and one lies there (to float's rounding of metres), unless one is 0.2 m before the eye.
TEST(Camera, AllOfEachKitLiesInThePictureFromEverySideAndFillsIt) {
    for (const char* name : {"drums", "bells", "strings"}) {
        const Kit kit = read_kit(find_kit(name));
        for (const CameraSide side : kSides)
            for (const auto& [width, height] : {std::pair(640, 480), {1280, 720}, {480, 640}, {3840, 2160}}) {
                CameraChoice choice;
                choice.side = side;
                const render::Camera camera =
                    KitStage(kit, 0, StickGeometry{}, choice).scene(width, height).camera;
                const Eigen::Vector3d forward = (camera.target - camera.eye).cast<double>().normalized();
                double across = 0, up = 0, nearest = 100;
                for (const Instrument& instrument : kit.instruments)
                    for (const Eigen::Vector3d& point : corners_around(instrument)) {
                        const Eigen::Vector2d at = seen(camera, point, double(width) / height);
                        nearest = std::min(nearest, forward.dot(point - camera.eye.cast<double>()));
                        across = std::max(across, std::abs(at.x())), up = std::max(up, std::abs(at.y()));
                    }
                EXPECT_LE(std::max(across, up), 0.92 + 1e-4) << name << " " << int(side) << " " << width;
                EXPECT_TRUE(std::max(across, up) >= 0.92 - 1e-4 || std::abs(nearest - 0.2) < 1e-5)
                    << name << " " << int(side) << " " << width << ": " << across << " " << up;
            }
    }
}

/// Of one point the nearest eye; of eight corners of a cube those of the front face touch the margin.
TEST(Camera, ACubeSeenFromAboveTouchesTheMarginWithItsUpperFace) {
    std::vector<Eigen::Vector3f> corners;
    for (int i = 0; i < 8; ++i)
        corners.emplace_back(i % 2 ? 1.0f : -1.0f, i / 2 % 2 ? 1.0f : -1.0f, i / 4 ? 1.0f : -1.0f);
    const render::Camera camera = fitted_camera(CameraSide::top, corners, 1.5f);
    // (0.92 tan 22.5) (y_eye - 1) = 1
    EXPECT_NEAR(camera.eye.y(), 1 + 1 / (0.92 * std::tan(M_PI / 8)), 1e-5);
    EXPECT_NEAR(camera.eye.x(), 0, 1e-6);
    EXPECT_NEAR(camera.eye.z(), 0, 1e-6);
    EXPECT_NEAR(camera.target.norm(), 0, 1e-5);
}

TEST(Camera, AKitWithoutACameraIsFittedAndItsOwnIsKept) {
    Kit kit = read_kit(find_kit("drums"));
    ASSERT_TRUE(kit.camera);
    EXPECT_EQ(KitStage(kit, 0, StickGeometry{}).scene(64, 48).camera, *kit.camera);
    kit.camera.reset();
    CameraChoice drummer;
    drummer.side = CameraSide::drummer;
    EXPECT_EQ(KitStage(kit, 0, StickGeometry{}).scene(64, 48).camera,
              KitStage(kit, 0, StickGeometry{}, drummer).scene(64, 48).camera);
}

TEST(Camera, APlaceIsReadWithAndWithoutItsField) {
    const CameraChoice place = camera_format().parse("0,1.5,2:0.5,1,-1:60", "--camera");
    ASSERT_EQ(place.places.size(), 1u);
    EXPECT_EQ(place.places[0].camera, (render::Camera{{0, 1.5f, 2}, {0.5f, 1, -1}, 60}));
    EXPECT_EQ(camera_format().parse("0,1.5,2:0.5,1,-1", "--camera").places[0].camera.vertical_fov_deg, 45);
    EXPECT_EQ(camera_format().parse("top", "--camera").side, CameraSide::top);
    for (const char* wrong : {"", "back", "0,1,2", "0,1,2:0,1,2", "0,1:0,1,2", "0,1,2:0,0,0:4",
                              "0,1,2:0,0,0:121", "0,1,2:0,0,0:45:1", "nan,1,2:0,0,0", "0,1,200:0,0,0"})
        EXPECT_THROW((void)camera_format().parse(wrong, "--camera"), BadInput) << wrong;
}

std::string place(double time, const std::string& eye) {
    return "[[camera]]\ntime = " + std::to_string(time) + "\neye = " + eye +
           "\ntarget = [0, 1, 0]\nvertical_fov_deg = " + std::to_string(40 + 10 * time) + "\n";
}

TEST(Camera, APathGoesStraightFromPlaceToPlaceAndRestsAtItsEnds) {
    const TemporaryFolder folder;
    const std::string file =
        folder.write("path.toml", place(1, "[0, 1, 2]") + place(3, "[2, 1, 2]")).string();
    const CameraChoice path = camera_format().parse(file, "--camera");
    EXPECT_EQ(moving_camera(path, 0)->eye, Eigen::Vector3f(0, 1, 2));
    EXPECT_EQ(moving_camera(path, 2)->eye, Eigen::Vector3f(1, 1, 2));
    EXPECT_EQ(moving_camera(path, 2)->vertical_fov_deg, 60);
    EXPECT_EQ(moving_camera(path, 9)->eye, Eigen::Vector3f(2, 1, 2));
    folder.write("path.toml", place(1, "[0, 1, 2]"));
    EXPECT_FALSE(moving_camera(camera_format().parse(file, "--camera"), 2)) << "it stands still";
}

/// The picture's axes in the world, by the rule of render::Camera: right, up, back.
Eigen::Matrix3d axes(const render::Camera& camera) {
    const Eigen::Vector3d view = (camera.target - camera.eye).cast<double>().normalized();
    Eigen::Vector3d up = camera.up.cast<double>().normalized();
    if (std::abs(view.dot(up)) > 0.9999) up = Eigen::Vector3d(0, 0, -1);
    Eigen::Matrix3d all;
    all.col(0) = view.cross(up).normalized(), all.col(1) = all.col(0).cross(view), all.col(2) = -view;
    return all;
}

double turn_between(const Eigen::Matrix3d& a, const Eigen::Matrix3d& b) {
    return Eigen::AngleAxisd(Eigen::Matrix3d(a.transpose() * b)).angle();
}

/// Over the top, through a place that looks straight down, on to a side and from below to straight up. In 1/1000 of a
/// way of 1 s the view turns by less than |eye's speed| / |nearest to the target| / 1000 < 5 mrad, and the roll by at
/// most pi / 1000; a flip would be 1 to pi.
TEST(Camera, APathThroughTheVerticalTurnsThePictureWithoutAJump) {
    const TemporaryFolder folder;
    const std::vector<std::vector<std::string>> paths = {
        {"[0, 3, 2]", "[0, 3, -2]"},                            // over it, no place there
        {"[0.1, 3, 2]", "[0.1, 3, -2]"},                        // near to it
        {"[0, 3, 2]", "[0, 3, 0]", "[0, 3, -2]"},               // a place there
        {"[0, 3, 0]", "[0, 3, -2]", "[2, 2, 0]"},               // beginning there
        {"[2, 2, 0]", "[0, 3, 0]", "[0, 4, 0]", "[0, 3, -2]"},  // resting in it
        {"[1, -1, 1]", "[0, -1, 0]", "[-1, -1, 1]"},            // from below
    };
    for (const auto& eyes : paths) {
        std::string text;
        for (std::size_t i = 0; i < eyes.size(); ++i) text += place(0.5 * double(i) + 0.5, eyes[i]);
        const CameraChoice path = camera_format().parse(folder.write("path.toml", text).string(), "--camera");
        const int steps = 1000 * int(eyes.size());
        Eigen::Matrix3d before = axes(*moving_camera(path, 0));
        double most = 0;
        for (int i = 1; i <= steps; ++i) {
            const Eigen::Matrix3d now = axes(*moving_camera(path, 0.0005 * i + 0.5));
            most = std::max(most, turn_between(before, now));
            before = now;
        }
        EXPECT_LT(most, 0.012) << eyes.front() << " " << eyes.size();
        // Each place that does not look up or down is upright.
        for (std::size_t i = 0; i < eyes.size(); ++i) {
            const Eigen::Matrix3d there = axes(*moving_camera(path, 0.5 * double(i) + 0.5));
            if (std::abs(there(1, 2)) > 0.99) continue;
            EXPECT_NEAR(there(1, 0), 0, 1e-6);
            EXPECT_GT(there(1, 1), 0);
        }
    }
}

TEST(Camera, APathFarFromTheVerticalStaysUpright) {
    const TemporaryFolder folder;
    const std::string file =
        folder.write("path.toml", place(0, "[0, 2.5, 2]") + place(1, "[2, 2, 0]") + place(2, "[0, 1, -2]"))
            .string();
    const CameraChoice path = camera_format().parse(file, "--camera");
    for (int i = 0; i <= 100; ++i) EXPECT_EQ(moving_camera(path, 0.02 * i)->up, Eigen::Vector3f::UnitY());
}

TEST(Camera, WrongPathsAreRefusedWithTheirPlace) {
    const TemporaryFolder folder;
    const std::string file = (folder.path() / "path.toml").string();
    const auto refusal = [&](const std::string& text) {
        folder.write("path.toml", text);
        try {
            (void)camera_format().parse(file, "--camera");
        } catch (const BadInput& wrong) {
            return std::string(wrong.what());
        }
        return std::string();
    };
    const std::vector<std::pair<std::string, std::string>> cases = {
        {"", ":1:1: error: found no [[camera]]"},
        {"[[camera]]\neye = [0, 0]\n", ":2:7: error: found eye"},
        {"[[camera]]\nspeed = 1\n", ":2:1: error: found unknown key"},
        {"[[camera]]\neye = [0, 1, 2]\ntarget = [0, 1, 2]\n",
         ":3:10: error: found the camera's target at its eye"},
        {place(2, "[0, 1, 2]") + place(2, "[1, 1, 2]"), ":7:8: error: found time"},
        {place(1, "[0, 1, 2]") + place(2, "[0, 1, -2]"),
         ":9:10: error: found a camera that meets its target"},
    };
    for (const auto& [text, words] : cases)
        EXPECT_NE(refusal(text).find(file + words), std::string::npos) << refusal(text) << "\n" << words;
}

}  // namespace
}  // namespace app
