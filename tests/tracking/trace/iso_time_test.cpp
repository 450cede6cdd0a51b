#include "trace/iso_time.h"

#include <gtest/gtest.h>

#include "tracking/import.h"

namespace tracking {
namespace {

TEST(IsoTime, DatesZonesAndFractionsAreRead) {
    const struct {
        const char* text;
        std::int64_t whole_s;
        double fraction_s;
        IsoTime::Form form;
    } cases[] = {
        {"1970-01-01T00:00:00Z", 0, 0, IsoTime::Form::zoned},
        {"2026-05-01T12:00:00", 1777636800, 0, IsoTime::Form::local},
        {"2026-05-01 12:00:00.25", 1777636800, 0.25, IsoTime::Form::local},
        {"2026-05-01t14:00:00,5+02:00", 1777636800, 0.5, IsoTime::Form::zoned},
        {"20260501T063000.125-0530", 1777636800, 0.125, IsoTime::Form::zoned},
        {"2026-05-01T13:00:00+01", 1777636800, 0, IsoTime::Form::zoned},
        {"2024-02-29T23:59:60Z", 1709251200, 0, IsoTime::Form::zoned},
        {"12:34:56.789012345678", 45296, 0.789012345678, IsoTime::Form::time_of_day},
    };
    for (const auto& c : cases) {
        const std::optional<IsoTime> time = iso_time(c.text);
        ASSERT_TRUE(time) << c.text;
        EXPECT_EQ(time->whole_s, c.whole_s) << c.text;
        EXPECT_DOUBLE_EQ(time->fraction_s, c.fraction_s) << c.text;
        EXPECT_EQ(time->form, c.form) << c.text;
    }
    for (const char* none : {"",
                             "12",
                             "1.5",
                             "1777636800",
                             "2026-05-01",
                             "2026-13-01T00:00:00",
                             "2026-02-30T00:00:00",
                             "2026-05-01T24:00:00",
                             "2026-05-01T12:60:00",
                             "2026-05-01T12:00",
                             "2026-05-01T12:00:00.",
                             "2026-05-01T12:00:00+",
                             "2026-05-01T12:00:00Z1",
                             "2026-05-01T12:00:00+02:",
                             "12:00:00Z",
                             "12:0:00",
                             "2026-0501T12:00:00",
                             "-026-05-01T12:00:00",
                             "2026-05-01T12:00:-1",
                             "1e5:00:00"})
        EXPECT_FALSE(iso_time(none)) << none;
}

Trace read(const std::string& rows, char separator = ',') {
    ColumnMap map;
    map.columns = {{"t", "time"}, {"px", "x"}, {"py", "y"}, {"pz", "z"}};
    map.separator = separator, map.decimal_comma = separator == ';';
    const std::string s(1, separator);
    return read_tables({{"time" + s + "x" + s + "y" + s + "z\n" + rows, "iso.csv"}}, map);
}

TEST(IsoTime, ATablesTimesCountFromItsFirstRowWhateverTheirZones) {
    const Trace trace = read(
        "2026-05-01T23:59:59.999999Z,0,0,0\n2026-05-02T02:00:00.000001+02:00,0,0,0\n"
        "2026-05-02T00:00:01Z,0,0,0\n");
    ASSERT_EQ(trace.sticks[0].samples.size(), 3u);
    EXPECT_EQ(trace.sticks[0].samples[0].t_s, 0);
    EXPECT_NEAR(trace.sticks[0].samples[1].t_s, 2e-6, 1e-15)
        << "microseconds of the year 2026 keep nine digits";
    EXPECT_NEAR(trace.sticks[0].samples[2].t_s, 1.000001, 1e-15);
}

TEST(IsoTime, CommasSeparateFractionsWhereSemicolonsSeparateColumns) {
    const Trace trace = read("\"10:00:00,5\";1,5;-0,25;2\n10:00:01,75;1;2;3\n", ';');
    EXPECT_EQ(trace.sticks[0].samples[1].t_s, 1.25);
    EXPECT_EQ(trace.sticks[0].samples[0].position, Eigen::Vector3d(1.5, -0.25, 2));
}

TEST(IsoTime, TimesOfTwoKindsInOneTableAreRefusedAtTheirPlace) {
    for (const char* rows :
         {"2026-05-01T12:00:00Z,0,0,0\n2026-05-01T12:00:01,0,0,0\n", "12:00:00,0,0,0\n1.5,0,0,0\n",
          "1.5,0,0,0\n12:00:00,0,0,0\n", "12:00:00,0,0,0\n2026-05-01T12:00:01Z,0,0,0\n",
          "12:00:01,0,0,0\n12:00:00,0,0,0\n"}) {
        try {
            (void)read(rows);
            ADD_FAILURE() << rows;
        } catch (const TraceError& error) {
            EXPECT_TRUE(std::string(error.what()).starts_with("iso.csv:3:1: error: found ")) << error.what();
        }
    }
}

}  // namespace
}  // namespace tracking
