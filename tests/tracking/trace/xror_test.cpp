#include <bson/bson.h>
#include <fpzip.h>
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <cmath>
#include <csignal>
#include <fstream>
#include <functional>

#include "mutation.h"
#include "tracking/trace.h"

namespace tracking {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

template <class Number>
std::string compressed(const std::vector<std::vector<Number>>& rows, int type = FPZIP_TYPE_FLOAT) {
    std::vector<Number> flat;
    for (const auto& row : rows) flat.insert(flat.end(), row.begin(), row.end());
    std::string out(1024 + 8 * flat.size(), '\0');
    FPZ* stream = fpzip_write_to_buffer(out.data(), out.size());
    stream->type = type, stream->prec = 0, stream->nz = stream->nf = 1;
    stream->nx = static_cast<int>(rows[0].size()), stream->ny = static_cast<int>(rows.size());
    EXPECT_NE(fpzip_write_header(stream), 0);
    const std::size_t size = fpzip_write(stream, flat.data());
    EXPECT_GT(size, 0u);
    fpzip_write_close(stream);
    out.resize(size);
    return out;
}

struct DeviceText {
    const char *name, *type, *joint;
    std::vector<std::string> axes{"x", "y", "z", "i", "j", "k", "1"};
};

std::string bytes_of(bson_t* document) {
    std::string bytes(reinterpret_cast<const char*>(bson_get_data(document)), document->len);
    bson_destroy(document);
    return bytes;
}

/// As the format's page and schema describe it (github.com/MetaGuard/xror).
std::string recording(const std::vector<DeviceText>& devices, const std::string& frames,
                      const char* application = "Drums", bool events = true) {
    bson_t* list = bson_new();
    for (std::size_t i = 0; i < devices.size(); ++i) {
        bson_t* axes = bson_new();
        for (std::size_t k = 0; k < devices[i].axes.size(); ++k)
            BSON_APPEND_UTF8(axes, std::to_string(k).c_str(), devices[i].axes[k].c_str());
        bson_t* device = BCON_NEW("name", BCON_UTF8(devices[i].name), "type", BCON_UTF8(devices[i].type),
                                  "joint", BCON_UTF8(devices[i].joint), "axes", BCON_ARRAY(axes));
        BSON_APPEND_DOCUMENT(list, std::to_string(i).c_str(), device);
        bson_destroy(axes);
        bson_destroy(device);
    }
    bson_t* document =
        BCON_NEW("$schema", BCON_UTF8("https://metaguard.github.io/xror/schema/v1.0.0/schema.json"), "info",
                 "{", "timestamp", BCON_DATE_TIME(1681105392000), "hardware", "{", "devices",
                 BCON_ARRAY(list), "}", "software", "{", "app", "{", "name", BCON_UTF8(application), "}", "}",
                 "user", "{", "name", BCON_UTF8("somebody"), "}", "}");
    bson_destroy(list);
    BSON_APPEND_BINARY(document, "frames", BSON_SUBTYPE_BINARY,
                       reinterpret_cast<const std::uint8_t*>(frames.data()),
                       static_cast<std::uint32_t>(frames.size()));
    if (events) {
        bson_t* kinds =
            BCON_NEW("events", "[", "{", "name", BCON_UTF8("Good Cut"), "floatData",
                     BCON_BIN(BSON_SUBTYPE_BINARY, reinterpret_cast<const std::uint8_t*>("ab"), 2), "}", "]");
        bson_concat(document, kinds);
        bson_destroy(kinds);
    }
    return bytes_of(document);
}

const std::vector<DeviceText> kPlayer = {{"quest", "HMD", "HEAD"},
                                         {"touch left", "CONTROLLER", "HAND_LEFT"},
                                         {"touch right", "CONTROLLER", "HAND_RIGHT"}};

std::vector<float> frame(float t, float x = 0.25F) {
    return {t, 0, 1.7F, 0, 0, 0, 0, 1, -0.25F, 1, 0.5F, 0, 0.6F, 0, 0.8F, x, 1, 0.5F, 0.8F, 0, 0, 0.6F};
}

std::string frames(const std::vector<float>& times) {
    std::vector<std::vector<float>> rows;
    for (const float t : times) rows.push_back(frame(t));
    return compressed(rows);
}

void expect_refused(const std::string& bytes, const std::string& found) {
    try {
        (void)parse_trace(bytes, "fuzz.xror");
        ADD_FAILURE() << "read: " << found;
    } catch (const TraceError& error) {
        expect_located(error.what());
        EXPECT_TRUE(std::string(error.what()).starts_with("fuzz.xror:byte ")) << error.what();
        EXPECT_NE(std::string(error.what()).find(found), std::string::npos) << error.what();
    }
}

TEST(Xror, HandsAreMirroredFromUnitysAxes) {
    const Trace trace = parse_trace(recording(kPlayer, frames({0, 0.5F, 1})), "a.xror");
    ASSERT_EQ(trace.sticks.size(), 2u);
    EXPECT_EQ(trace.sticks[0].name, "left");
    EXPECT_EQ(trace.sticks[1].name, "right");
    ASSERT_EQ(trace.sticks[1].samples.size(), 3u);
    const PoseSample &left = trace.sticks[0].samples[1], &right = trace.sticks[1].samples[2];
    EXPECT_EQ(left.t_s, 0.5);
    EXPECT_EQ(left.position, Vector3d(-0.25, 1, -0.5)) << "(x, y, z) becomes (x, y, -z)";
    EXPECT_LT((left.orientation.coeffs() - Quaterniond(0.8, 0, -0.6, 0).coeffs()).norm(), 1e-7)
        << "(w, x, y, z) becomes (w, -x, -y, z); floats";
    EXPECT_LT((right.orientation.coeffs() - Quaterniond(0.6, -0.8, 0, 0).coeffs()).norm(), 1e-7);
    EXPECT_EQ(trace.shaft, -Vector3d::UnitZ());
    EXPECT_FALSE(trace.tip);
    EXPECT_EQ(trace.source, "Extended Reality Open Recording, Drums");
    EXPECT_EQ(trace.remarks, (std::vector<std::string>{"left out 1 of 3 devices",
                                                       "left out 1 kinds of events: 'Good Cut'"}));
    EXPECT_EQ(parse_trace(recording(kPlayer, frames({0, 1}), "Beat Saber"), "a.xror").tip,
              Vector3d(0, 0, -0.35));
}

TEST(Xror, FillersRepeatedFramesTheStartUpAndUntrackedPosesAreLeftOut) {
    std::vector<std::vector<float>> rows = {frame(0, 40), frame(0.1F), frame(0.1F), frame(0.2F), frame(0.3F)};
    std::fill(rows[3].begin() + 8, rows[3].begin() + 15, 0.0F);
    rows.resize(7, std::vector<float>(22, -1));
    const Trace trace = parse_trace(recording(kPlayer, compressed(rows), "Drums", false), "a.xror");
    EXPECT_EQ(trace.sticks[0].samples.size(), 2u);
    EXPECT_EQ(trace.sticks[1].samples.size(), 3u);
    ASSERT_EQ(trace.remarks.size(), 4u);
    EXPECT_EQ(trace.remarks[1], "left out 1 frames not later than the ones before");
    EXPECT_EQ(trace.remarks[2], "left out 1 frames of the start-up, before 0.100000 s");
    EXPECT_EQ(trace.remarks[3], "left out 1 frames in which left was not tracked");
}

TEST(Xror, WithoutHandsOtherDevicesBecomeSticksOfTheirNames) {
    const std::vector<DeviceText> devices = {{"", "HMD", "HEAD"},
                                             {"my stick", "TRACKER", "", {"p", "z", "y", "x"}},
                                             {"pedal", "OTHER", "", {"force"}}};
    std::vector<std::vector<float>> rows;
    for (int k = 0; k < 3; ++k) rows.push_back({static_cast<float>(k), 0, 0, 0, 0, 0, 0, 1, 9, 3, 2, 1, 5});
    const Trace trace = parse_trace(recording(devices, compressed(rows)), "a.xror");
    ASSERT_EQ(trace.sticks.size(), 1u);
    EXPECT_EQ(trace.sticks[0].name, "my_stick");
    EXPECT_EQ(trace.sticks[0].samples[0].position, Vector3d(1, 2, -3));
    EXPECT_FALSE(trace.sticks[0].samples[0].has_orientation);
}

TEST(Xror, EachDeviceGetsANameOfItsOwn) {
    const std::vector<std::string> axes{"x", "y", "z"};
    const std::vector<DeviceText> devices = {{"device2", "", "", axes}, {"", "", "", axes}};
    std::vector<std::vector<float>> rows;
    for (int k = 0; k < 4; ++k) rows.push_back({static_cast<float>(k), 1, 2, 3, 4, 5, 6});
    const Trace trace = parse_trace(recording(devices, compressed(rows)), "a.xror");
    ASSERT_EQ(trace.sticks.size(), 2u);
    EXPECT_EQ(trace.sticks[0].name, "device2");
    EXPECT_EQ(trace.sticks[1].name, "device3");
}

TEST(Xror, ABrokenMemberIsRefusedWithThePlaceOfItsValue) {
    std::string bytes = recording(kPlayer, frames({0, 0.5F, 1}));
    const std::size_t value = bytes.find("joint") + 6;  // of the first device: a document in documents
    bytes[value + 3] = 0x7F;                            // the length of its text
    expect_refused(bytes, ":byte " + std::to_string(value) + ": error: found a broken member");
}

TEST(Xror, TablesOfMoreValuesThanTheirBytesCanHoldAreRefused) {
    const std::string block = compressed(std::vector<std::vector<float>>(3000, std::vector<float>(22, 1)));
    ASSERT_LT(block.size(), 200u) << "equal rows: a table of few bytes may claim gigabytes";
    expect_refused(recording(kPlayer, block),
                   "a table of 3000 rows of 22 floats, expected a table of at most " +
                       std::to_string(64 * block.size()) + " floats");
}

/// A few of these make fpzip loop for ever: the limit of time holds whatever the caller blocks.
TEST(Xror, EndlessTablesAreGivenUpAlsoWhereTheirSignalIsBlocked) {
    const std::string whole = frames({0, 0.5F, 1});
    std::mt19937 random(1);
    sigset_t blocked, before;
    sigemptyset(&blocked);
    sigaddset(&blocked, SIGPROF);
    ASSERT_EQ(pthread_sigmask(SIG_BLOCK, &blocked, &before), 0);
    for (int i = 0; i < 300; ++i) {
        std::string damaged = whole;
        for (int edits = 0; edits < 2; ++edits)
            damaged[25 + random() % (damaged.size() - 25)] = static_cast<char>(random());
        try {
            expect_valid(parse_trace(recording(kPlayer, damaged), "fuzz.xror"));
        } catch (const TraceError& error) {
            expect_located(error.what());
        }
    }
    ASSERT_EQ(pthread_sigmask(SIG_SETMASK, &before, nullptr), 0);
}

#ifndef MUSICWORLD_SANITIZED  // sanitizers need more memory than is left here
TEST(Xror, TooLittleMemoryForATableIsAnErrorWithItsPlace) {
    const std::string bytes = recording(kPlayer, std::string(100000, 'x'));  // up to 25.6 MB of floats
    const auto run = [&bytes] {
        std::size_t pages = 0;
        std::ifstream("/proc/self/statm") >> pages;
        const rlim_t memory = pages * 4096 + (rlim_t{8} << 20);
        const rlimit limit{memory, memory};
        (void)setrlimit(RLIMIT_AS, &limit);
        try {
            (void)parse_trace(bytes, "fuzz.xror");
        } catch (const TraceError& error) {
            std::fprintf(stderr, "%s\n", error.what());
            std::_Exit(3);
        }
        std::_Exit(4);
    };
    EXPECT_EXIT(run(), testing::ExitedWithCode(3),
                "fuzz.xror:byte [0-9]+: error: found no memory for the 6400000");
}
#endif

TEST(Xror, WhatIsNoRecordingIsRefusedWithItsPlace) {
    const std::string whole = recording(kPlayer, frames({0, 0.5F, 1}));
    expect_refused(whole.substr(0, whole.size() - 1), "a document of another length");
    expect_refused(recording({kPlayer[1]}, frames({0, 1})), "frames of 22 numbers, expected the time and");
    expect_refused(recording({kPlayer[0]}, frames({0, 1})), "no device with axes x, y and z");
    expect_refused(recording(kPlayer, "no floats at all"), "floats that are not fpzip's");
    expect_refused(recording(kPlayer, ""), "no floats");
    const std::string block = frames({0, 0.5F, 1});
    expect_refused(recording(kPlayer, block.substr(0, block.size() / 2)), "floats that end too soon");
    expect_refused(
        recording(kPlayer, compressed(std::vector<std::vector<double>>(3, std::vector<double>(22, 1)),
                                      FPZIP_TYPE_DOUBLE)),
        "no table of floats");
    std::vector<std::vector<float>> rows = {frame(0), frame(1)};
    rows[1][8] = NAN;
    expect_refused(recording(kPlayer, compressed(rows)), "a position that is no number");
    rows[1] = frame(1);
    rows[1][11] = 3;
    expect_refused(recording(kPlayer, compressed(rows)), "a quaternion of length 3.1");
    rows[1] = frame(NAN);
    expect_refused(recording(kPlayer, compressed(rows)), "a time that is no number");
    expect_refused(recording(kPlayer, compressed(std::vector<std::vector<float>>(3, frame(1)))),
                   "1 poses of 'left'");
}

/// libfpzip alone, given such bytes, reads and writes beyond its tables: the child that runs it may die of that, never
/// the program.
TEST(Xror, DamagedRecordingsAreReadOrRefusedWithTheirPlace) {
    std::vector<float> times;
    for (int k = 0; k < 100; ++k) times.push_back(static_cast<float>(k) / 90);
    const std::string whole = recording(kPlayer, frames(times));
    std::mt19937 random(6);
    Outcomes outcomes;
    for (int i = 0; i < 60; ++i) {
        std::string damaged = whole;
        for (int edits = 0; edits < 3; ++edits)
            damaged[16 + random() % (damaged.size() - 16)] = static_cast<char>(random());
        try {
            expect_valid(parse_trace(damaged, "fuzz.xror"));
            ++outcomes.read;
        } catch (const TraceError& error) {
            expect_located(error.what());
            ++outcomes.refused;
        }
    }
    EXPECT_GT(outcomes.refused, 10);
}

}  // namespace
}  // namespace tracking
