#include "compare/recording.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "files/bad_input.h"

namespace {
namespace fs = std::filesystem;

/// A folder "band" with a trace of two sticks, and what lies beside it.
class RecordingFiles : public testing::Test {
protected:
    RecordingFiles()
        : root_(fs::temp_directory_path() / ("musicworld_recording_" + std::to_string(getpid()))) {
        fs::create_directories(root_ / "band");
        write("p3_song.csv",
              "t,stick,px,py,pz\n0,left,0,1,0\n0.1,left,0,1,0\n0,right,0,1,0\n0.1,right,0,1,0\n");
    }
    ~RecordingFiles() override { fs::remove_all(root_); }

    void write(const std::string& name, const std::string& text) const {
        std::ofstream(root_ / "band" / name) << text;
    }
    [[nodiscard]] std::string path(const std::string& name) const { return (root_ / "band" / name).string(); }
    [[nodiscard]] std::string refusal() const {
        try {
            (void)app::read_recording(path("p3_song.csv"));
        } catch (const app::BadInput& error) {
            return error.what();
        }
        return {};
    }

private:
    fs::path root_;
};

TEST_F(RecordingFiles, HitsAndFlagsBesideTheTraceAreReadPerStick) {
    write("p3_song.hits.csv", "t,stick,label\n0.7,left,good\n0.2,left,good\n0.3,right,good\n");
    write("p3_song.flags.csv", "t,stick,kind,size\n0.5,both,gap_ms,43\n0.6,right,orientation_flip_deg,90\n");
    const app::Recording recording = app::read_recording(path("p3_song.csv"));
    EXPECT_EQ(recording.marks[0].impacts_s, (std::vector<double>{0.2, 0.7}));
    EXPECT_EQ(recording.marks[1].impacts_s, (std::vector<double>{0.3}));
    EXPECT_EQ(recording.marks[0].flagged_s, (std::vector<double>{0.5}));
    EXPECT_EQ(recording.marks[1].flagged_s, (std::vector<double>{0.5}));
    EXPECT_TRUE(recording.marks[0].flagged_rotations_s.empty());
    EXPECT_EQ(recording.marks[1].flagged_rotations_s, (std::vector<double>{0.6}));
}

TEST_F(RecordingFiles, ABrokenFileBesideTheTraceIsRefusedWithItsPlace) {
    write("p3_song.hits.csv", "t,stick,label\n0.2,left,good\nnan,left,good\n");
    EXPECT_NE(refusal().find("p3_song.hits.csv:3:1: error: found"), std::string::npos) << refusal();
    write("p3_song.hits.csv", "time,stick\n0.2,left\n");
    EXPECT_NE(refusal().find("p3_song.hits.csv:1:1: error: found"), std::string::npos) << refusal();
}

TEST_F(RecordingFiles, PeopleAreNamedByFolderAndNumberOrByOption) {
    EXPECT_EQ(app::read_recording(path("p3_song.csv")).person, "band/p3");
    fs::copy(path("p3_song.csv"), path("AccentCenter_take1.csv"));
    EXPECT_EQ(app::read_recording(path("AccentCenter_take1.csv")).person, "band");
    EXPECT_EQ(app::read_recording(path("p3_song.csv"), {{"p3_", "Ann"}}).person, "Ann");
}

TEST(NearAny, Within50MsOfAnyTime) {
    const std::vector<double> times = {1.0, 2.0};
    EXPECT_FALSE(app::near_any(times, 0.949));
    EXPECT_TRUE(app::near_any(times, 0.951));
    EXPECT_TRUE(app::near_any(times, 2.049));
    EXPECT_FALSE(app::near_any(times, 2.051));
    EXPECT_FALSE(app::near_any({}, 0));
}

}  // namespace
