#include "traces/predict.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <stdexcept>

#include "files/bad_input.h"
#include "sticks/prediction_file.h"
#include "sticks/predictors.h"
#include "temporary_folder.h"

namespace {

using Eigen::Vector3d;
using tracking::PoseSample;

/// Two sticks at different rates; the first turns, the second is a position only.
tracking::Trace two_sticks() {
    tracking::Trace trace;
    trace.sticks = {{"left", {}}, {"right", {}}};
    for (int i = 0; i < 50; ++i) {
        PoseSample sample;
        sample.t_s = 12.3 + i / 60.0;
        sample.position = {std::sin(0.3 * i), 1.0 / 3, 0.1 * i};
        sample.orientation = Eigen::AngleAxisd(0.2 * i, Vector3d::UnitY());
        sample.has_orientation = true;
        trace.sticks[0].samples.push_back(sample);
    }
    for (int i = 0; i < 20; ++i) {
        PoseSample sample;
        sample.t_s = 12.31 + i / 25.0;
        sample.position = {std::cos(0.3 * i), 2.0 / 3, 0};
        trace.sticks[1].samples.push_back(sample);
    }
    return trace;
}

TEST(Predict, WritesWhatThePredictorSaysAfterEachSampleFromTheSecondOn) {
    const tracking::Trace trace = two_sticks();
    constexpr double kLead = 1.0 / 15;
    const tracking::Trace rows =
        tracking::parse_trace(app::predict_table(trace, "ca:q=1e8", kLead), "predictions");
    ASSERT_EQ(rows.sticks.size(), 2U);
    for (std::size_t s = 0; s < 2; ++s) {
        const std::vector<PoseSample>& samples = trace.sticks[s].samples;
        const auto found =
            std::find_if(rows.sticks.begin(), rows.sticks.end(),
                         [&](const tracking::StickTrace& r) { return r.name == trace.sticks[s].name; });
        ASSERT_NE(found, rows.sticks.end());
        ASSERT_EQ(found->samples.size(), samples.size() - 1);
        const auto predictor = tracking::make_predictor("ca:q=1e8");
        for (std::size_t i = 0; i < samples.size(); ++i) {
            (void)predictor->correct(samples[i]);
            if (i == 0) continue;
            const PoseSample& row = found->samples[i - 1];
            const tracking::PosePrediction expected = predictor->predict(kLead);
            EXPECT_EQ(row.t_s, samples[i].t_s + kLead);
            EXPECT_EQ(row.position, expected.position) << "numbers read back to the same double";
            EXPECT_EQ(row.has_orientation, s == 0);
            // The reader normalises quaternions, which rounds them.
            if (s == 0) {
                EXPECT_LT(
                    (row.orientation.toRotationMatrix() - expected.orientation.toRotationMatrix()).norm(),
                    1e-14);
            }
        }
    }
}

TEST(Predict, RowsAreInOrderOfTimeAndPositionOnlySticksLeaveTheQuaternionEmpty) {
    const std::string text = app::predict_table(two_sticks(), "hold", 0.05);
    EXPECT_TRUE(text.starts_with("t,stick,px,py,pz,qw,qx,qy,qz\n"));
    double before = 0;
    std::map<char, int> empty;
    for (std::size_t at = text.find('\n') + 1; at < text.size(); at = text.find('\n', at) + 1) {
        const double t = std::stod(text.substr(at));
        EXPECT_GE(t, before);
        before = t;
        const std::string line = text.substr(at, text.find('\n', at) - at);
        const char stick = line[line.find(',') + 1];
        if (line.ends_with(",,,,")) ++empty[stick];
    }
    EXPECT_EQ(empty['r'], 19);
    EXPECT_EQ(empty['l'], 0);
}

TEST(Predict, AutoIsThePicturesPredictor) {
    const tracking::Trace trace = two_sticks();
    EXPECT_EQ(app::predict_table(trace, "auto", 0.05),
              app::predict_table(trace, app::picture_specification("auto"), 0.05));
    EXPECT_NE(app::predict_table(trace, "auto", 0.05), app::predict_table(trace, "hold", 0.05));
}

TEST(Predict, LateAndRepeatedSamplesGetNoRowAndOutliersGetTheirOwnTime) {
    tracking::Trace trace;
    trace.sticks = {{"r", {}}};
    std::vector<PoseSample>& samples = trace.sticks[0].samples;
    for (const double t : {0.0, 0.01, 0.02, 0.02, 0.015, 0.03, 0.04}) {
        PoseSample sample;
        sample.t_s = t;
        sample.position = {t == 0.04 ? 9.0 : t, 0, 0};  // the last one is an outlier
        samples.push_back(sample);
    }
    const tracking::Trace rows = tracking::parse_trace(app::predict_table(trace, "cv:gate=5", 0.1), "rows");
    std::vector<double> times;
    for (const PoseSample& row : rows.sticks[0].samples) times.push_back(row.t_s);
    EXPECT_EQ(times, (std::vector<double>{0.01 + 0.1, 0.02 + 0.1, 0.03 + 0.1, 0.04 + 0.1}));
    const auto before = tracking::make_predictor("cv:gate=5");  // what it knew without the outlier
    for (const std::size_t i : {0, 1, 2, 5}) (void)before->correct(samples[i]);
    EXPECT_EQ(rows.sticks[0].samples.back().position, before->predict(0.04 + 0.1 - 0.03).position);
}

class PredictionFiles : public ::testing::Test {
protected:
    /// The file with one row changed: `line` counted from 1, empty: left out.
    std::string message_with(std::size_t line, const std::string& text, const char* stick = "left") {
        std::string rows = app::predict_table(trace_, "cv", 0.05);
        std::size_t at = 0;
        for (std::size_t i = 1; i < line; ++i) at = rows.find('\n', at) + 1;
        rows.replace(at, rows.find('\n', at) + 1 - at, text);
        const TemporaryFolder folder;
        const auto file = folder.write("predictions.csv", rows);
        try {
            (void)app::match_predictions(app::read_prediction_file(file), stick, trace_.sticks[0].samples);
        } catch (const std::runtime_error& error) {
            std::string message = error.what();
            const std::size_t name = message.find("predictions.csv");
            return name == std::string::npos ? message : message.substr(name);
        }
        return "nothing thrown";
    }

