// `musicworld play` on the bundled traces: what it must show, byte for byte where that is promised.
#include <gtest/gtest.h>
#include <signal.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <set>
#include <thread>

#include "program.h"

namespace end_to_end {
namespace {

using Json = nlohmann::json;

std::vector<std::string> play(const std::filesystem::path& trace, const std::filesystem::path& out,
                              std::vector<std::string> more = {}) {
    std::vector<std::string> all = {"play", trace.string(), "--out", out.string(), "--size", "160x120"};
    all.insert(all.end(), more.begin(), more.end());
    return all;
}

/// A shorter trace, so that the sanitizers finish in time too.
std::filesystem::path short_trace(const Folder& folder, const std::string& name, double until,
                                  double from = -1e9) {
    const std::filesystem::path file = folder / ("cut_" + name + ".csv");
    write(file, cut_trace(read(bundled("traces/" + name + ".csv")), until, from));
    return file;
}

Json summary(const std::filesystem::path& out) {
    return Json::parse(read(out / "summary.json"));
}

void expect_same_products(const std::filesystem::path& a, const std::filesystem::path& b) {
    const auto left = read_tree(a, {"summary.json"});
    const auto right = read_tree(b, {"summary.json"});
    ASSERT_GE(left.size(), 4U);
    ASSERT_EQ(left.size(), right.size());
    for (const auto& [name, bytes] : left)
        EXPECT_TRUE(right.contains(name) && right.at(name) == bytes) << name;
}

TEST(Play, TwoRunsAndZeroOneAndThreeWorkersGiveTheSameBytes) {
    const Folder folder;
    const auto trace = short_trace(folder, "flourish", 2);
    const std::vector<std::string> workers = {"0", "0", "1", "3"};
    for (std::size_t i = 0; i < workers.size(); ++i) {
        const Ended ended = run(play(trace, folder / std::to_string(i), {"--workers", workers[i]}));
        ASSERT_EQ(ended.status, 0) << ended.err;
        EXPECT_EQ(ended.err, "");
    }
    for (const char* other : {"1", "2", "3"}) expect_same_products(folder / "0", folder / other);
}

TEST(Play, EventsAndSoundDoNotDependOnWhetherFramesAreDrawn) {
    const Folder folder;
    const auto trace = short_trace(folder, "flourish", 2);
    ASSERT_EQ(run(play(trace, folder / "a", {"--workers", "0"})).status, 0);
    ASSERT_EQ(run(play(trace, folder / "b", {"--workers", "0", "--no-frames"})).status, 0);
    for (const char* name : {"events.csv", "audio.wav", "hits.mid", "contacts.csv"})
        EXPECT_EQ(read(folder / (std::string("a/") + name)), read(folder / (std::string("b/") + name)))
            << name;
}

/// [s], by ffprobe.
double length_of(const std::filesystem::path& video, const std::string& stream) {
    const Ended ended = run_command({"ffprobe", "-v", "error", "-select_streams", stream, "-show_entries",
                                     "stream=duration", "-of", "csv=p=0", video.string()});
    EXPECT_EQ(ended.status, 0) << ended.err;
    return std::stod(ended.out);
}

TEST(Play, AVideoLastsAsLongAsItsSoundIsNamedAtTheEndAndStandsInPlaceOfTheFrames) {
    const Folder folder;
    const auto trace = short_trace(folder, "roll", 1.5);
    const std::filesystem::path video = folder / "take.mp4";
    const Ended ended = run(play(trace, folder / "out", {"--video", video.string(), "--fps", "10"}));
    ASSERT_EQ(ended.status, 0) << ended.err;
    EXPECT_NE(ended.out.find("watch " + video.string()), std::string::npos) << ended.out;
    EXPECT_FALSE(std::filesystem::exists(folder / "out/frames"));
    EXPECT_NE(read(folder / "out/report.html").find("data:image/png"), std::string::npos)
        << "the report still shows some";
    const double picture_s = length_of(video, "v"), sound_s = length_of(video, "a");
    const auto [t0, t_end] = time_span(read(trace));
    EXPECT_GT(sound_s, t_end - t0 + 0.49) << "it rings out";
    EXPECT_GE(picture_s, sound_s - 1e-3);
    EXPECT_LT(picture_s, sound_s + 0.1 + 1e-3) << "to the next frame";
    EXPECT_NE(read(folder / "out/report.html").find("src=\"../take.mp4\""), std::string::npos);
    std::vector<std::string> in_folder = {"env", "-C", (folder / "").string(), MUSICWORLD_PROGRAM};
    std::ranges::copy(play(trace, "out", {"--video", "named.mp4", "--fps", "10", "--keep-frames"}),
                      std::back_inserter(in_folder));
    ASSERT_EQ(run_command(in_folder).status, 0);
    EXPECT_TRUE(std::filesystem::exists(folder / "out/frames/000010.png"));
    EXPECT_NE(read(folder / "out/report.html").find("src=\"../named.mp4\""), std::string::npos)
        << "a name in the working folder";
    EXPECT_EQ(run(play(trace, folder / "out", {"--keep-frames"})).status, 2)
        << "they are kept without a video";
}

TEST(Play, ACameraChangesThePicturesAndNothingElse) {
    const Folder folder;
    const auto trace = short_trace(folder, "roll", 0.6);
    write(folder / "path.toml",
          "[[camera]]\ntime = 0\neye = [0, 1.5, 1.5]\ntarget = [0, 0.7, 0]\n"
          "[[camera]]\ntime = 0.3\neye = [1, 1.5, 1.5]\ntarget = [0, 0.7, 0]\n");
    const std::string path = folder / "path.toml";
    const std::vector<std::vector<std::string>> cameras = {
        {}, {"--camera", "top"}, {"--camera", "0,1.5,1.5:0,0.7,0"}, {"--camera", path}};
    std::set<std::string> first, last;
    for (std::size_t i = 0; i < cameras.size(); ++i) {
        const std::filesystem::path out = folder / std::to_string(i);
        ASSERT_EQ(run(play(trace, out, cameras[i])).status, 0);
        first.insert(read(out / "frames/000000.png"));
        last.insert(read(out / "frames/000010.png"));
        for (const char* name : {"events.csv", "audio.wav", "hits.mid"})
            EXPECT_EQ(read(out / name), read(folder / (std::string("0/") + name))) << name;
    }
    EXPECT_EQ(first.size(), 4u) << "a path's light stands by the kit's camera";
    EXPECT_EQ(last.size(), 4u);
    const Ended wrong = run(play(trace, folder / "wrong", {"--camera", "behind"}));
    EXPECT_EQ(wrong.status, 2);
    EXPECT_NE(wrong.err.find("found --camera behind, expected drummer, front, top, side"), std::string::npos)
        << wrong.err;
}

TEST(Play, MotionBlurChangesMovingPicturesAndNothingElse) {
    const Folder folder;
    const auto trace = short_trace(folder, "roll", 0.6);
    ASSERT_EQ(run(play(trace, folder / "sharp")).status, 0);
    ASSERT_EQ(run(play(trace, folder / "none", {"--motion-blur", "0"})).status, 0);
    ASSERT_EQ(run(play(trace, folder / "half", {"--motion-blur", "0.5"})).status, 0);
    ASSERT_EQ(run(play(trace, folder / "again", {"--motion-blur", "0.5", "--workers", "0"})).status, 0);
    expect_same_products(folder / "sharp", folder / "none");
    expect_same_products(folder / "half", folder / "again");
    for (const char* name : {"events.csv", "contacts.csv", "audio.wav", "hits.mid", "frames/000000.png"})
        EXPECT_EQ(read(folder / "sharp" / name), read(folder / "half" / name))
            << name << " (the first picture shows no sticks)";
    EXPECT_NE(read(folder / "sharp/frames/000010.png"), read(folder / "half/frames/000010.png"));
    for (const std::vector<std::string>& wrong : {std::vector<std::string>{"--motion-blur", "1.5"},
                                                  {"--motion-blur", "0.5", "--no-frames"},
                                                  {"--motion-blur", "0.5", "--realtime"}})
        EXPECT_EQ(run(play(trace, folder / "wrong", wrong)).status, 2) << wrong.back();
}

TEST(Play, CuttingTheTraceLeavesEveryEarlierFrameAndSampleAsItWas) {
    const Folder folder;
    const double cut = 1.203;  // between samples, in the middle of strokes
    const auto whole = short_trace(folder, "feints", 2.2);
    const std::filesystem::path part = folder / "part.csv";
    write(part, cut_trace(read(whole), cut));
    ASSERT_EQ(run(play(whole, folder / "whole", {"--workers", "0", "--gain", "0"})).status, 0);
    ASSERT_EQ(run(play(part, folder / "part", {"--workers", "0", "--gain", "0"})).status, 0);

    // Frames are shown only up to the last sample; audio goes on.
    const auto [t0, t_end] = time_span(read(part));
    int frames = 0;
    for (int k = 0; k / 30.0 < t_end - t0; ++k, ++frames) {
        char name[32];
        std::snprintf(name, sizeof name, "/frames/%06d.png", k);
        ASSERT_EQ(read(folder / ("part" + std::string(name))), read(folder / ("whole" + std::string(name))))
            << k;
    }
    EXPECT_GE(frames, 30);

    int channels = 0;
    const std::vector<int> a = read_wav(folder / "part/audio.wav", channels);
    const std::vector<int> b = read_wav(folder / "whole/audio.wav", channels);
    const auto samples = static_cast<std::size_t>((t_end + 0.010 - t0) * 48000);
    ASSERT_GT(a.size(), samples * 2);
    bool same = true, sounding = false;
    for (std::size_t i = 0; i < samples * 2; ++i)
        same = same && a[i] == b[i], sounding = sounding || a[i] != 0;
    EXPECT_TRUE(same);
    EXPECT_TRUE(sounding) << "silence would prove nothing";
}

/// A stick that strikes the drums' crash twice and then comes to rest on it at 1.35 s, at 120 Hz.
std::string resting_stick() {
    std::string text = "t,stick,px,py,pz\n";
    for (int k = 0; k < 300; ++k) {
        const double t = k / 120.0, pi = 3.14159265358979;
        const double height = t < 1.1 ? 0.12 * std::abs(std::sin(pi * (t - 0.3) / 0.4))
                                      : 0.12 * std::max(0.0, 1 - (t - 1.1) / 0.25);
        char row[80];
        std::snprintf(row, sizeof row, "%.6f,a,-0.5,%.6f,-0.92\n", t, 1.0724 + height);
        text += row;
    }
    return text;
}

TEST(Play, ATipThatRestsOnACymbalChokesItAndWhatComesLaterChangesNothingBefore) {
    const Folder folder;
    write(folder / "rest.csv", resting_stick());
    write(folder / "part.csv", cut_trace(resting_stick(), 1.43));  // before it has rested long enough
    write(folder / "free.toml",
          "include = [\"drums.toml\"]\n[mix]\nroom_t60_s = 0\n[[instrument]]\nname = \"crash\"\ntip_choke_s "
          "= 0\n");
    write(folder / "dry.toml", "include = [\"drums.toml\"]\n[mix]\nroom_t60_s = 0\n");
    const auto sound = [&](const char* trace, const char* kit) {
        const std::filesystem::path out = folder / (std::string(trace) + kit);
        EXPECT_EQ(run(play(folder / (std::string(trace) + ".csv"), out,
                           {"--no-frames", "--gain", "0", "--kit",
                            (folder / (std::string(kit) + ".toml")).string()}))
                      .status,
                  0);
        int channels = 0;
        return read_wav(out / "audio.wav", channels);
    };
    const std::vector<int> choked = sound("rest", "dry"), free = sound("rest", "free"),
                           part = sound("part", "dry");
    std::size_t onset = 0, tips = 0;
    for (const auto& row : read_csv(folder / "restdry/events.csv"))
        if (row.at("model") == "tip") {
            onset = static_cast<std::size_t>(std::llround(std::stod(row.at("onset_s")) * 48000));
            EXPECT_EQ(row.at("stick"), "a");
            EXPECT_EQ(row.at("instrument"), "crash");
            ++tips;
        }
    ASSERT_EQ(tips, 1U);
    EXPECT_NEAR(static_cast<double>(onset) / 48000, 1.35 + 0.1 + 0.01, 0.02);
    ASSERT_GT(free.size(), 2 * (onset + 4800));
    EXPECT_TRUE(
        std::equal(free.begin(), free.begin() + static_cast<std::ptrdiff_t>(2 * onset), choked.begin()));
    for (std::size_t i = 2 * (onset + 720); i < choked.size(); ++i) ASSERT_EQ(choked[i], 0) << i;
    EXPECT_TRUE(std::any_of(free.begin() + static_cast<std::ptrdiff_t>(2 * (onset + 720)), free.end(),
                            [](int x) { return x != 0; }));
    // The part ends at a sample of 1.425 s: sound is fixed up to 10 ms after it.
    EXPECT_TRUE(std::equal(part.begin(), part.begin() + static_cast<std::ptrdiff_t>(2 * 1.435 * 48000),
                           choked.begin()));
}

TEST(Play, EachInstrumentsFirstNoteSoundsAtItsPlannedSample) {
    const Folder folder;
    ASSERT_EQ(run(play(bundled("traces/flourish.csv"), folder / "all", {"--no-frames"})).status, 0);
    int channels = 0;
    const std::vector<int> all = read_wav(folder / "all/audio.wav", channels);
    std::set<std::string> done;
    const auto rows = read_csv(folder / "all/events.csv");
    for (const auto& row : rows) {
        if (row.at("outcome") != "released" || !done.insert(row.at("instrument")).second) continue;
        const std::string solo = "solo" + row.at("id");
        ASSERT_EQ(
            run(play(bundled("traces/flourish.csv"), folder / solo, {"--no-frames", "--solo", row.at("id")}))
                .status,
            0);
        const std::vector<int> samples = read_wav(folder / (solo + "/audio.wav"), channels);
        ASSERT_EQ(channels, 2);
        EXPECT_EQ(samples.size(), all.size());
        EXPECT_EQ(summary(folder / solo).at("loudness").at("gain_db"),
                  summary(folder / "all").at("loudness").at("gain_db"));
        std::size_t first = 0;
        while (first < samples.size() && samples[first] == 0) ++first;
        const double t0 = summary(folder / solo).at("t0_s").get<double>();
        const auto planned = std::llround((std::stod(row.at("onset_s")) - t0) * 48000);
        EXPECT_EQ(static_cast<long long>(first / 2), planned) << row.at("instrument");
        if (done.size() > 1) continue;
        // The run's first note: until the next one sounds the mix has nothing else, but for the rounding of the gain.
        const auto next = std::llround((std::stod(rows.at(1).at("onset_s")) - t0) * 48000);
        EXPECT_GT(next, planned);
        for (auto k = static_cast<std::size_t>(2 * planned); k < static_cast<std::size_t>(2 * next); ++k)
            EXPECT_NEAR(samples[k], all[k], 1) << k;
    }
    EXPECT_GE(done.size(), 5U) << "the flourish goes over the whole kit";
}

TEST(Play, TheSoundHasTheLoudnessAskedForAndItsStemsAreAsLong) {
    const Folder folder;
    for (const char* kit : {"drums", "bells", "strings"}) {
        const std::vector<std::string> words{"--no-frames", "--kit", kit, "--stems"};
        ASSERT_EQ(run(play(bundled("traces/flourish.csv"), folder / kit, words)).status, 0);
        const Json loudness = summary(folder / kit).at("loudness");
        EXPECT_NEAR(loudness.at("integrated_lufs").get<double>(), -23, 1) << kit;
        EXPECT_LE(loudness.at("true_peak_dbtp").get<double>(), -0.99) << kit;
        EXPECT_GT(loudness.at("range_lu").get<double>(), 0) << kit;
        int channels = 0;
        const std::size_t size = read_wav(folder / (std::string(kit) + "/audio.wav"), channels).size();
        std::size_t stems = 0;
        for (const auto& stem : std::filesystem::directory_iterator(folder / (std::string(kit) + "/stems"))) {
            EXPECT_EQ(read_wav(stem.path(), channels).size(), size) << stem.path();
            ++stems;
        }
        EXPECT_GE(stems, 3U) << kit;
    }
    const std::vector<std::string> fixed{"--no-frames", "--gain", "-6"};
    ASSERT_EQ(run(play(bundled("traces/flourish.csv"), folder / "fixed", fixed)).status, 0);
    EXPECT_EQ(summary(folder / "fixed").at("loudness").at("gain_db").get<double>(), -6);
    EXPECT_EQ(run({"play", "flourish", "--gain", "0", "--loudness", "-20"}).status, 2);
    EXPECT_EQ(run({"play", "flourish", "--time-signature", "4/5"}).status, 2);
}

TEST(Play, OnTheFlourishAtLeast95PercentOfTheTrueContactsSoundWithin30Ms) {
    const Folder folder;
    ASSERT_EQ(run(play(bundled("traces/flourish.csv"), folder / "out", {"--no-frames"})).status, 0);
    const Json strikes = summary(folder / "out").at("strikes");
    const int contacts = strikes.at("true").get<int>();
    EXPECT_GE(contacts, 40);
    EXPECT_LE(strikes.at("missed").get<int>(), 0.05 * contacts);
}

TEST(Play, NoFeintThatTurns25MsBeforeTheReleasePointSoundsAndWithoutCancellingSomeDo) {
    const Folder folder;
    ASSERT_EQ(run(play(bundled("traces/feints.csv"), folder / "with", {"--no-frames"})).status, 0);
    ASSERT_EQ(
        run(play(bundled("traces/feints.csv"), folder / "without", {"--no-frames", "--no-cancel"})).status,
        0);
    const Json with = summary(folder / "with").at("strikes"),
               without = summary(folder / "without").at("strikes");
    EXPECT_EQ(with.at("false_turned_early").get<int>(), 0);
    EXPECT_GT(with.at("cancelled").get<int>(), 0);
    EXPECT_EQ(without.at("cancelled").get<int>(), 0);
    EXPECT_GT(without.at("false").get<int>(), with.at("false").get<int>() + 3);
}

TEST(Play, AWorkerThatIsKilledChangesNothingButTheSummary) {
    const Folder folder;
    const auto trace = bundled("traces/roll.csv");
    const auto begun = std::chrono::steady_clock::now();
    ASSERT_EQ(run(play(trace, folder / "undisturbed", {"--workers", "2", "--no-frames"})).status, 0);
    const auto whole = std::chrono::steady_clock::now() - begun;
    bool lost = false;
    for (int attempt = 0; attempt < 20 && !lost; ++attempt) {
        Started started(play(trace, folder / "killed", {"--workers", "2", "--no-frames"}), folder / "");
        const std::string find = "pgrep -P " + std::to_string(started.pid()) + " -f 'worker --connect' > " +
                                 (folder / "pids").string();
        // Kill as soon as one is there, at every attempt later by a share of an undisturbed run, so that one falls into the
        // part with workers whatever the machine's speed.
        for (int i = 0; i < 4000 && read(folder / "pids").empty(); ++i) {
            if (std::system(find.c_str()) != 0) std::this_thread::sleep_for(std::chrono::milliseconds(5));
        }
        std::this_thread::sleep_for(attempt * whole / 20);
        const int victim = std::atoi(read(folder / "pids").c_str());
        if (victim > 0) kill(victim, SIGKILL);
        write(folder / "pids", "");
        const Ended ended = started.wait();
        ASSERT_EQ(ended.status, 0) << ended.err;
        const Json workers = summary(folder / "killed").at("workers");
        lost = workers.at("lost").get<int>() > 0 && workers.at("bodies_reowned").get<int>() > 0;
        EXPECT_EQ(ended.out.find(" lost; ") != ended.out.npos, workers.at("lost").get<int>() > 0)
            << ended.out;
        expect_same_products(folder / "undisturbed", folder / "killed");
    }
    EXPECT_TRUE(lost);
}

}  // namespace
}  // namespace end_to_end
