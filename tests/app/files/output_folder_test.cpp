#include "files/output_folder.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <fstream>
#include <iterator>
#include <optional>
#include <set>

#include "files/bad_input.h"
#include "sample_play_result.h"

namespace {
namespace fs = std::filesystem;

std::set<std::string> names_in(const fs::path& folder) {
    std::set<std::string> names;
    for (const fs::directory_entry& entry : fs::directory_iterator(folder))
        names.insert(entry.path().filename().string());
    return names;
}

std::string text_of(const fs::path& file) {
    std::ifstream in(file, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

void write_frames(const app::OutputFolder& out, int count) {
    fs::create_directory(out.path("frames"));
    for (int i = 0; i < count; ++i)
        app::write_file(out.path("frames") / ("00000" + std::to_string(i) + ".png"), "png");
}

/// The one line that BadInput has for a folder; empty if the folder is accepted.
std::string refusal(const fs::path& folder) {
    try {
        const app::OutputFolder out(folder);
    } catch (const app::BadInput& error) {
        return error.what();
    }
    return {};
}

using Names = std::set<std::string>;

TEST(OutputFolder, NothingIsInPlaceBeforeFinishAndOnlyProductsAfter) {
    const TemporaryFolder here;
    const fs::path target = here.path() / "a" / "b";
    app::OutputFolder out(target);
    app::write_file(out.path("events.csv"), "id\n");
    app::write_file(out.path("summary.json"), "{}");
    app::write_file(out.scratch() / "plot.gp", "plot");
    write_frames(out, 3);
    EXPECT_EQ(names_in(target), (Names{".unfinished"}));
    out.finish();
    EXPECT_EQ(names_in(target), (Names{"events.csv", "frames", "summary.json"}));
    EXPECT_EQ(names_in(target / "frames").size(), 3U);
    EXPECT_EQ(text_of(target / "events.csv"), "id\n");
}

TEST(OutputFolder, ASecondRunReplacesTheFirstsProductsAndLeavesNoneOfThemBeside) {
    const TemporaryFolder here;
    {
        app::OutputFolder out(here.path());
        for (const char* name :
             {"audio.wav", "events.csv", "contacts.csv", "hits.mid", "summary.json", "report.html"})
            app::write_file(out.path(name), "old");
        write_frames(out, 5);
        out.finish();
    }
    app::write_file(here.path() / "notes.txt", "mine");
    app::OutputFolder out(here.path());
    app::write_file(out.path("events.csv"), "new");
    write_frames(out, 2);
    app::write_file(out.path("summary.json"), "new");
    EXPECT_EQ(text_of(here.path() / "audio.wav"), "old") << "the old run stays until the new one is complete";
    out.finish();
    EXPECT_EQ(names_in(here.path()), (Names{"events.csv", "frames", "notes.txt", "summary.json"}));
    EXPECT_EQ(names_in(here.path() / "frames").size(), 2U);
    EXPECT_EQ(text_of(here.path() / "events.csv"), "new");
    EXPECT_EQ(text_of(here.path() / "notes.txt"), "mine");
}

TEST(OutputFolder, WithoutFinishTheStagedFilesGoAndTheOldRunStays) {
    const TemporaryFolder here;
    app::write_file(here.path() / "summary.json", "old");
    {
        const app::OutputFolder out(here.path());
        app::write_file(out.path("summary.json"), "new");
    }
    EXPECT_EQ(names_in(here.path()), (Names{"summary.json"}));
    EXPECT_EQ(text_of(here.path() / "summary.json"), "old");
    { const app::OutputFolder out(here.path() / "fresh"); }
    EXPECT_FALSE(fs::exists(here.path() / "fresh")) << "a folder made for a failed run goes with it";
}

TEST(OutputFolder, AKilledRunLeavesNoProductAndTheNextRunClearsUpAfterIt) {
    const TemporaryFolder here;
    const pid_t child = fork();
    ASSERT_GE(child, 0);
    if (child == 0) {
        const app::OutputFolder out(here.path());
        app::write_file(out.path("audio.wav"), "half");
        app::write_file(out.path("summary.json"), "{}");
        _exit(0);  // no destructor, as if killed
    }
    ASSERT_EQ(waitpid(child, nullptr, 0), child);
    EXPECT_EQ(names_in(here.path()), (Names{".unfinished"}));
    app::OutputFolder out(here.path());
    EXPECT_EQ(names_in(here.path() / ".unfinished"), (Names{"scratch"}));
    out.finish();
    EXPECT_EQ(names_in(here.path()), Names{});
}

TEST(OutputFolder, WhenMovingFailsHalfWayThereIsNoSummary) {
    const TemporaryFolder here;
    app::write_file(here.path() / "summary.json", "old");
    fs::create_directories(here.path() / "video.mp4" / "in the way");
    {
        app::OutputFolder out(here.path());
        for (const char* name : {"events.csv", "summary.json", "video.mp4"})
            app::write_file(out.path(name), "new");
        try {
            out.finish();
            FAIL();
        } catch (const app::BadInput&) {
            FAIL() << "the run had begun";
        } catch (const std::runtime_error& error) {
            EXPECT_NE(std::string(error.what()).find("video.mp4"), std::string::npos) << error.what();
            EXPECT_NE(std::string(error.what()).find(".unfinished"), std::string::npos) << error.what();
        }
    }
    EXPECT_FALSE(fs::exists(here.path() / "summary.json"));
    EXPECT_EQ(text_of(here.path() / "events.csv"), "new");
    for (const char* name : {"summary.json", "video.mp4"})
        EXPECT_EQ(text_of(here.path() / ".unfinished" / name), "new") << "what was computed is kept";
}

TEST(OutputFolder, AFileInTheWayIsBadInputThatNamesIt) {
    const TemporaryFolder here;
    app::write_file(here.path() / "file", "x");
    for (const fs::path& path : {here.path() / "file", here.path() / "file" / "below"}) {
        const std::string line = refusal(path);
        EXPECT_TRUE(line.starts_with(path.string() + ": error: found ")) << line;
        EXPECT_EQ(line.find('\n'), std::string::npos);
    }
    EXPECT_EQ(text_of(here.path() / "file"), "x");
}

/// Permission bits do not hold back the superuser; these places refuse everybody.
TEST(OutputFolder, PlacesWhereNothingCanBeMadeAreBadInput) {
    const TemporaryFolder here;
    fs::create_symlink("circle", here.path() / "circle");
    for (const fs::path& path : {fs::path("/proc/out"), fs::path("/proc"), fs::path("/dev/null/out"),
                                 fs::path(""), here.path() / "circle", here.path() / std::string(300, 'n')})
        EXPECT_NE(refusal(path).find("error: found "), std::string::npos) << path;
}

TEST(OutputFolder, AFolderServesOneRunAtATime) {
    const TemporaryFolder here;
    std::optional<app::OutputFolder> first(std::in_place, here.path());
    app::write_file(first->path("events.csv"), "first");
    EXPECT_NE(refusal(here.path()).find("another run"), std::string::npos);
    EXPECT_EQ(text_of(first->path("events.csv")), "first") << "the refused run touched nothing";
    first.reset();
    EXPECT_EQ(refusal(here.path()), "");
}

TEST(OutputFolder, AForeignFileInFramesIsRefusedBeforeTheRunAndKept) {
    const TemporaryFolder here;
    fs::create_directory(here.path() / "frames");
    app::write_file(here.path() / "frames" / "000000.png", "png");
    EXPECT_EQ(refusal(here.path()), "");
    for (const char* name : {"holiday.png", "000001.jpg", "123.png"}) {
        app::write_file(here.path() / "frames" / name, "mine");
        EXPECT_NE(refusal(here.path()).find(name), std::string::npos);
        EXPECT_EQ(text_of(here.path() / "frames" / name), "mine");
        fs::remove(here.path() / "frames" / name);
    }
}

TEST(OutputFolder, LinksToAFolderOfTheRunAreFollowed) {
    const TemporaryFolder here;
    fs::create_directories(here.path() / "pictures");
    app::write_file(here.path() / "pictures" / "holiday.png", "mine");
    fs::create_directory(here.path() / "out");
    fs::create_directory_symlink(here.path() / "pictures", here.path() / "out" / "frames");
    EXPECT_NE(refusal(here.path() / "out").find("holiday.png"), std::string::npos);
    EXPECT_EQ(text_of(here.path() / "pictures" / "holiday.png"), "mine");
    fs::remove(here.path() / "pictures" / "holiday.png");
    app::write_file(here.path() / "pictures" / "000007.png", "old");
    fs::create_directory_symlink("to be made", here.path() / "dangling");
    fs::create_directory_symlink("out", here.path() / "link");
    for (const char* name : {"link", "dangling"}) {
        app::OutputFolder out(here.path() / name);
        write_frames(out, 1);
        out.finish();
        EXPECT_TRUE(fs::is_symlink(here.path() / name));
    }
    EXPECT_TRUE(fs::is_symlink(here.path() / "out" / "frames"));
    EXPECT_EQ(names_in(here.path() / "pictures"), (Names{"000000.png"}));
    EXPECT_EQ(names_in(here.path() / "to be made" / "frames"), (Names{"000000.png"}));
}

TEST(OutputFolder, WhatAdornsARunMayFailAndIsTold) {
    const TemporaryFolder here;
    app::OutputFolder out(here.path() / "out");
    app::write_file(out.path("summary.json"), "{}");
    fs::create_directory(here.path() / "out" / "page.html");  // in the way
    out.adorn("page.html", [&] { app::write_file(out.path("page.html"), "page"); });
    out.adorn("report.html", [] { throw std::runtime_error("error: no plots"); });
    out.finish();
    EXPECT_EQ(names_in(here.path() / "out"), (Names{"page.html", "summary.json"}));
    ASSERT_EQ(out.failures().size(), 2u);
    EXPECT_EQ(out.failures()[0], "error: no plots");
    EXPECT_NE(out.failures()[1].find("page.html"), std::string::npos) << out.failures()[1];
    try {
        app::throw_if_any({"error: no plots", "error: no film"}, here.path());
        FAIL();
    } catch (const std::runtime_error& told) {
        EXPECT_EQ(told.what(), "error: no plots; no film; all else is in " + here.path().string());
    }
    EXPECT_NO_THROW(app::throw_if_any({}, here.path()));
}

/// All descriptors but those in reserve are used up when the products are written.
TEST(OutputFolder, FinishesWithTheDescriptorsInReserve) {
    const TemporaryFolder here;
    std::vector<app::FileDescriptor> others;
    app::OutputFolder out(here.path() / "out");
    rlimit before{};
    ASSERT_EQ(getrlimit(RLIMIT_NOFILE, &before), 0);
    rlimit small = before;
    small.rlim_cur = 256;
    ASSERT_EQ(setrlimit(RLIMIT_NOFILE, &small), 0);
    while (app::FileDescriptor other = app::open_file("/dev/null", O_RDONLY))
        others.push_back(std::move(other));
    EXPECT_THROW(app::write_file(out.path("events.csv"), "id\n"), std::runtime_error);
    out.free_reserve();
    app::write_file(out.path("events.csv"), "id\n");
    app::write_file(out.path("summary.json"), "{}");
    write_frames(out, 3);
    out.finish();
    others.clear();
    ASSERT_EQ(setrlimit(RLIMIT_NOFILE, &before), 0);
    EXPECT_EQ(names_in(here.path() / "out"), (Names{"events.csv", "frames", "summary.json"}));
}

TEST(WriteFile, AFullDiskIsARuntimeErrorThatNamesTheFileAndTheReason) {
    try {
        app::write_file("/dev/full", std::string(100000, 'x'));
        FAIL();
    } catch (const app::BadInput&) {
        FAIL() << "a full disk is no bad input";
    } catch (const std::runtime_error& error) {
        const std::string line = error.what();
        EXPECT_TRUE(line.starts_with("error: cannot write /dev/full: ")) << line;
        EXPECT_NE(line.find("No space left"), std::string::npos) << line;
    }
}

TEST(WriteFile, AFolderThatIsNotThereIsARuntimeError) {
    EXPECT_THROW(app::write_file("/proc/nowhere/file", "x"), std::runtime_error);
}

TEST(WriteFile, ReplacesALongerFileAndTakesBytesAndEmptyText) {
    const TemporaryFolder here;
    const fs::path file = here.path() / "file";
    app::write_file(file, "a longer text");
    app::write_file(file, std::vector<std::uint8_t>{0, 255, 10});
    EXPECT_EQ(text_of(file), std::string("\0\xff\n", 3));
    app::write_file(file, "");
    EXPECT_EQ(text_of(file), "");
}

}  // namespace
