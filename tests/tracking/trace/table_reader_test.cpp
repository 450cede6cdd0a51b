#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <numbers>

#include "mutation.h"
#include "tracking/import.h"
#include "tracking/rotation.h"

namespace tracking {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

ColumnMap positions() {
    ColumnMap map;
    map.columns = {{"t", "Time"}, {"px", "X"}, {"py", "Y"}, {"pz", "Z"}};
    return map;
}

ColumnMap with_euler(const std::string& order) {
    ColumnMap map = positions();
    map.columns.insert({{"ex", "A"}, {"ey", "B"}, {"ez", "C"}});
    map.euler = order;
    return map;
}

Trace read(const std::string& text, const ColumnMap& map) {
    return read_tables({{text, "fuzz.txt", "stick"}}, map);
}

void expect_table_refused(const std::string& text, const ColumnMap& map, const std::string& what) {
    try {
        static_cast<void>(read(text, map));
        FAIL() << "read: " << what;
    } catch (const TraceError& error) {
        EXPECT_NE(std::string(error.what()).find(what), std::string::npos) << error.what();
    }
}

TEST(Tables, ColumnsAreFoundByNameInAnyOrderAndUnitsAndAxesAreTurned) {
    ColumnMap map = positions();
    map.metres_per_unit = 1e-3;
    map.z_up = true;
    map.seconds_per_unit = 1e-3;
    const Trace trace = read("Z,note,\"X\",Time,Y\n3,\"a, b\",1,1000,2\n4,x,2,1010,3\n", map);
    ASSERT_EQ(trace.sticks.size(), 1u);
    EXPECT_EQ(trace.sticks[0].name, "stick");
    const PoseSample& first = trace.sticks[0].samples[0];
    EXPECT_EQ(first.t_s, 1);
    EXPECT_EQ(first.position, Vector3d(0.001, 0.003, -0.002)) << "(x, y, z) of z up is (x, z, -y) of y up";
    EXPECT_FALSE(first.has_orientation);
}

TEST(Tables, RowsMayHoldSeveralSticksOrEachNameItsOwn) {
    ColumnMap wide;
    wide.columns = {{"frame", "F"},     {"left.px", "LX"},  {"left.py", "+1"}, {"left.pz", "+2"},
                    {"right.px", "#5"}, {"right.py", "#6"}, {"right.pz", "#7"}};
    wide.rate_hz = 100;
    const Trace both = read("F,LX,LY,LZ,RX,RY,RZ\n7,1,2,3,4,5,6\n9,1,2,3,4,5,6\n", wide);
    ASSERT_EQ(both.sticks.size(), 2u);
    EXPECT_EQ(both.sticks[1].name, "right");
    EXPECT_EQ(both.sticks[1].samples[0].position, Vector3d(4, 5, 6));
    EXPECT_EQ(both.sticks[1].samples[1].t_s, 0.02) << "frames that are missing leave a gap";
    ColumnMap tall = positions();
    tall.columns["stick"] = "Who";
    const Trace named = read("Time,Who,X,Y,Z\n0,l,1,1,1\n0,r,2,2,2\n1,r,2,2,2\n2,l,1,1,1\n", tall);
    ASSERT_EQ(named.sticks.size(), 2u);
    EXPECT_EQ(named.sticks[1].name, "r");
    EXPECT_EQ(named.sticks[1].samples[1].t_s, 1);
}

TEST(Tables, BlanksSemicolonsDecimalCommasCommentsAndLostRowsAreRead) {
    ColumnMap map;
    map.separator = ';';
    map.decimal_comma = true;
    map.comment = '%';
    map.columns = {{"t", "#1"}, {"px", "#2"}, {"py", "#3"}, {"pz", "#4"}};
    const Trace trace = read("% a comment\n0,5;1,25;2;3\n0,75;;;\n1;NaN;NaN;NaN\n1,5;1;2;3\n", map);
    ASSERT_EQ(trace.sticks[0].samples.size(), 2u);
    EXPECT_EQ(trace.sticks[0].samples[0].position.x(), 1.25);
    ASSERT_EQ(trace.remarks.size(), 1u);
    EXPECT_NE(trace.remarks[0].find("2 rows"), std::string::npos);
}

TEST(Tables, DecimalCommasThatNobodySpokeOfNameTheOption) {
    ColumnMap map;
    map.separator = ';';
    map.columns = {{"t", "#1"}, {"px", "#2"}, {"py", "#3"}, {"pz", "#4"}};
    try {
        (void)read("0;1,25;2;3\n", map);
        FAIL() << "read";
    } catch (const TraceError& wrong) {
        EXPECT_NE(std::string(wrong.what()).find(":1:3: error: found '1,25'"), std::string::npos)
            << wrong.what();
        EXPECT_NE(std::string(wrong.what()).find("--decimal comma"), std::string::npos);
    }
}

TEST(Tables, EulerAnglesOfEveryOrderAreIntrinsicTurns) {
    const double a = 0.3, b = -0.7, c = 1.1;
    const auto turn = [&](char axis) {
        return axis == 'X'   ? Eigen::AngleAxisd(a, Vector3d::UnitX())
               : axis == 'Y' ? Eigen::AngleAxisd(b, Vector3d::UnitY())
                             : Eigen::AngleAxisd(c, Vector3d::UnitZ());
    };
    for (const std::string order : {"XYZ", "XZY", "YXZ", "YZX", "ZXY", "ZYX"}) {
        ColumnMap map = with_euler(order);
        map.radians = true;
        const Trace trace = read("Time,X,Y,Z,A,B,C\n0,0,0,0,0.3,-0.7,1.1\n1,0,0,0,0.3,-0.7,1.1\n", map);
        const Quaterniond expected(turn(order[0]) * turn(order[1]) * turn(order[2]));
        EXPECT_LT(logarithm(expected.conjugate() * trace.sticks[0].samples[1].orientation).norm(), 1e-14)
            << order;
    }
}

/// X-Y-Z Euler angles in degrees with the middle one within 90, as motion capture writes them.
Vector3d euler_degrees(const Eigen::Matrix3d& r) {
    return Vector3d(std::atan2(-r(1, 2), r(2, 2)), std::asin(std::clamp(r(0, 2), -1.0, 1.0)),
                    std::atan2(-r(0, 1), r(0, 0))) *
           (180 / std::numbers::pi);
}

TEST(Tables, AStickThatTurnsThrough90DegreesOfItsMiddleEulerAngleStaysContinuous) {
    std::string text = "Time,X,Y,Z,A,B,C\n";
    std::vector<Quaterniond> truth;
    double largest_jump = 0;
    Vector3d before = Vector3d::Zero();
    for (int k = 0; k < 400; ++k) {  // five turns about y, tilted a little, 4.5 degrees a sample
        truth.emplace_back(exponential({0.02, 0, 0}) *
                           exponential({0, 0.01 + 2 * std::numbers::pi * k / 80, 0}));
        const Vector3d angles = euler_degrees(truth.back().toRotationMatrix());
        if (k > 0) largest_jump = std::max(largest_jump, (angles - before).cwiseAbs().maxCoeff());
        before = angles;
        char row[160];
        std::snprintf(row, sizeof row, "%g,0,0,0,%.15g,%.15g,%.15g\n", 0.004 * k, angles.x(), angles.y(),
                      angles.z());
        text += row;
    }
    EXPECT_GT(largest_jump, 170) << "the angles themselves must jump for this to mean anything";
    const std::vector<PoseSample> samples = read(text, with_euler("XYZ")).sticks[0].samples;
    for (std::size_t k = 0; k < samples.size(); ++k) {
        // Passes the pole by 0.01 rad, where rounding errors of 1e-15 grow a hundredfold or two.
        EXPECT_LT(logarithm(truth[k].conjugate() * samples[k].orientation).norm(), 1e-12);
        if (k == 0) continue;
        EXPECT_GT(samples[k].orientation.dot(samples[k - 1].orientation), 0.99)
            << "one sheet of the double cover";
    }
}

TEST(Tables, FaultsAreRefusedWithTheirPlace) {
    const std::string head = "Time,X,Y,Z\n";
    expect_table_refused(head + "0,1,2,3\n1,1,x,3\n", positions(), "fuzz.txt:3:5: error: found 'x'");
    expect_table_refused(head + "0,1,2,3\n1,1,,3\n", positions(), "fuzz.txt:3:5:");
    expect_table_refused(head + "0,1,2,3\n1,1,2\n", positions(), "fuzz.txt:3:6: error: found 3 columns");
    expect_table_refused(head + "0,1,2,3\n0,1,2,3\n", positions(), "fuzz.txt:3:1: error: found time");
    expect_table_refused("Time,X,Y,Q\n0,1,2,3\n", positions(), "fuzz.txt:1:1: error: found no column 'Z'");
    expect_table_refused("Time,X,Y,Z,Z\n0,1,2,3,4\n", positions(), "#4 or #5");
    expect_table_refused(head + "0,1,2,3\n", positions(), "at least two samples");
    expect_table_refused(head, positions(), "no rows");
    expect_table_refused("", positions(), "no header");
    expect_table_refused(head + "0,1,2,3\n1,1,2,2000\n", positions(), "fuzz.txt:3:7:");
    expect_table_refused(head + "1e9,1,2,3\n1000000001,1,2,3\n", positions(), "count from the first row");
    ColumnMap frames = positions();
    frames.columns.erase("t");
    expect_table_refused(head + "0,1,2,3\n1,1,2,3\n", frames, "--rate");
    ColumnMap matrix = positions();
    std::string names = "Time,X,Y,Z";
    for (const char* m : {"m00", "m01", "m02", "m10", "m11", "m12", "m20", "m21", "m22"}) {
        matrix.columns[m] = m;
        names += std::string(",") + m;
    }
    expect_table_refused(names + "\n0,1,2,3,1,0,0,0,1,0,0,0,-1\n", matrix, "determinant -1");
    expect_table_refused(names + "\n0,1,2,3,1,0,0,0,1,0,0,0.5,1\n", matrix, "rotation matrix");
}

TEST(Tables, MapsThatCannotBeAreRefused) {
    const auto refused = [](auto change) {
        ColumnMap map = positions();
        change(map);
        EXPECT_THROW(map.check(), std::invalid_argument);
    };
    refused([](ColumnMap& m) { m.columns.erase("pz"); });
    refused([](ColumnMap& m) { m.columns["pxx"] = "X"; });
    refused([](ColumnMap& m) { m.columns["qw"] = "W"; });
    refused([](ColumnMap& m) { m.columns.insert({{"ex", "A"}, {"ey", "B"}, {"ez", "C"}}); });
    refused([](ColumnMap& m) { m.euler = "XYX"; });
    refused([](ColumnMap& m) { m.columns["px"] = "#0"; });
    refused([](ColumnMap& m) { m.columns["px"] = "+1"; });
    refused([](ColumnMap& m) { m.separator = 'x'; });
}

TEST(Tables, FourHundredMutationsAreReadAsValidTracesOrRefusedInOneLocatedLine) {
    std::string text = "Time,X,Y,Z,A,B,C\n";
    for (int k = 0; k < 6; ++k) text += std::to_string(k) + ",0.1,0.2,0.3,10,20,30\n";
    const Outcomes outcomes = mutate_and_read(
        text, 400, 3, [](const std::string& mutation) { return read(mutation, with_euler("XYZ")); });
    EXPECT_GT(outcomes.read, 40);
    EXPECT_GT(outcomes.refused, 40);
}

}  // namespace
}  // namespace tracking
