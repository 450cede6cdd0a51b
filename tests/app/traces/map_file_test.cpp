// The bundled maps read what the programs they are for write: each test writes such an export of a path it
// knows, and reads the path back.
#include "traces/map_file.h"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <Eigen/Geometry>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <numbers>

#include "files/bad_input.h"
#include "tracking/mutation.h"

namespace {

using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;

constexpr int kRows = 40;
constexpr double kRate = 200;

/// Where body `which` is in row k, in the export's own axes, metres.
Vector3d place(int which, int k) {
    return {0.3 * which - 0.1, 0.5 + 0.01 * k, 1.1 - 0.1 * std::sin(0.3 * k)};
}
Quaterniond turn(int which, int k) {
    return Quaterniond(Eigen::AngleAxisd(0.07 * k + which, Vector3d(0.3, -0.5, 0.8).normalized()));
}

/// The same in a trace, after a z-up world was turned.
Vector3d y_up(const Vector3d& v, bool z_up) {
    return z_up ? Vector3d(v.x(), v.z(), -v.y()) : v;
}
Quaterniond y_up(const Quaterniond& q, bool z_up) {
    return z_up ? Quaterniond(Eigen::AngleAxisd(-std::numbers::pi / 2, Vector3d::UnitX())) * q : q;
}

void expect_path(const tracking::Trace& trace, bool z_up, const std::vector<std::string>& names) {
    ASSERT_EQ(trace.sticks.size(), names.size());
    for (std::size_t i = 0; i < names.size(); ++i) {
        EXPECT_EQ(trace.sticks[i].name, names[i]);
        const std::vector<tracking::PoseSample>& samples = trace.sticks[i].samples;
        for (const tracking::PoseSample& sample : samples) {
            const int which = static_cast<int>(i), k = static_cast<int>(std::lround(sample.t_s * kRate));
            ASSERT_NEAR(sample.t_s, k / kRate, 1e-6);
            // Exports have six decimals, of metres or more finely.
            ASSERT_LT((sample.position - y_up(place(which, k), z_up)).norm(), 1e-6);
            ASSERT_LT(sample.orientation.angularDistance(y_up(turn(which, k), z_up)), 5e-6);
        }
        for (std::size_t k = 1; k < samples.size(); ++k)
            ASSERT_GT(samples[k].orientation.dot(samples[k - 1].orientation), 0);
    }
}

tracking::Trace read(const std::string& text, const tracking::ColumnMap& map) {
    return tracking::read_tables({{text, "fuzz.txt", "stick"}}, map);
}

/// Motive's layout: a line of keys and values, an empty one, rows Type to Frame above each column.
std::string optitrack(double scale, const char* units, bool newer) {
    std::string text = fmt::format(
        "Format Version,1.23,Take Name,one,Capture Frame Rate,200,Rotation Type,Quaternion,Length "
        "Units,{},Coordinate "
        "Space,Global\n\n",
        units);
    std::string rows[5] = {newer ? ",Type," : ",Type", newer ? ",Name," : ",Name", newer ? ",ID," : ",ID",
                           newer ? ",," : ",",
                           newer ? "Frame,Time (Seconds),TimeCode" : "Frame,Time (Seconds)"};
    const auto column = [&](const char* type, const char* name, const char* what, const char* axis) {
        for (int i = 0; i < 5; ++i)
            rows[i] += fmt::format(",{}", std::vector<const char*>{type, name, "\"1F\"", what,
                                                                   axis}[static_cast<std::size_t>(i)]);
    };
    for (const char* body : {"Left Stick", "Right Stick"}) {
        for (const char* axis : {"X", "Y", "Z", "W"}) column("Rigid Body", body, "Rotation", axis);
        for (const char* axis : {"X", "Y", "Z"}) column("Rigid Body", body, "Position", axis);
        column("Rigid Body", body, "Mean Marker Error", "");
        for (const char* axis : {"X", "Y", "Z"})
            column("Rigid Body Marker", (std::string(body) + ":Marker1").c_str(), "Position", axis);
    }
    for (int i = 0; i < 5; ++i) {
        text += rows[i] + "\n";
        if (i == 2 && newer) text += ",Parent,,,,\n";
    }
    for (int k = 0; k < kRows; ++k) {
        text += fmt::format("{},{:.6f}{}", k, k / kRate, newer ? ",15:26:46:12" : "");
        for (int which = 0; which < 2; ++which) {
            const Quaterniond q = turn(which, k);
            const Vector3d p = place(which, k) * scale;
            if (which == 1 && k == 7) {
                text += ",,,,,,,,,,,";  // not seen
                continue;
            }
            text += fmt::format(",{:.6f},{:.6f},{:.6f},{:.6f},{:.6f},{:.6f},{:.6f},0.0001,1,2,3", q.x(),
                                q.y(), q.z(), q.w(), p.x(), p.y(), p.z());
        }
        text += "\n";
    }
    return text;
}

/// QTM's layout: keys and values, one header row in which only X carries the body's name.
std::string qualisys() {
    std::string text =
        "NO_OF_FRAMES\t40\nNO_OF_CAMERAS\t4\nNO_OF_BODIES\t2\nFREQUENCY\t200\nDESCRIPTION\t--\nBODY_"
        "NAMES\tL\tR\n"
        "Frame\tTime";
    for (const char* body : {"L", "R"}) {
        text += fmt::format("\t{} X\tY\tZ\tRoll\tPitch\tYaw\tResidual", body);
        for (int i = 0; i < 9; ++i) text += fmt::format("\tRot[{}]", i);
    }
    text += "\n";
    for (int k = 0; k < kRows; ++k) {
        text += fmt::format("{}\t{:.5f}", k + 1, k / kRate);
        for (int which = 0; which < 2; ++which) {
            const bool lost = which == 0 && (k == 3 || k == 4);
            const Vector3d p = lost ? Vector3d(0, 0, 0) : Vector3d(place(which, k) * 1000);
            const Matrix3d m = lost ? Matrix3d(Matrix3d::Zero()) : turn(which, k).toRotationMatrix();
            text += fmt::format("\t{:.5f}\t{:.5f}\t{:.5f}\t0\t0\t0\t0.5", p.x(), p.y(), p.z());
            for (int column = 0; column < 3; ++column)
                for (int row = 0; row < 3; ++row) text += fmt::format("\t{:.7f}", m(row, column));
        }
        text += "\n";
    }
    return text;
}

std::string tum() {
    std::string text = "# timestamp tx ty tz qx qy qz qw\n";
    for (int k = 0; k < kRows; ++k) {
        const Quaterniond q = turn(0, k);
        const Vector3d p = place(0, k);
        text += fmt::format("{:.9f} {:.6f} {:.6f} {:.6f} {:.7f} {:.7f} {:.7f} {:.7f}\n",
                            1520531829.25 + k / kRate, p.x(), p.y(), p.z(), q.x(), q.y(), q.z(), q.w());
    }
    return text;
}

std::string vicon(int which) {
    std::string text = "Stick-left\nFrame,Root<a-X>,Root<a-Y>,Root<a-Z>,Root<t-X>,Root<t-Y>,Root<t-Z>,\n";
    for (int k = 0; k < kRows; ++k) {
        const Matrix3d r = turn(which, k).toRotationMatrix();
        const Vector3d p = place(which, k) * 1000;
        constexpr double kDegrees = 180 / std::numbers::pi;
        text += fmt::format("{},{:.9f},{:.9f},{:.9f},{:.6f},{:.6f},{:.6f},\n", 504 + k,
                            kDegrees * std::atan2(-r(1, 2), r(2, 2)), kDegrees * std::asin(r(0, 2)),
                            kDegrees * std::atan2(-r(0, 1), r(0, 0)), p.x(), p.y(), p.z());
    }
    return text;
}

void fuzz(const std::string& good, const tracking::ColumnMap& map, unsigned seed) {
    const tracking::Outcomes outcomes =
        tracking::mutate_and_read(good, 200, seed, [&](const std::string& text) { return read(text, map); });
    EXPECT_GE(outcomes.read, 10);
    EXPECT_GE(outcomes.refused, 10);
}

TEST(Maps, MotiveExportsOfSeveralVersionsAndUnitsAreReadARigidBodyAStick) {
    for (const bool newer : {false, true}) {
        for (const auto& [units, scale] :
             {std::pair("Meters", 1.0), std::pair("Millimeters", 1e3), std::pair("Centimeters", 1e2)}) {
            const std::string text = optitrack(scale, units, newer);
            const std::optional<tracking::ColumnMap> map = app::map_for(text);
            ASSERT_TRUE(map);
            const tracking::Trace trace = read(text, *map);
            expect_path(trace, false, {"Left_Stick", "Right_Stick"});
            EXPECT_EQ(trace.sticks[1].samples.size(), kRows - 1U);
            EXPECT_EQ(trace.remarks.size(), 1u);
        }
    }
    fuzz(optitrack(1, "Meters", false), app::find_map("optitrack"), 21);
}

TEST(Maps, AMotiveExportWithoutQuaternionsIsRefusedWithTheColumnThatIsMissing) {
    std::string text = optitrack(1, "Meters", false);
    std::size_t at = text.find("Frame,Time");
    while ((at = text.find(",W,", at)) != std::string::npos && at < text.find("\n0,")) text[at + 1] = 'V';
    try {
        static_cast<void>(read(text, app::find_map("optitrack")));
        FAIL();
    } catch (const tracking::TraceError& error) {
        EXPECT_NE(std::string(error.what()).find("Rotation/W"), std::string::npos) << error.what();
    }
}

TEST(Maps, QualisysExportsAreReadByTheirMatricesABodyAStick) {
    const std::optional<tracking::ColumnMap> map = app::map_for(qualisys());
    ASSERT_TRUE(map);
    const tracking::Trace trace = read(qualisys(), *map);
    EXPECT_EQ(trace.rate_hz, kRate);
    expect_path(trace, true, {"L", "R"});
    EXPECT_EQ(trace.sticks[0].samples.size(), kRows - 2U);
    fuzz(qualisys(), *map, 22);
}

TEST(Maps, TumTrajectoriesAreReadFromTheirFirstRowOn) {
    expect_path(read(tum(), app::find_map("tum")), true, {"stick"});
    fuzz(tum(), app::find_map("tum"), 23);
}

TEST(Maps, ViconExportsOfTwoHandsAreReadAsTwoSticks) {
    std::optional<tracking::ColumnMap> map = app::map_for(vicon(0));
    ASSERT_TRUE(map);
    map->rate_hz = kRate;
    expect_path(tracking::read_tables({{vicon(0), "a.csv", "left"}, {vicon(1), "b.csv", "right"}}, *map),
                true, {"left", "right"});
    fuzz(vicon(0), *map, 24);
}

TEST(Maps, AreWrittenSoThatTheyReadBackTheSame) {
    const std::filesystem::path file =
        std::filesystem::temp_directory_path() / fmt::format("musicworld_map_{}.toml", getpid());
    for (const std::string& name : app::map_names()) {
        const std::string text = app::format_map(app::find_map(name));
        std::ofstream(file) << text;
        EXPECT_EQ(app::format_map(app::read_map(file)), text) << name;
    }
    tracking::ColumnMap map = app::find_map("t=Time,left.px=X,left.py=Y,left.pz=Z");
    EXPECT_EQ(map.columns.at("left.px"), "X");
    map.tip = Vector3d(0, 0, -0.3);
    map.shaft = -Vector3d::UnitZ();
    map.metres_per_unit = 0.01;
    map.separator = '\t';
    std::ofstream(file) << app::format_map(map);
    const tracking::ColumnMap again = app::read_map(file);
    EXPECT_EQ(again.columns, map.columns);
    EXPECT_EQ(again.tip, map.tip);
    EXPECT_EQ(again.shaft, map.shaft);
    EXPECT_EQ(again.metres_per_unit, 0.01);
    EXPECT_EQ(again.separator, '\t');
    map = app::find_map("t=Time,px=-X,py=-+1,pz=Z");
    map.frame = "unreal";
    std::ofstream(file) << app::format_map(map);
    EXPECT_EQ(app::read_map(file).frame, "unreal");
    EXPECT_FALSE(app::read_map(file).metres_per_unit) << "cm, as nobody says otherwise";
    EXPECT_EQ(app::read_map(file).columns, map.columns);
    map = app::find_map("left.marker=*:HAND,left.marker2=*:TIP");
    std::ofstream(file) << app::format_map(map);
    EXPECT_EQ(app::read_map(file).columns, map.columns);
    std::filesystem::remove(file);
}

TEST(Maps, FaultsInMapFilesAreRefusedWithTheirPlace) {
    const std::filesystem::path file =
        std::filesystem::temp_directory_path() / fmt::format("musicworld_map_{}.toml", getpid());
    const std::pair<const char*, const char*> cases[] = {
        {"units = \"furlong\"\n[columns]\npx=\"X\"\npy=\"Y\"\npz=\"Z\"\n", ":1:"},
        {"colour = \"red\"\n[columns]\npx=\"X\"\npy=\"Y\"\npz=\"Z\"\n", ":1:"},
        {"[columns]\npx = 3\n", ":2:"},
        {"[columns]\npx = \"X\"\n", "no column for py"},
        {"[columns\n", ":1:"},
        {"frame = \"RUR\"\n[columns]\npx=\"X\"\npy=\"Y\"\npz=\"Z\"\n", "found frame 'RUR'"},
        {"frame = \"unity\"\nup = \"z\"\n[columns]\npx=\"X\"\npy=\"Y\"\npz=\"Z\"\n", "up z and a frame"},
        {"[columns.left]\nmarker2 = \"A\"\n", "without the ones before"},
        {"", ":1:1: error: found no key \"columns\""},
        {"[columns]\n", "no columns of positions"},
    };
    for (const auto& [text, place] : cases) {
        std::ofstream(file) << text;
        try {
            static_cast<void>(app::read_map(file));
            ADD_FAILURE() << text;
        } catch (const app::BadInput& error) {
            const std::string what = error.what();
            EXPECT_TRUE(what.starts_with(file.string())) << what;
            EXPECT_NE(what.find(place), std::string::npos) << what;
            EXPECT_EQ(what.find('\n'), std::string::npos) << what;
        }
    }
    std::filesystem::remove(file);
    EXPECT_THROW(static_cast<void>(app::find_map("nowhere.toml")), app::BadInput);
    EXPECT_THROW(static_cast<void>(app::find_map("px=X,px=Y")), app::BadInput);
}

}  // namespace
