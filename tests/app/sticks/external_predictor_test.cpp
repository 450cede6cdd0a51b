// Children that behave and children that do not. Python 3 plays the example; the rest are lines of sh.
#include "sticks/external_predictor.h"

#include <gtest/gtest.h>
#include <poll.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <optional>
#include <random>
#include <sstream>

#include "sticks/predictors.h"
#include "temporary_folder.h"

namespace {

namespace fs = std::filesystem;
using app::ExternalPredictor;
using Eigen::Vector3d;
using tracking::PoseSample;
using tracking::SampleStatus;

const std::vector<double> kLeads = {0, 1.0 / 30, 1.0 / 15};
const std::string kExample = "exec:python3 '" MUSICWORLD_SOURCE_DIR "/assets/predictors/difference.py'";

bool has_python() {
    return std::system("python3 -c '' 2>/dev/null") == 0;
}

std::string read(const fs::path& file) {
    std::ostringstream text;
    text << std::ifstream(file).rdbuf();
    return text.str();
}

PoseSample sample_at(double t_s, const Vector3d& position = Vector3d::Zero()) {
    PoseSample sample;
    sample.t_s = t_s;
    sample.position = position;
    return sample;
}

/// A stick that waves and turns (at most 80 rad/s, so that it turns less than half way round between leads),
/// at uneven times, with a gap after sample 40 and no orientations at first.
std::vector<PoseSample> waving(std::size_t count) {
    std::mt19937 random(7);
    std::vector<PoseSample> samples;
    double t = 3, first = 0;
    for (std::size_t i = 0; i < count; ++i) {
        t += i == 40 ? 0.3 : 0.004 + static_cast<double>(random() % 1000) * 1e-5;
        PoseSample sample = sample_at(t, {std::sin(9 * t), 1 + 0.2 * std::cos(31 * t), -0.3 * t});
        sample.has_orientation = i >= 10;
        if (i == 10) first = t;
        if (sample.has_orientation)
            sample.orientation =
                Eigen::AngleAxisd(20 * std::sin(3 * (t - first)), Vector3d(1, std::sin(t), 2).normalized());
        samples.push_back(sample);
    }
    return samples;
}

/// A child of sh that reads the header, says what it answers, and then does `script` for every sample line.
std::string shell_child(const std::string& script, const std::string& form = "position") {
    return "read header; echo " + form + "; while read line; do " + script + "; done";
}

void expect_no_children_left() {
    EXPECT_EQ(waitpid(-1, nullptr, WNOHANG), -1) << "a child was not collected";
    EXPECT_EQ(errno, ECHILD);
}

TEST(ExternalPredictor, TheExampleIsDifference) {
    if (!has_python()) GTEST_SKIP() << "needs python3";
    const auto own = tracking::make_predictor("difference");
    const auto external = app::make_any_predictor(kExample, kLeads, {"left"});
    for (const PoseSample& sample : waving(200)) {
        EXPECT_EQ(external->correct(sample), own->correct(sample));
        external->require_working();
        EXPECT_EQ(external->time_s(), own->time_s());
        for (const double lead : {0.0, 0.01, 1.0 / 30, 0.05, 1.0 / 15}) {
            const tracking::PosePrediction a = external->predict(lead), b = own->predict(lead);
            // The bound asked for is 1e-9 mm; rounding of some metres is 1e-15 m, over steps of 33 ms.
            EXPECT_LT((a.position - b.position).norm(), 1e-12);
            EXPECT_LT((a.velocity - b.velocity).norm(), 1e-11);
            EXPECT_LT((a.orientation.toRotationMatrix() - b.orientation.toRotationMatrix()).norm(), 1e-12);
            EXPECT_LT((a.angular_velocity - b.angular_velocity).norm(), 1e-11);
        }
    }
}

TEST(ExternalPredictor, SendsTheHeaderThenWhatTheClockLetsThroughAndRestartAfterAGap) {
    const TemporaryFolder folder;
    const std::string log = (folder.path() / "log").string();
    {
        ExternalPredictor predictor("echo position; while read line; do echo \"$line\" >> '" + log +
                                        "'; case $line in restart|musicworld*) ;; *) echo 1 2 3;; esac; done",
                                    std::vector<double>{0.5}, "left");
        PoseSample turned = sample_at(0.125, {0.1, 2, -3e-20});
        turned.has_orientation = true;
        turned.orientation = Eigen::Quaterniond(0, 1, 0, 0);
        EXPECT_EQ(predictor.correct(turned), SampleStatus::reinitialised);
        EXPECT_EQ(predictor.correct(turned), SampleStatus::not_newer);
        EXPECT_EQ(predictor.correct(sample_at(0.1)), SampleStatus::not_newer);
        EXPECT_EQ(predictor.correct(sample_at(0.15, {NAN, 0, 0})), SampleStatus::not_finite);
        EXPECT_EQ(predictor.correct(sample_at(0.2)), SampleStatus::accepted);
        EXPECT_EQ(predictor.correct(sample_at(0.5)), SampleStatus::reinitialised);
        EXPECT_NO_THROW(predictor.require_working());
        EXPECT_EQ(predictor.predict(0.5).position, Vector3d(1, 2, 3));
        EXPECT_FALSE(predictor.covariance(0.5).has_value());
    }
    EXPECT_EQ(read(log),
              "musicworld 1 left 0.5\n0.125 0.1 2 -3e-20 0 1 0 0\n0.2 0 0 0\nrestart\n0.5 0 0 0\n");
    expect_no_children_left();
}

TEST(ExternalPredictor, CovariancesThatAreAnsweredAreStated) {
    ExternalPredictor predictor(shell_child("echo 0 0 0 1e-6 0 0 4e-6 0 9e-6", "position covariance"),
                                std::vector<double>{0.1}, "r");
    ASSERT_EQ(predictor.correct(sample_at(0)), SampleStatus::reinitialised);
    const auto covariance = predictor.covariance(0.1);
    ASSERT_TRUE(covariance.has_value());
    EXPECT_EQ(covariance->position.diagonal(), Vector3d(1e-6, 4e-6, 9e-6));
}

struct Fault {
    const char* what;
    std::string command;
    const char* message;  ///< a part of it
};

std::string failure_of(const app::ExternalPredictor& predictor) {
    try {
        predictor.require_working();
    } catch (const std::runtime_error& error) {
        return error.what();
    }
    return "no failure";
}

TEST(ExternalPredictor, EveryFaultIsALocatedErrorAndTheChildIsCollected) {
    const std::vector<Fault> faults = {
        {"ends", "read h; echo position; read l; echo 0 0 0; read l; exit 3", "ended with status 3"},
        {"ends at once after the first answer", "read h; echo position; read l; echo 0 0 0",
         "ended with status 0"},
        {"dies saying why",
         "read h; echo position; read l; echo 0 0 0; read l; echo 'out of luck' >&2; exit 1",
         "ended with status 1 saying \"out of luck\""},
        {"is killed", "read h; echo position; read l; echo 0 0 0; read l; kill -9 $$",
         "ended with status 137"},
        {"hangs", "read h; echo position; read l; echo 0 0 0; sleep 1000", "no whole line within 0.5 s"},
        {"half a line", "read h; echo position; read l; echo 0 0 0; read l; printf '0 0'; sleep 1000",
         "no whole line within 0.5 s"},
        {"NaN", shell_child("echo ${n:-0} 0 0; n=nan"), "found \"nan\" as number 1 of 3"},
        {"infinity", shell_child("echo 0 ${n:-0} 0; n=-inf"), "found \"-inf\" as number 2 of 3"},
        {"overflow", shell_child("echo 0 ${n:-0} 0; n=1e999"), "found \"1e999\" as number 2 of 3"},
        {"far away", shell_child("echo 0 ${n:-0} 0; n=1e9"), "a position 1000000000 m away"},
        {"a word", shell_child("echo 0 0 ${n:-0}; n=left"), "found \"left\" as number 3 of 3"},
        {"a tail", shell_child("echo 0 0 ${n:-0}; n=1,5"), "found \"1,5\" as number 3 of 3"},
        {"too few", shell_child("echo 0 0 $n; n=; [ $i ] || n=; i=1"), "found 2 numbers, expected 3"},
        {"too many", shell_child("echo 0 0 0 $n; n=1"), "found 4 numbers, expected 3"},
        {"nothing", shell_child("echo $n ; n="), "found 0 numbers, expected 3"},
        {"two lines", shell_child("printf \"0 0 0\\n$n\"; n='more\\n'"), "found a second line, \"more\""},
        {"bytes", shell_child("printf \"${n:-0 0 0}\\n\"; n='\\001\\377 0 0'"),
         "found \" \xff\" as number 1 of 3"},
        {"a huge line", shell_child("echo 0 0 0; read line; head -c 2000000 /dev/zero | tr '\\0' 1"),
         "a line of more than 1048576 bytes"},
    };
    for (const Fault& fault : faults) {
        SCOPED_TRACE(fault.what);
        {
            app::ExternalPatience patience;
            patience.answer_s = std::string(fault.message).find("0.5 s") != std::string::npos ? 0.5 : 10;
            ExternalPredictor predictor(fault.command, std::vector<double>{0.05}, "r", patience);
            double t = 0;
            for (; t < 0.1 && failure_of(predictor) == "no failure"; t += 0.01)
                (void)predictor.correct(sample_at(t));
            const std::string message = failure_of(predictor);
            EXPECT_EQ(message.find("exec:" + fault.command + ", stick r, answer "), 0U) << message;
            EXPECT_NE(message.find(": error: found "), std::string::npos) << message;
            EXPECT_NE(message.find(fault.message), std::string::npos) << message;
            EXPECT_NE(message.find(", expected "), std::string::npos) << message;
            EXPECT_EQ(predictor.correct(sample_at(t)), SampleStatus::not_finite) << "it stays failed";
            EXPECT_TRUE(predictor.predict(0.05).position.allFinite());
        }
        expect_no_children_left();
    }
}

TEST(ExternalPredictor, FaultsAtTheStartAreThrown) {
    const std::vector<Fault> faults = {
        {"not there", "no-such-program-anywhere", "status 127 saying \""},
        {"ends", "exit 5", "ended with status 5"},
        {"hangs", "sleep 1000", "no whole line within 0.5 s"},
        {"greets wrongly", "read h; echo hello; sleep 1000", "found \"hello\", expected \"position"},
        {"answers numbers", "echo 0 0 0; sleep 1000", "found \"0 0 0\", expected \"position"},
    };
    for (const Fault& fault : faults) {
        SCOPED_TRACE(fault.what);
        app::ExternalPatience patience;
        patience.start_s = std::string(fault.message).find("0.5 s") != std::string::npos ? 0.5 : 10;
        try {
            const ExternalPredictor predictor(fault.command, kLeads, "r", patience);
            ADD_FAILURE();
        } catch (const std::runtime_error& error) {
            const std::string message = error.what();
            EXPECT_EQ(message.find("exec:" + fault.command + ", stick r, first line: error: found "), 0U)
                << message;
            EXPECT_NE(message.find(fault.message), std::string::npos) << message;
        }
        expect_no_children_left();
    }
}

/// A process that is not a child of ours, whose end can be waited for.
class WatchedProcess {
public:
    explicit WatchedProcess(int pid) : handle_(static_cast<int>(syscall(SYS_pidfd_open, pid, 0))) {}
    ~WatchedProcess() { close(handle_); }
    WatchedProcess(const WatchedProcess&) = delete;
    WatchedProcess& operator=(const WatchedProcess&) = delete;

    [[nodiscard]] bool exists() const { return handle_ >= 0; }
    [[nodiscard]] bool has_ended() const { return ended_within(0); }
    /// A signal sent is not yet a process ended: the system says when.
    [[nodiscard]] bool ends() const {
        constexpr int kPatienceMs = 60000;  // far beyond what a loaded machine takes
        return ended_within(kPatienceMs);
    }

private:
    [[nodiscard]] bool ended_within(int milliseconds) const {
        pollfd ended{handle_, POLLIN, 0};
        return poll(&ended, 1, milliseconds) == 1;
    }
    int handle_;
};

TEST(ExternalPredictor, WhatAChildHasStartedEndsWithIt) {
    const TemporaryFolder folder;
    const std::string file = (folder.path() / "pid").string();
    std::optional<WatchedProcess> grandchild;
    {
        const ExternalPredictor predictor(
            "sleep 1000 & echo $! > '" + file + "'; read h; echo position; sleep 1000", kLeads, "r");
        grandchild.emplace(std::stoi(read(file)));
        ASSERT_TRUE(grandchild->exists());
        EXPECT_FALSE(grandchild->has_ended());
    }
    expect_no_children_left();
    EXPECT_TRUE(grandchild->ends());
}

}  // namespace
