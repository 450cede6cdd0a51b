#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "tracking/trace.h"

namespace tracking {
namespace {

const std::string kQuaternions = "t,stick,px,py,pz,qw,qx,qy,qz\n";
const std::string kPositions = "t,stick,px,py,pz\n";

/// The message for a text, or "read" if there is none.
std::string message_for(const std::string& text) {
    try {
        (void)parse_trace(text, "a.csv");
        return "read";
    } catch (const TraceError& error) {
        return error.what();
    }
}

struct BadTrace {
    const char* what;
    std::string text;
    const char* start;  ///< of the message: place and finding
};

void PrintTo(const BadTrace& bad, std::ostream* out) {
    *out << bad.what;
}

class TraceErrors : public testing::TestWithParam<BadTrace> {};

TEST_P(TraceErrors, AreOneLineWithPlaceFindingExpectationAndRemedy) {
    const std::string message = message_for(GetParam().text);
    EXPECT_TRUE(message.starts_with(GetParam().start)) << message;
    EXPECT_NE(message.find(", expected "), std::string::npos) << message;
    EXPECT_NE(message.find("; "), std::string::npos) << message;
    EXPECT_EQ(message.find('\n'), std::string::npos) << message;
}

const BadTrace kBad[] = {
    {"repeated time", kPositions + "0,a,1,2,3\n0,a,1,2,3\n",
     "a.csv:3:1: error: found sample time 0 s of stick 'a', expected later than that of line 2; "},
    {"time going back", kPositions + "0,a,1,2,3\n1,b,1,2,3\n0.5,a,1,2,3\n0.25,a,1,2,3\n",
     "a.csv:5:1: error: found sample time 0.25 s"},
    {"late time", kPositions + "2e7,a,1,2,3\n", "a.csv:2:1: error: found '2e7'"},
    {"far coordinate", kPositions + "0,a,1,-1000.5,3\n", "a.csv:2:7: error: found '-1000.5'"},
    {"far coordinate in mm", "# units: mm\n" + kPositions + "0,a,1,1000001,3\n",
     "a.csv:3:7: error: found '1000001'"},
    {"nan", kPositions + "0,a,1,2,nan\n", "a.csv:2:9: error: found 'nan'"},
    {"infinity", kPositions + "0,a,inf,2,3\n", "a.csv:2:5: error: found 'inf'"},
    {"out of range", kPositions + "0,a,1e999,2,3\n", "a.csv:2:5: error: found '1e999'"},
    {"word for a number", kPositions + "0,a,1,two,3\n", "a.csv:2:7: error: found 'two'"},
    {"tail after a number", kPositions + "0,a,1,2,3m\n", "a.csv:2:9: error: found '3m'"},
    {"empty number", kPositions + "0,a,,2,3\n", "a.csv:2:5: error: found an empty field"},
    {"column counts characters", kPositions + "0,\xC3\xA4\xC3\xB6,x,2,3\n", "a.csv:2:6: error: found 'x'"},
    {"missing field", kPositions + "0,a,1,2\n", "a.csv:2:8: error: found 4 fields"},
    {"extra field", kPositions + "0,a,1,2,3,4\n", "a.csv:2:10: error: found more than 5 fields"},
    {"empty line", kPositions + "0,a,1,2,3\n\n1,a,1,2,3\n", "a.csv:3:1: error: found an empty line"},
    {"one sample", kPositions + "0,a,1,2,3\n0,b,1,2,3\n1,a,1,2,3\n",
     "a.csv:3:3: error: found one sample of stick 'b'"},
    {"no sample", kPositions, "a.csv:2:1: error: found the end of the file"},
    {"no header", "# units: m\n", "a.csv:2:1: error: found the end of the file"},
    {"other header", "time,x,y,z\n", "a.csv:1:1: error: found 'time,x,y,z'"},
    {"header in another order", "t,stick,px,py,pz,qx,qy,qz,qw\n",
     "a.csv:1:1: error: found 't,stick,px,py,pz,qx,qy,qz,qw'"},
    {"zero quaternion", kQuaternions + "0,a,1,2,3,0,0,0,0\n",
     "a.csv:2:11: error: found a quaternion of norm 0"},
    {"norm off by 2 %", kQuaternions + "0,a,1,2,3,0.98,0,0,0\n",
     "a.csv:2:11: error: found a quaternion of norm 0.98"},
    {"component beyond 1", kQuaternions + "0,a,1,2,3,0,0,5,0\n", "a.csv:2:15: error: found '5'"},
    {"half a quaternion", kQuaternions + "0,a,1,2,3,1,0,,0\n", "a.csv:2:15: error: found an empty field"},
    {"missing increment", "t,stick,px,py,pz,rx,ry,rz\n0,a,1,2,3,,,\n",
     "a.csv:2:11: error: found an empty field"},
    {"empty stick name", kPositions + "0,,1,2,3\n", "a.csv:2:3: error: found stick name ''"},
    {"quoted stick name", kPositions + "0,\"a\",1,2,3\n", "a.csv:2:3: error: found stick name '\"a\"'"},
    {"stick name of two words", kPositions + "0,a b,1,2,3\n", "a.csv:2:3: error: found stick name 'a b'"},
    {"zero byte", kPositions + std::string("0,a,1\0,2,3\n", 11), "a.csv:2:6: error: found byte 0x00"},
    {"lone carriage return", kPositions + "0,a,1,2,3\r1,a,1,2,3\n", "a.csv:2:10: error: found byte 0x0d"},
    {"not UTF-8", kPositions + "0,a\xFF,1,2,3\n", "a.csv:2:4: error: found byte 0xff"},
    {"binary", std::string("\x89PNG\r\n\x1a\n", 8), "a.csv:1:1: error: found byte 0x89"},
    {"wrong unit", "# units: ft\n" + kPositions, "a.csv:1:10: error: found units 'ft'"},
    {"wrong up", "# up: x\n" + kPositions, "a.csv:1:7: error: found up 'x'"},
    {"rate of zero", "# rate_hz: 0\n" + kPositions, "a.csv:1:12: error: found rate '0'"},
    {"rate that is no number", "# rate_hz: fast\n" + kPositions, "a.csv:1:12: error: found 'fast'"},
    {"tip in mm", "# tip_m: 0,0,-350\n" + kPositions, "a.csv:1:14: error: found '-350'"},
    {"tip of two numbers", "# tip_m: 0,0\n" + kPositions, "a.csv:1:13: error: found the line's end"},
    {"tip of four numbers", "# tip_m: 0,0,0,0\n" + kPositions,
     "a.csv:1:15: error: found more than three numbers"},
    {"shaft without sign", "# shaft: z\n" + kPositions, "a.csv:1:10: error: found shaft 'z'"},
    {"repeated key", "# up: y\n# up: y\n" + kPositions, "a.csv:2:3: error: found key 'up' a second time"},
    {"misspelt key", "# unit: mm\n" + kPositions, "a.csv:1:3: error: found key 'unit'"},
    {"key in capitals", "# Units: mm\n" + kPositions, "a.csv:1:3: error: found key 'Units'"},
};

INSTANTIATE_TEST_SUITE_P(EveryKind, TraceErrors, testing::ValuesIn(kBad));

TEST(TraceErrors, LongFindingsAreCutAndHostileNamesStayOnOneLine) {
    const std::string message = message_for(kPositions + "0,a," + std::string(5000, '7') + "x,2,3\n");
    EXPECT_LT(message.size(), 250u);
    try {
        (void)parse_trace("", "bad\nname.csv");
        FAIL();
    } catch (const TraceError& error) {
        EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos);
    }
}

std::string message_for_file(const std::filesystem::path& file) {
    try {
        (void)read_trace(file);
        return "read";
    } catch (const TraceError& error) {
        return error.what();
    }
}

TEST(TraceErrors, DirectoryMissingAndEmptyFilesAreNamedWithAPlace) {
    const std::filesystem::path folder = std::filesystem::path(testing::TempDir());
    const std::filesystem::path empty = folder / "musicworld_empty_trace.csv";
    std::ofstream(empty).close();
    EXPECT_TRUE(
        message_for_file(empty).starts_with(empty.string() + ":1:1: error: found an empty file, expected "));
    std::filesystem::remove(empty);
    EXPECT_TRUE(message_for_file(empty).starts_with(
        empty.string() + ":1:1: error: found No such file or directory, expected "));
    EXPECT_TRUE(
        message_for_file(folder).starts_with(folder.string() + ":1:1: error: found a directory, expected "));
}

}  // namespace
}  // namespace tracking
