#include "files/disk_log.h"

#include <gtest/gtest.h>
#include <sys/mount.h>
#include <unistd.h>

#include <fstream>
#include <numeric>
#include <string>
#include <vector>

#include "temporary_folder.h"

namespace app {
namespace {

double resident_mib() {
    std::ifstream file("/proc/self/statm");
    double all = 0, resident = 0;
    file >> all >> resident;
    return resident * static_cast<double>(sysconf(_SC_PAGESIZE)) / (1 << 20);
}

TEST(DiskLog, HoldsWhatWasAppendedInOneRowWithoutItsMemory) {
    const TemporaryFolder folder;
    for (const std::filesystem::path& where : {folder.path(), std::filesystem::path()}) {
        DiskLog<std::uint64_t> log(where);
        std::vector<std::uint64_t> part(1000);
        const double before = resident_mib();
        constexpr std::uint64_t kCount = 8'000'000;  // 61 MiB
        while (log.size() < kCount) {
            std::iota(part.begin(), part.end(), log.size());
            log.append(part);
            log.push_back(log.size());
        }
        EXPECT_LT(resident_mib() - before, 8) << "half a MiB, and what the system maps around it";
        for (std::size_t i = 0; i < log.size(); ++i) ASSERT_EQ(log[i], i);
        log.front() = 7;  // what was let go is still written to
        DiskLog<std::uint64_t> moved = std::move(log);
        EXPECT_TRUE(log.empty());
        EXPECT_EQ(moved.front(), 7U);
        moved.cut(3);
        EXPECT_EQ(std::vector(moved.begin(), moved.end()), (std::vector<std::uint64_t>{7, 1, 2}));
        EXPECT_TRUE(std::filesystem::is_empty(folder.path())) << "the file has no name";
    }
}

TEST(TextLog, GivesBackEachTextInItsPlace) {
    const TemporaryFolder folder;
    TextLog log(folder.path());
    EXPECT_EQ(log.size(), 0U);
    const std::vector<std::string> texts = {"", "one", "", std::string("zero\0inside", 11),
                                            std::string(300'000, 'x')};
    for (const std::string& text : texts) log.push_back(text);
    ASSERT_EQ(log.size(), texts.size());
    for (std::size_t i = 0; i < texts.size(); ++i) EXPECT_EQ(log[i], texts[i]) << i;
}

TEST(DiskLog, SaysThatTheDiskIsFullAndKeepsWhatItHas) {
    const TemporaryFolder folder;
    if (mount("none", folder.path().c_str(), "tmpfs", 0, "size=1m") != 0)
        GTEST_SKIP() << "needs the right to mount";
    {
        DiskLog<int> log(folder.path());
        EXPECT_THROW(while (log.size() < 1'000'000) log.push_back(static_cast<int>(log.size())),
                     std::runtime_error);
        EXPECT_GT(log.size(), 100'000U);
        EXPECT_EQ(log.back(), static_cast<int>(log.size()) - 1);
    }
    umount2(folder.path().c_str(), MNT_DETACH);
}

}  // namespace
}  // namespace app
