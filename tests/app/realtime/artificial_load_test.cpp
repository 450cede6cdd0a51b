#include "realtime/artificial_load.h"

#include <gtest/gtest.h>

#include "files/bad_input.h"
#include "process/clock.h"

namespace {

TEST(ArtificialLoad, PartsAreReadInAnyOrder) {
    const app::ArtificialLoad d = app::parse_artificial_load("renderer:20@30-40,load:2@10,stall:100@5.5");
    EXPECT_EQ(d.load.amount, 2);
    EXPECT_EQ(d.load.from_s, 10);
    EXPECT_GT(d.load.to_s, 1e9);
    EXPECT_EQ(d.slower_at(29.9), 0);
    EXPECT_EQ(d.slower_at(30), 0.020);
    EXPECT_EQ(d.slower_at(40), 0);
    EXPECT_EQ(d.stall.amount, 100);
    EXPECT_EQ(d.stall.from_s, 5.5);
}

TEST(ArtificialLoad, WhatIsNoneIsRefused) {
    for (const char* text : {"load", "load:2", "load@3", "load:0@1", "load:x@1", "rain:2@3", "load:2@5-4",
                             "load:1e9@1", "renderer:-1@2", "stall:nan@1", ":@", "load:2@-1"})
        EXPECT_THROW((void)app::parse_artificial_load(text), app::BadInput) << text;
}

TEST(ArtificialLoad, BusyThreadsEndWithTheirObject) {
    const std::int64_t start = app::monotonic_ns();
    { const app::BusyThreads busy(app::parse_artificial_load("load:2@0"), start); }
    { const app::BusyThreads asleep(app::parse_artificial_load("load:2@1000"), start); }
    // Asleep ones look every 5 ms; seconds would mean that they were waited for.
    EXPECT_LT(app::to_s(app::monotonic_ns() - start), 5);
}

}  // namespace
