#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "trace/orientation_forms.h"
#include "tracking/import.h"

namespace tracking {
namespace {

using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;

constexpr double kRounding = 1e-14;  // of a few products of numbers near 1, written with 17 digits

std::string digits(double value) {
    char text[32];
    std::snprintf(text, sizeof text, "%.17g", value);
    return text;
}

/// Where a letter points in our axes: x right, y up, z back.
Vector3d pointing(char letter) {
    switch (letter) {
        case 'R':
            return Vector3d::UnitX();
        case 'L':
            return -Vector3d::UnitX();
        case 'U':
            return Vector3d::UnitY();
        case 'D':
            return -Vector3d::UnitY();
        case 'B':
            return Vector3d::UnitZ();
        default:
            return -Vector3d::UnitZ();
    }
}

Matrix3d ours_from(const std::string& frame) {
    Matrix3d m;
    for (int axis = 0; axis < 3; ++axis) m.col(axis) = pointing(frame[static_cast<std::size_t>(axis)]);
    return m;
}

std::vector<std::string> all_frames() {
    std::vector<std::string> frames;
    const std::string letters = "RLUDFB";
    for (const char a : letters)
        for (const char b : letters)
            for (const char c : letters)
                if (ours_from({a, b, c}).determinant() != 0) frames.push_back({a, b, c});
    return frames;
}

ColumnMap poses() {
    ColumnMap map;
    map.columns = {{"t", "t"},   {"px", "x"},  {"py", "y"},  {"pz", "z"},
                   {"qw", "qw"}, {"qx", "qx"}, {"qy", "qy"}, {"qz", "qz"}};
    return map;
}

std::string row(double t, const Vector3d& p, const Quaterniond& q) {
    std::string line = digits(t);
    for (const double v : {p.x(), p.y(), p.z(), q.w(), q.x(), q.y(), q.z()}) line += "," + digits(v);
    return line + "\n";
}

PoseSample last(const std::string& text, const ColumnMap& map) {
    return read_tables({{text, "table.csv"}}, map).sticks.at(0).samples.back();
}

const Vector3d kPlace(0.3, 1.2, -0.7);
const Quaterniond kTurn = Quaterniond(0.7, -0.2, 0.5, 0.4).normalized();
const Vector3d kTip(0.05, -0.1, -0.4);

TEST(Axes, PosesOfAll48FramesBecomeTheSameOnesOfOurs) {
    ASSERT_EQ(all_frames().size(), 48u) << "eight ways to sign six orders";
    for (const std::string& frame : all_frames()) {
        const Matrix3d m = ours_from(frame);
        const Matrix3d there = m.transpose() * kTurn.toRotationMatrix() * m;
        ASSERT_NEAR(there.determinant(), 1, kRounding) << "mirrored axes turn by proper rotations, too";
        ColumnMap map = poses();
        map.frame = frame;
        const std::string header = "t,x,y,z,qw,qx,qy,qz\n";
        const Vector3d p = m.transpose() * kPlace;
        const PoseSample read =
            last(header + row(0, p, Quaterniond(there)) + row(1, p, Quaterniond(there)), map);
        EXPECT_EQ(read.position, kPlace) << frame << ": signs and order alone change";
        EXPECT_LT((read.orientation.toRotationMatrix() - kTurn.toRotationMatrix()).norm(), kRounding)
            << frame;
        const Vector3d tip = p + there * (m.transpose() * kTip);
        EXPECT_LT((read.position + read.orientation * kTip - m * tip).norm(), kRounding)
            << frame << ": a point of the body stays at its place";
    }
}

TEST(Axes, UnityIsRightUpForwardAndUnrealForwardRightUpInCentimetres) {
    const std::string header = "t,x,y,z,qw,qx,qy,qz\n";
    const std::string text = header + "0,1,2,3,0.5,0.1,0.7,0.5\n1,1,2,3,0.5,0.1,0.7,0.5\n";
    ColumnMap map = poses();
    map.frame = "unity";
    PoseSample read = last(text, map);
    EXPECT_EQ(read.position, Vector3d(1, 2, -3));
    EXPECT_LT((read.orientation.coeffs() - Quaterniond(0.5, -0.1, -0.7, 0.5).coeffs()).norm(), kRounding)
        << "(w, x, y, z) becomes (w, -x, -y, z)";
    map.frame = "unreal";
    read = last(text, map);
    EXPECT_LT((read.position - Vector3d(0.02, 0.03, -0.01)).norm(), kRounding);
    EXPECT_LT((read.orientation.coeffs() - Quaterniond(0.5, -0.7, -0.5, 0.1).coeffs()).norm(), kRounding)
        << "(w, x, y, z) becomes (w, -y, -z, x)";
    map.metres_per_unit = 1;
    EXPECT_EQ(last(text, map).position, Vector3d(2, 3, -1)) << "units that are said count";
}

TEST(Axes, SignsInAMapDoWhatAFrameDoes) {
    const std::string text = "t,x,y,z,qw,qx,qy,qz\n" + row(0, kPlace, kTurn) + row(1, kPlace, kTurn);
    ColumnMap unity = poses(), signs = poses(), numbers = poses();
    unity.frame = "unity";
    signs.columns["pz"] = "-z", signs.columns["qx"] = "-qx", signs.columns["qy"] = "-qy";
    numbers.columns["pz"] = "-#4", numbers.columns["qx"] = "-+4", numbers.columns["qy"] = "-+5";
    const PoseSample expected = last(text, unity);
    for (const ColumnMap& map : {signs, numbers}) {
        EXPECT_EQ(last(text, map).position, expected.position);
        EXPECT_LT((last(text, map).orientation.coeffs() - expected.orientation.coeffs()).norm(), kRounding);
    }
}

/// Unreal's pitch raises the nose, its roll lowers the right side: the columns are where the axes go, after its
/// documented FRotationMatrix.
TEST(Axes, UnrealsRotatorIsRolledAndPitchedAgainstItsAxes) {
    const double pitch = 0.4, yaw = -1.1, roll = 0.8;
    const double sp = std::sin(pitch), cp = std::cos(pitch), sy = std::sin(yaw), cy = std::cos(yaw),
                 sr = std::sin(roll), cr = std::cos(roll);
    Matrix3d unreal;
    unreal.col(0) << cp * cy, cp * sy, sp;
    unreal.col(1) << sr * sp * cy - cr * sy, sr * sp * sy + cr * cy, -sr * cp;
    unreal.col(2) << -(cr * sp * cy + sr * sy), cy * sr - cr * sp * sy, cr * cp;
    ColumnMap map;
    map.columns = {{"t", "t"},      {"px", "x"},      {"py", "y"},  {"pz", "z"},
                   {"ex", "-Roll"}, {"ey", "-Pitch"}, {"ez", "Yaw"}};
    map.euler = "ZYX", map.radians = true, map.frame = "unreal";
    const std::string angles = "," + digits(pitch) + "," + digits(yaw) + "," + digits(roll) + "\n";
    const std::string text = "t,x,y,z,Pitch,Yaw,Roll\n0,0,0,0" + angles + "1,0,0,0" + angles;
    const Matrix3d m = ours_from("FRU");
    EXPECT_LT((last(text, map).orientation.toRotationMatrix() - m * unreal * m.transpose()).norm(), 1e-13)
        << "a dozen products";
}

TEST(Axes, FramesThatAreNoneAreRefused) {
    for (const char* frame : {"RUR", "RUL", "RU", "RUFB", "unity5", "ruf", "XYZ"}) {
        ColumnMap map = poses();
        map.frame = frame;
        EXPECT_THROW(map.check(), std::invalid_argument) << frame;
        EXPECT_FALSE(axes_of(frame)) << frame;
    }
    ColumnMap map = poses();
    map.frame = "unity", map.z_up = true;
    EXPECT_THROW(map.check(), std::invalid_argument) << "two statements of what is up";
    for (const char* column : {"-", "-#0", "-+x"}) {
        map = poses();
        map.columns["py"] = column;
        EXPECT_THROW(map.check(), std::invalid_argument) << column;
    }
    map = poses();
    map.columns["t"] = "-t";
    EXPECT_THROW(map.check(), std::invalid_argument) << "time runs forward";
}

Trace native(const std::string& keys, const std::string& orientation, const std::string& rest) {
    return parse_trace(keys + "t,stick,px,py,pz," + orientation + "\n" + rest, "native.csv");
}

TEST(Axes, ANativeTraceMaySayItsFrame) {
    const std::string rows = "0,a,1,2,3,0.5,0.1,0.7,0.5\n1,a,1,2,3,0.5,0.1,0.7,0.5\n";
    const Trace unity = native("# frame: unity\n# tip_m: 0,0,-0.4\n", "qw,qx,qy,qz", rows);
    EXPECT_EQ(unity.sticks[0].samples[1].position, Vector3d(1, 2, -3));
    EXPECT_LT(
        (unity.sticks[0].samples[1].orientation.coeffs() - Quaterniond(0.5, -0.1, -0.7, 0.5).coeffs()).norm(),
        kRounding);
    EXPECT_EQ(unity.tip, Vector3d(0, 0, -0.4)) << "in our axes already";
    EXPECT_EQ(native("# frame: unreal\n", "qw,qx,qy,qz", rows).sticks[0].samples[0].position,
              Vector3d(0.02, 0.03, -0.01));
    EXPECT_EQ(native("# frame: unreal\n# units: m\n", "qw,qx,qy,qz", rows).sticks[0].samples[0].position,
              Vector3d(2, 3, -1));
    EXPECT_EQ(native("# units: cm\n# frames: 2\n", "qw,qx,qy,qz", rows).sticks[0].samples[0].position,
              Vector3d(0.01, 0.02, 0.03))
        << "how many frames there are is a comment";
    for (const char* keys :
         {"# frame: unity\n# up: z\n", "# up: z\n# frame: unity\n", "# frame: left\n", "# Frame: unity\n"})
        EXPECT_THROW((void)native(keys, "qw,qx,qy,qz", rows), TraceError) << keys;
}

TEST(Axes, IncrementsAndEulerAnglesOfALeftHandedFrameTurnTheOtherWayAboutXAndY) {
    constexpr double kDegree = std::numbers::pi / 180;
    const auto turned = [](const Trace& trace) { return trace.sticks[0].samples.back().orientation; };
    const Vector3d axes[] = {-Vector3d::UnitX(), -Vector3d::UnitY(), Vector3d::UnitZ()};
    for (int axis = 0; axis < 3; ++axis) {
        std::string angles[3] = {"0", "0", "0"};
        angles[axis] = "30";
        const std::string euler = angles[0] + "," + angles[1] + "," + angles[2] + "\n";
        const Quaterniond expected(Eigen::AngleAxisd(30 * kDegree, axes[axis]));
        EXPECT_LT(turned(native("# frame: unity\n", "ex,ey,ez", "0,a,0,0,0," + euler + "1,a,0,0,0," + euler))
                      .angularDistance(expected),
                  1e-7)
            << "angularDistance loses half of the digits";
        angles[axis] = digits(15 * kDegree);
        const std::string step = angles[0] + "," + angles[1] + "," + angles[2] + "\n";
        EXPECT_LT(turned(native("# frame: unity\n", "rx,ry,rz", "0,a,0,0,0," + step + "1,a,0,0,0," + step))
                      .angularDistance(expected),
                  1e-7);
    }
}

}  // namespace
}  // namespace tracking
