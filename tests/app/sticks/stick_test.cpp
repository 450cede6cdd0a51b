// One stick's filters: what they publish is what their predictors predict; contacts that are confirmed.

#include "sticks/stick.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>

#include "sticks/predictors.h"
#include "temporary_folder.h"

namespace {

using Eigen::Vector3d;
using tracking::PosePrediction;
using tracking::PoseSample;

constexpr double kSoundLeadS = 1.0 / 15;

/// A stick that waves and turns at 120 Hz, with a gap after sample 50 and one sample that is not newer.
std::vector<PoseSample> waving() {
    std::vector<PoseSample> samples;
    double t = 2;
    for (int i = 0; i < 100; ++i) {
        t += i == 50 ? 0.4 : i == 70 ? 0 : 1.0 / 120;
        PoseSample sample;
        sample.t_s = t;
        sample.position = Vector3d(0.1 * std::sin(7 * t), 1 + 0.2 * std::cos(25 * t), 0.3);
        sample.has_orientation = true;
        sample.orientation = Eigen::AngleAxisd(std::sin(11 * t), Vector3d(1, 2, 2).normalized());
        samples.push_back(sample);
    }
    return samples;
}

double difference(const PosePrediction& a, const PosePrediction& b) {
    return std::max({(a.position - b.position).norm(), (a.velocity - b.velocity).norm(),
                     (a.orientation.coeffs() - b.orientation.coeffs()).norm()});
}

class EveryPredictor : public testing::TestWithParam<std::string> {};

/// At the nodes of its path, where contacts are looked for: to the bit, but for estimators that sum in another
/// order (rounding of numbers below 100).
TEST_P(EveryPredictor, PublishesThePathThatItPredicts) {
    const app::StickPredictors predictors = app::stick_predictors("hold", GetParam(), kSoundLeadS);
    app::StickFilters filters(predictors, "left");
    const std::vector<double> leads = app::path_leads(kSoundLeadS);
    const auto own = app::make_any_predictor(predictors.sound, leads, {"left"});
    tracking::StickState state;
    for (const PoseSample& sample : waving()) {
        const tracking::SampleStatus status = own->correct(sample);
        EXPECT_EQ(filters.correct(sample, state), status);
        EXPECT_EQ(state.t_s, own->time_s());
        EXPECT_EQ(state.model, own->selected());
        for (const double lead : leads)
            EXPECT_LE(difference(state.sound.after(lead), own->predict(lead)), 1e-12) << lead;
    }
    EXPECT_EQ(state.samples, 99u);
    EXPECT_EQ(state.refused, 1u);
    EXPECT_EQ(state.starts, 2u);
    EXPECT_EQ(state.confirms, 0u);
}

INSTANTIATE_TEST_SUITE_P(
    Specifications, EveryPredictor,
    testing::Values("hold", "difference", "naive", "least-squares", "least-squares:degree=3,n=8",
                    "double-exponential", "one-euro", "thesis", "cv:decay=8", "ca", "singer", "bank", "imm",
                    "surface", "learned", "arbitrated",
                    "exec:read h; set -- $h; shift 3; n=$#; echo position velocity; while read t x y z r; do "
                    "[ $t = restart ] && continue; a=; i=0; while [ $i -lt $n ]; do "
                    "a=\"$a $x 0.$i $z 1 $y 0\"; i=$((i+1)); done; echo $a; done"));

TEST(StickFilters, BegunAnewTheyAreAsInTheBeginning) {
    for (const char* sound : {"auto", "least-squares:degree=3,n=8",
                              "exec:k=0; read h; set -- $h; shift 3; n=$#; echo position; while read t r; do "
                              "[ $t = restart ] && k=0 && continue; k=$((k+1)); a=; i=0; "
                              "while [ $i -lt $n ]; do a=\"$a $k 0 0\"; i=$((i+1)); done; echo $a; done"}) {
        app::StickFilters filters(app::stick_predictors("thesis", sound, kSoundLeadS), "left");
        const auto path = [&] {
            tracking::StickState state;
            for (int i = 0; i < 20; ++i) (void)filters.correct(waving()[static_cast<std::size_t>(i)], state);
            return state;
        };
        const tracking::StickState first = path();
        filters.begin_anew();
        const tracking::StickState second = path();
        EXPECT_EQ(second.samples, 20u);
        EXPECT_EQ(second.starts, 1u);
        EXPECT_EQ(difference(first.sound.after(0.05), second.sound.after(0.05)), 0) << sound;
        EXPECT_EQ(difference(first.picture.after(0.05), second.picture.after(0.05)), 0) << sound;
    }
}

TEST(StickFilters, KeepWhatEachLapTaughtThem) {
    app::StickFilters filters(app::stick_predictors("auto", "auto", kSoundLeadS), "left");
    const auto lap = [&] {
        tracking::StickState state;
        for (const tracking::PoseSample& sample : waving()) (void)filters.correct(sample, state);
        return filters.experience().value();
    };
    const tracking::Experience first = lap();
    ASSERT_GT(first.against.norm(), 0);
    for (int laps = 2; laps <= 3; ++laps) {
        filters.begin_anew();
        const tracking::Experience all = lap();                          // the same samples each time
        EXPECT_TRUE(all.moments.isApprox(laps * first.moments, 1e-14));  // rounding of the sum
        EXPECT_TRUE(all.against.isApprox(laps * first.against, 1e-14));
    }
}

TEST(StickFilters, AModelsFileIsReadOnce) {
    const TemporaryFolder folder;
    const std::filesystem::path file = folder.path() / "mine.model";
    std::filesystem::copy(*app::model_file("learned"), file);
    app::StickFilters filters(
        app::stick_predictors("auto:model=" + file.string(), "learned:model=" + file.string(), kSoundLeadS),
        "left");
    std::filesystem::remove(file);
    tracking::StickState first, second;
    for (tracking::StickState* state : {&first, &second}) {  // laps of a repeated trace
        for (const PoseSample& sample : waving()) (void)filters.correct(sample, *state);
        filters.begin_anew();
    }
    EXPECT_EQ(second.starts, 2u);
    EXPECT_EQ(difference(first.sound.after(0.05), second.sound.after(0.05)), 0);
    EXPECT_EQ(difference(first.picture.after(0.05), second.picture.after(0.05)), 0);
}

TEST(StickFilters, AFailedExternalPredictorIsThrown) {
    app::StickFilters filters(
        app::stick_predictors("exec:read h; echo position; read l; exit 4", "hold", kSoundLeadS), "right");
    tracking::StickState state;
    try {
        (void)filters.correct(waving()[0], state);
        ADD_FAILURE();
    } catch (const std::runtime_error& wrong) {
        EXPECT_NE(std::string(wrong.what()).find("stick right, answer 1: error: found the child ended"),
                  std::string::npos)
            << wrong.what();
    }
}

/// 0 to 0.15 s for pictures, held beyond; the tip at the shaft's end; a confirming path with `auto` alone.
TEST(Stick, AsksItsState) {
    app::StickGeometry geometry;
    geometry.tip = Vector3d(0, 0, -0.4);
    app::Stick stick(3, geometry, kSoundLeadS);
    EXPECT_FALSE(stick.started());
    app::StickFilters filters(app::stick_predictors("auto", "auto", kSoundLeadS), "left");
    tracking::StickState state;
    for (int i = 0; i < 30; ++i) {
        (void)filters.correct(waving()[static_cast<std::size_t>(i)], state);
        stick.take(state);
    }
    EXPECT_TRUE(stick.started());
    EXPECT_NEAR(stick.interval_s(), 1.0 / 120, 1e-12);
    const PoseSample newest = waving()[29];
    EXPECT_EQ(stick.measured_tip(), newest.position + newest.orientation * geometry.tip);
    EXPECT_EQ(difference(stick.pose_at(state.t_s + 1), state.picture.after(0.15)), 0);
    const sim::TipPath path = stick.predicted_path(0);
    ASSERT_EQ(path.nodes.size(), 9u);
    EXPECT_EQ(path.stick, 3u);
    EXPECT_EQ(path.nodes[8].position,
              tracking::point_of(state.sound.after(kSoundLeadS), geometry.tip).position);
    ASSERT_TRUE(stick.confirming_path());
    EXPECT_EQ(stick.confirming_path()->nodes[8].velocity,
              tracking::point_of(state.confirming.after(0.1), geometry.tip).velocity);
    stick.forget();
    EXPECT_FALSE(stick.started());
}

sim::Contact contact_at(double t_s, std::uint32_t body = 0) {
    sim::Contact contact;
    contact.t_s = t_s;
    contact.body = body;
    return contact;
}

bool is_kept(const sim::Contact& contact, const std::vector<sim::Contact>& confirming) {
    std::vector<sim::Contact> contacts = {contact};
    app::keep_confirmed(contacts, confirming, 1.0);
    return !contacts.empty();
}

TEST(KeepConfirmed, ContactsFartherThan50MsNeedNoConfirmation) {
    EXPECT_TRUE(is_kept(contact_at(1.051), {}));
    EXPECT_FALSE(is_kept(contact_at(1.049), {}));
}

TEST(KeepConfirmed, NearOnesNeedTheSameBodyAtMost50MsLater) {
    EXPECT_TRUE(is_kept(contact_at(1.02, 2), {contact_at(1.069, 2)}));
    EXPECT_FALSE(is_kept(contact_at(1.02, 2), {contact_at(1.071, 2)}));
    EXPECT_FALSE(is_kept(contact_at(1.02, 2), {contact_at(1.02, 1)}));
    EXPECT_TRUE(is_kept(contact_at(1.02, 2), {contact_at(1.0, 1), contact_at(1.001, 2)}));
}

TEST(KeepConfirmed, EachContactIsJudgedByItself) {
    std::vector<sim::Contact> contacts = {contact_at(1.01, 0), contact_at(1.02, 1), contact_at(1.06, 2)};
    const std::vector<sim::Contact> confirming = {contact_at(1.03, 1)};
    app::keep_confirmed(contacts, confirming, 1.0);
    ASSERT_EQ(contacts.size(), 2U);
    EXPECT_EQ(contacts[0].body, 1U);
    EXPECT_EQ(contacts[1].body, 2U);
}

TEST(PassedThrough, IsWhatTheTipEnteredWhereItSoundsAndLeftAgain) {
    std::vector<sim::Contact> contacts(5);
    for (std::uint32_t i = 0; i < 5; ++i) {
        contacts[i].body = i;
        contacts[i].t_s = 2 + 0.001 * i;
        contacts[i].zone = 0;
    }
    contacts[1].starts_inside = true;
    contacts[2].zone = -1;                                             // the shell
    const std::vector<double> measured = {0.1, 0.1, 0.1, -0.01, 0.1};  // still in the fourth
    const std::vector<sim::Contact> passed = app::passed_through(contacts, 0.011, measured);
    ASSERT_EQ(passed.size(), 2u);
    EXPECT_EQ(passed[0].body, 0u);
    EXPECT_EQ(passed[1].body, 4u);
    EXPECT_DOUBLE_EQ(passed[1].t_s, 2.004 - 0.011) << "when the tip was there";
    // The way begins when bodies are known, at the newest sample.
    const sim::TipPath way = app::measured_way({0, 1, 0}, {0, 0.8, 0}, 2, 0.01, 0.006);
    ASSERT_EQ(way.nodes.size(), 2u);
    EXPECT_EQ(way.nodes[0].t_s, 2);
    EXPECT_DOUBLE_EQ(way.nodes[1].t_s, 2.01);
    EXPECT_NEAR(way.nodes[0].velocity.y(), -20, 1e-9);
}

}  // namespace