    const tracking::Trace trace_ = two_sticks();
};

TEST_F(PredictionFiles, ReplayExactlyAtTheirLeadAndOnTheStraightWayBefore) {
    constexpr double kLead = 1.0 / 15;
    const TemporaryFolder folder;
    const auto written = folder.write("p.csv", app::predict_table(trace_, "ca", kLead));
    const app::PredictionFile file = app::read_prediction_file(written);
    for (const tracking::StickTrace& stick : trace_.sticks) {
        app::StickPredictions predictions = app::match_predictions(file, stick.name, stick.samples);
        EXPECT_NEAR(predictions.lead_s, kLead, 1e-14);
        const double lead = predictions.lead_s;
        const auto replay = app::make_replay(std::move(predictions));
        const auto original = tracking::make_predictor("ca");
        std::size_t taken = 0;
        for (const PoseSample& sample : stick.samples) {
            EXPECT_EQ(replay->correct(sample), original->correct(sample));
            if (++taken < 2) continue;
            const tracking::PosePrediction a = replay->predict(lead), b = original->predict(kLead);
            EXPECT_EQ(a.position, b.position);
            EXPECT_LT((a.orientation.toRotationMatrix() - b.orientation.toRotationMatrix()).norm(), 1e-14);
            EXPECT_LT((replay->predict(0).position - sample.position).norm(), 1e-15);
            const Vector3d half = 0.5 * (sample.position + b.position);
            EXPECT_LT((replay->predict(lead / 2).position - half).norm(), 1e-14);
            EXPECT_LT((a.velocity - (b.position - sample.position) / lead).norm(), 1e-12);
        }
    }
}

TEST_F(PredictionFiles, EveryMismatchIsALocatedError) {
    EXPECT_EQ(message_with(1, "t,stick,px,py,pz,qw,qx,qy,qz\n"), "nothing thrown");
    EXPECT_NE(
        message_with(1, "t,stick,px,py,pz,qw,qx,qy,qz\n", "middle").find("no predictions of stick middle"),
        std::string::npos);
    EXPECT_EQ(message_with(3, "12.4,left,nan,0,0,1,0,0,0\n").find("predictions.csv:3:11: error: found"), 0U);
    EXPECT_EQ(message_with(3, "12.4,left,0,0\n").find("predictions.csv:3:"), 0U);
    const std::string one_more =
        message_with(1, "# units: m\n# note\nt,stick,px,py,pz,qw,qx,qy,qz\n12,left,0,0,0,,,,\n");
    EXPECT_NE(one_more.find("found 50 rows of stick left"), std::string::npos) << one_more;
    EXPECT_NE(one_more.find("expected 49"), std::string::npos) << one_more;
}

TEST_F(PredictionFiles, ALeadThatChangesIsRefusedWhereItDoes) {
    std::string rows = "# first: a comment\nt,stick,px,py,pz\n";
    for (std::size_t i = 1; i < 50; ++i)
        rows += std::to_string(12.3 + static_cast<double>(i) / 60 + 0.05) + ",left,0,0,0\n";
    const TemporaryFolder folder;
    const auto file = folder.write("p.csv", rows);  // six digits: up to 5e-7 s from the exact time
    try {
        (void)app::match_predictions(app::read_prediction_file(file), "left", trace_.sticks[0].samples);
        ADD_FAILURE();
    } catch (const app::BadInput& error) {
        const std::string message = error.what();
        EXPECT_NE(message.find("p.csv:"), std::string::npos) << message;
        EXPECT_NE(message.find(":1: error: found t = "), std::string::npos) << message;
        EXPECT_NE(message.find("as in the first row"), std::string::npos) << message;
        EXPECT_EQ(message.find("p.csv:3:"), std::string::npos) << "the first row sets the lead: " << message;
    }
}

TEST_F(PredictionFiles, CountOnlySamplesThatAreNewerThanAllBefore) {
    const TemporaryFolder folder;
    const auto written = folder.write("p.csv", app::predict_table(trace_, "cv", 0.05));
    const app::PredictionFile file = app::read_prediction_file(written);
    std::vector<PoseSample> arrived = trace_.sticks[0].samples;
    arrived.insert(arrived.begin() + 8, arrived[7]);
    arrived.insert(arrived.begin() + 20, arrived[3]);
    EXPECT_EQ(app::match_predictions(file, "left", arrived).rows.size(), 49U);
    arrived.pop_back();
    EXPECT_THROW((void)app::match_predictions(file, "left", arrived), app::BadInput);
}

}  // namespace
