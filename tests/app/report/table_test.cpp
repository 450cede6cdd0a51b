#include "report/table.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <random>
#include <string>

namespace {

using app::Cell;
using app::Table;
using Json = nlohmann::ordered_json;

Table sample() {
    Table table = Table::of({"predictor", "RMS:.2f:mm", "predictions:d"});
    table.add({"cv", 3.14159, 12});
    table.add({"singer:alpha=2", {}, std::size_t{0}});
    return table;
}

TEST(Table, AsTextIsAlignedWithUnitsNumbersToTheRightAndADashForNone) {
    EXPECT_EQ(sample().text(),
              "predictor       RMS mm  predictions\n"
              "cv                3.14           12\n"
              "singer:alpha=2       -            0\n");
}

TEST(Table, AsTextCountsCharactersNotBytes) {
    Table table = Table::of({"name", "n:d"});
    table.add({"\xc3\xa4\xe2\x80\x93", 1});
    table.add({"ab", 2});
    EXPECT_EQ(table.text(), "name  n\n\xc3\xa4\xe2\x80\x93    1\nab    2\n");
}

TEST(Table, AsCsvHasEmptyFieldsForNoneAndBareNames) {
    EXPECT_EQ(sample().csv(), "predictor,RMS,predictions\ncv,3.14159,12\nsinger:alpha=2,,0\n");
}

TEST(Table, AsCsvQuotesWhatNeedsIt) {
    EXPECT_EQ(app::csv_line({"plain", "a,b", "say \"x\"", "two\nlines", "car\rriage", ""}),
              "plain,\"a,b\",\"say \"\"x\"\"\",\"two\nlines\",\"car\rriage\",\n");
}

TEST(Table, NumbersOfCsvReadBackToTheSameDouble) {
    std::mt19937_64 random(11);
    for (int i = 0; i < 1000; ++i) {
        const double value =
            std::ldexp(static_cast<double>(random()), static_cast<int>(random() % 1800) - 960);
        EXPECT_EQ(std::stod(Cell(value).plain()), value);
    }
    for (const double value : {0.1, 1.0 / 3, -0.0, 1e-300, std::numeric_limits<double>::max()})
        EXPECT_EQ(std::stod(Cell(value).plain()), value);
    EXPECT_EQ(Cell(std::int64_t{-9'007'199'254'740'993}).plain(), "-9007199254740993");
}

TEST(Table, NotANumberAndAnEmptyOptionalAreNone) {
    EXPECT_TRUE(Cell(std::nan("")).none());
    EXPECT_TRUE(Cell(std::optional<double>()).none());
    EXPECT_TRUE(Cell(std::optional<double>(std::nan(""))).none());
    EXPECT_FALSE(Cell(std::optional<int>(0)).none());
    EXPECT_FALSE(Cell("").none());
    EXPECT_TRUE(Cell(std::nan("")).json().is_null());
}

TEST(Table, AsHtmlIsEscapedWithNumbersToTheRight) {
    Table table = Table::of({"name", "error:.1f:%"});
    table.add({"<b>&", 0.25});
    table.add({std::string(61, 'x'), {}});
    EXPECT_EQ(table.html(),
              "<div class=scroll><table class=wide><tr><th>name<th class=n>error %</tr>\n"
              "<tr><td>&lt;b&gt;&amp;<td class=n>0.2</tr>\n"
              "<tr><td class=text>" +
                  std::string(61, 'x') + "<td class=n>\xe2\x80\x93</tr>\n</table></div>\n");
}

TEST(Table, AsJsonHasAnObjectPerRowAndNullForNone) {
    Table table = Table::of({"name", "flag", "hits/true", "hits/f1", "n"});
    table.add({"a", true, 3, 0.5, 1});
    table.add({"b", false, 0, std::nan(""), 2});
    table.add({"c", false, {}, {}, 3});
    EXPECT_EQ(table.json().dump(), R"([{"name":"a","flag":true,"hits":{"true":3,"f1":0.5},"n":1},)"
                                   R"({"name":"b","flag":false,"hits":{"true":0,"f1":null},"n":2},)"
                                   R"({"name":"c","flag":false,"hits":null,"n":3}])");
    EXPECT_EQ(table.csv(), "name,flag,true,f1,n\na,1,3,0.5,1\nb,0,0,,2\nc,0,,,3\n");
}

TEST(Table, APartLeavesOutRowsWithoutValues) {
    Table table;
    for (const bool struck : {true, false, true})
        table.add_figures({{"predictor", "cv"},
                           {"external", false, false},
                           {"hits/f1:.3f", struck ? Cell(0.5) : Cell()},
                           {"hits/p95_ms:.1f", {}},
                           {"rms_mm:.2f", 4.0}});
    EXPECT_EQ(table.part({"predictor", "hits/p95_ms", "hits/f1"}).text(),
              "predictor  p95 ms     f1\ncv              -  0.500\ncv              -  0.500\n");
    EXPECT_EQ(table.part({"predictor", "hits/p95_ms"}).text(), "");
    EXPECT_EQ(table.csv(), "predictor,f1,p95_ms,rms_mm\ncv,0.5,,4\ncv,,,4\ncv,0.5,,4\n");
    EXPECT_EQ(table.json()[1].dump(), R"({"predictor":"cv","external":false,"hits":null,"rms_mm":4.0})");
}

TEST(Table, HeadingsOfTheSameNameSayToWhichObjectTheyBelong) {
    Table table = Table::of({"n:d", "by_recording/low:.1f", "by_person/low:.1f", "by_person/high:.1f"});
    table.add({3, 0.1, 0.2, 0.3});
    EXPECT_EQ(table.text(),
              "n  by recording low  by person low  high\n3               0.1            0.2   0.3\n");
}

TEST(Table, WithoutRowsIsNothingToReadersAndAHeaderInAFile) {
    const Table table = Table::of({"a", "b"});
    EXPECT_EQ(table.text(), "");
    EXPECT_EQ(table.html(), "");
    EXPECT_EQ(table.csv(), "a,b\n");
    EXPECT_EQ(table.json(), Json::array());
}

}  // namespace
