#include "compare/entrants.h"

#include <gtest/gtest.h>

#include <set>

#include "compare/comparison.h"
#include "sample_recordings.h"

namespace {

tracking::SensorModel noisy_sensor() {
    tracking::SensorModel sensor;
    sensor.rate_hz = 60;
    sensor.noise_m = 0.002;
    return sensor;
}

/// A stick at rest: the longer the average, the better.
tracking::PoseSample still(double) {
    tracking::PoseSample pose;
    pose.position = {0, 1, 0};
    return pose;
}

/// 20 m back and forth twice a second: the shorter the average, the better.
tracking::PoseSample fast(double t_s) {
    tracking::PoseSample pose = sample::sine(2 * t_s);
    pose.position.x() *= 100;
    return pose;
}

app::ComparisonOptions options_of(std::vector<std::string> predictors) {
    app::ComparisonOptions options;
    options.predictors = std::move(predictors);
    options.leads_s = {1.0 / 30};
    options.sensor = noisy_sensor();
    return options;
}

app::EntrantList entrants_of(const std::vector<app::Recording>& recordings,
                             const app::ComparisonOptions& options) {
    return app::enter(options, {recordings, app::sense_all(recordings, options.sensor, options.leads_s)}, {});
}

const app::Entrant& named(const app::EntrantList& list, const std::string& name) {
    for (const app::Entrant& entrant : list.entrants)
        if (entrant.name == name) return entrant;
    throw std::out_of_range(name);
}

bool has(const app::EntrantList& list, const std::string& name) {
    return std::any_of(list.entrants.begin(), list.entrants.end(),
                       [&](const app::Entrant& entrant) { return entrant.name == name; });
}

TEST(Tuning, EveryCandidateOfEveryGridIsAPredictorAndOnlyThere) {
    for (const std::string& family : tracking::predictor_names()) {
        std::set<std::string> different;
        for (const std::string& candidate : app::tuning_grid(family)) {
            EXPECT_NO_THROW((void)tracking::make_predictor(candidate)) << candidate;
            EXPECT_EQ(app::family_of(candidate), family);
            EXPECT_TRUE(different.insert(candidate).second) << candidate << " twice";
        }
    }
    EXPECT_TRUE(app::tuning_grid("hold").empty());
    EXPECT_TRUE(app::tuning_grid("no such predictor").empty());
    EXPECT_GT(app::tuning_grid("cv").size(), 5U);
}

TEST(Tuning, ParametersComeFromTheOtherRecordingsNotFromTheOneScored) {
    const std::vector<app::Recording> recordings = {sample::recording_of(still, 6, 250, "/none/still.csv"),
                                                    sample::recording_of(fast, 6, 250, "/none/fast.csv")};
    const app::Entrant tuned = named(entrants_of(recordings, options_of({"naive"})), "naive*");
    EXPECT_EQ(tuned.used[0][0], "naive:n=1");   // the stick at rest runs what the fast one chose
    EXPECT_EQ(tuned.used[1][0], "naive:n=16");  // and the other way round
    EXPECT_TRUE(tuned.baseline);
}

TEST(Tuning, WithTwoPersonsASecondOneIsTunedOnOtherPersonsOnly) {
    const std::vector<app::Recording> recordings = {
        sample::recording_of(still, 6, 250, "/none/a1.csv", "Ann"),
        sample::recording_of(still, 5, 250, "/none/a2.csv", "Ann"),
        sample::recording_of(fast, 6, 250, "/none/b1.csv", "Ben"),
        sample::recording_of(fast, 5, 250, "/none/b2.csv", "Ben")};
    const app::EntrantList list = entrants_of(recordings, options_of({"naive"}));
    EXPECT_EQ(named(list, "naive**").used[0][0], "naive:n=1");
    EXPECT_EQ(named(list, "naive**").used[2][0], "naive:n=16");
    EXPECT_EQ(named(list, "naive*").used[2][0], "naive:n=1");  // b2 outweighs the sticks at rest
}

TEST(Tuning, OneRecordingAloneTunesNothingAndSaysSo) {
    const std::vector<app::Recording> recordings = {sample::recording_of(fast, 6, 250)};
    const app::EntrantList list = entrants_of(recordings, options_of({"cv"}));
    EXPECT_FALSE(has(list, "cv*"));
    EXPECT_NE(list.tuned_on.find("nothing is tuned"), std::string::npos);
}

TEST(Tuning, TheBaselinesTakePartUnasked) {
    const std::vector<app::Recording> recordings = {sample::recording_of(fast, 6, 250)};
    const app::EntrantList list = entrants_of(recordings, options_of({"cv", "cv"}));
    EXPECT_TRUE(has(list, "naive"));
    EXPECT_TRUE(has(list, "difference"));
    EXPECT_TRUE(named(list, "difference").baseline);
    EXPECT_FALSE(named(list, "cv").baseline);
    EXPECT_EQ(std::count_if(list.entrants.begin(), list.entrants.end(),
                            [](const app::Entrant& entrant) { return entrant.name == "cv"; }),
              1);
}

TEST(ComparisonMap, TheSameWithOneThreadAndWithThreeAndTheFilterPaysInNoise) {
    std::vector<app::Recording> recordings;
    for (int i = 0; i < 3; ++i)
        recordings.push_back(
            sample::recording_of(sample::sine, 6, 250, "/none/" + std::to_string(i) + ".csv"));
    app::ComparisonOptions options = options_of({"difference", "cv"});
    const app::MapAxes axes = {{60}, {0.1, 10}, {0, 3}, {0}};
    const auto one = app::map_sensors(recordings, options, axes);
    options.threads = 3;
    const auto three = app::map_sensors(recordings, options, axes);
    ASSERT_EQ(one.size(), three.size());
    ASSERT_EQ(one.size(), 4U);  // cv* at each of four sensors
    for (std::size_t i = 0; i < one.size(); ++i) {
        EXPECT_EQ(one[i].result.predictor, "cv*");
        EXPECT_EQ(one[i].result.rms_mm, three[i].result.rms_mm);
        EXPECT_EQ(one[i].result.by_recording.low, three[i].result.by_recording.low);
    }
    // Two points 1/30 s ahead at 60 Hz are 3 z_k - 2 z_(k-1): sqrt 13 times the noise on each of three axes.
    EXPECT_EQ(one[2].noise_mm, 10);
    EXPECT_LT(one[2].result.rms_mm, 0.6 * std::sqrt(13.0 * 3) * 10);
}

}  // namespace
