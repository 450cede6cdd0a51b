#include "files/output_file.h"

#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <cstring>
#include <fstream>
#include <iterator>

#include "files/bad_input.h"
#include "temporary_folder.h"

namespace {
namespace fs = std::filesystem;
using Kind = app::OutputPlace::Kind;

std::string content_of(const fs::path& file) {
    std::ifstream in(file, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

std::size_t count_in(const fs::path& folder) {
    return static_cast<std::size_t>(std::distance(fs::directory_iterator(folder), {}));
}

TEST(OutputPlace, IsBehindAllLinks) {
    const TemporaryFolder here;
    const fs::path file = here.write("file", "x"), folder = here.path() / "folder";
    fs::create_directory(folder);
    fs::create_symlink("../file", folder / "one");
    fs::create_symlink(folder / "one", here.path() / "two");
    fs::create_symlink("nothing", here.path() / "three");
    EXPECT_EQ(app::output_place(file).kind, Kind::file);
    EXPECT_EQ(app::output_place(folder).kind, Kind::folder);
    EXPECT_EQ(app::output_place("/dev/null").kind, Kind::written_to);
    const app::OutputPlace two = app::output_place(here.path() / "two");
    EXPECT_EQ(two.kind, Kind::file);
    EXPECT_TRUE(fs::equivalent(two.path, file));
    EXPECT_FALSE(fs::is_symlink(two.path));
    const app::OutputPlace three = app::output_place(here.path() / "three");
    EXPECT_EQ(three.kind, Kind::nothing);
    EXPECT_EQ(three.path, here.path() / "nothing");
}

TEST(OutputPlace, RefusesCirclesSocketsAndNamesThatAreTooLong) {
    const TemporaryFolder here;
    fs::create_symlink("b", here.path() / "a");
    fs::create_symlink("a", here.path() / "b");
    EXPECT_THROW((void)app::output_place(here.path() / "a"), app::BadInput);
    EXPECT_THROW((void)app::output_place(here.path() / std::string(256, 'n')), app::BadInput);
    const int listener = socket(AF_UNIX, SOCK_STREAM, 0);
    sockaddr_un address{AF_UNIX, {}};
    std::strncpy(address.sun_path, (here.path() / "s").c_str(), sizeof address.sun_path - 1);
    ASSERT_EQ(bind(listener, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
    EXPECT_THROW((void)app::output_place(here.path() / "s"), app::BadInput);
    close(listener);
}

TEST(OutputFile, IsThereWhenItIsFinishedAndLeavesNothingOtherwise) {
    const TemporaryFolder here;
    const fs::path file = here.write("file", "old");
    {
        const app::OutputFile out(file);
        app::write_file(out.partial(), std::string("half"));
        EXPECT_EQ(content_of(file), "old");
    }
    EXPECT_EQ(content_of(file), "old");
    app::OutputFile out(file);
    app::write_file(out.partial(), std::string("new"));
    out.finish();
    EXPECT_EQ(content_of(file), "new");
    EXPECT_EQ(count_in(here.path()), 1u);
    EXPECT_THROW(app::write_finished_file("/dev/full", std::string("x")), std::runtime_error);
    EXPECT_TRUE(fs::is_character_file("/dev/full"));
}

TEST(OutputFile, WithoutAWriteLeavesThePartialFileThatWasThere) {
    const TemporaryFolder here;
    here.write("file.partial", "of an earlier run");
    { const app::OutputFile out(here.path() / "file"); }
    EXPECT_EQ(content_of(here.path() / "file.partial"), "of an earlier run");
}

/// What lies at FILE.partial and is no file is another's.
TEST(OutputFile, WritesThroughNoLinkThatWasLaid) {
    const TemporaryFolder here;
    const fs::path victim = here.write("victim", "mine");
    fs::create_symlink("victim", here.path() / "file.partial");
    EXPECT_THROW(app::OutputFile(here.path() / "file"), app::BadInput);
    EXPECT_EQ(content_of(victim), "mine");
}

TEST(PutInPlace, CopiesToAnotherFileSystem) {
    const TemporaryFolder here;
    const fs::path other = "/dev/shm/musicworld_test_" + std::to_string(getpid());
    struct stat a {
    }, b{};
    if (stat(here.path().c_str(), &a) != 0 || stat("/dev/shm", &b) != 0 || a.st_dev == b.st_dev)
        GTEST_SKIP() << "needs two file systems";
    fs::create_directory(other);
    fs::create_symlink(other / "file", here.path() / "file");
    fs::create_symlink(other / "folder", here.path() / "folder");
    app::put_in_place(here.write("staged", "text"), here.path() / "file");
    fs::create_directory(here.path() / "stage");
    here.write("stage/one", "1");
    app::put_in_place(here.path() / "stage", here.path() / "folder");
    EXPECT_EQ(content_of(other / "file"), "text");
    EXPECT_EQ(content_of(other / "folder/one"), "1");
    EXPECT_EQ(count_in(other), 2u);
    EXPECT_EQ(count_in(here.path()), 2u) << "the links alone";

    // What lies where the copy is to be made and is no file is another's.
    fs::create_directory(other / "file.partial");
    std::ofstream(other / "file.partial/mine") << "mine";
    EXPECT_THROW(app::put_in_place(here.write("staged", "new"), here.path() / "file"), app::BadInput);
    EXPECT_EQ(content_of(other / "file.partial/mine"), "mine");
    EXPECT_EQ(content_of(other / "file"), "text");
    EXPECT_EQ(content_of(here.path() / "staged"), "new");
    fs::remove_all(other);
}

TEST(PutInPlace, AFolderThatMayBeWrittenButNotReadDoes) {
    if (geteuid() != 0) GTEST_SKIP() << "needs to become another user";
    constexpr uid_t kNobody = 65534;
    const TemporaryFolder here;
    fs::permissions(here.path(), fs::perms(0733));
    ASSERT_EQ(seteuid(kNobody), 0);
    std::string failure;
    try {
        app::write_finished_file(here.path() / "file", std::string("text"));
    } catch (const std::exception& failed) {
        failure = failed.what();
    }
    ASSERT_EQ(seteuid(0), 0);
    EXPECT_EQ(failure, "");
    EXPECT_EQ(content_of(here.path() / "file"), "text");
}

/// As standard output of a program that a server started.
TEST(PutInPlace, AnOpenSocketIsWrittenTo) {
    int ends[2];
    ASSERT_EQ(socketpair(AF_UNIX, SOCK_STREAM, 0, ends), 0);
    const std::string name = "/dev/fd/" + std::to_string(ends[0]);
    EXPECT_EQ(app::output_place(name).kind, Kind::written_to);
    app::write_finished_file(name, std::string("text"));
    char got[5] = {};
    EXPECT_EQ(read(ends[1], got, 4), 4);
    EXPECT_STREQ(got, "text");
    close(ends[0]);
    close(ends[1]);
}

}  // namespace
