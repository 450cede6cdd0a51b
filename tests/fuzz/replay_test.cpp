// Each decoder reads its corpus, then damaged copies of it: always the same ones.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>
#include <string>
#include <vector>

#include "damaged_bytes.h"
#include "fuzz_target.h"

void PrintTo(const FuzzTarget& target, std::ostream* out);
void PrintTo(const FuzzTarget& target, std::ostream* out) {
    *out << target.name;
}

namespace {

namespace fs = std::filesystem;

std::vector<fs::path> corpus(std::string_view decoder) {
    std::vector<fs::path> files;
    for (const auto& entry :
         fs::directory_iterator(fs::path(MUSICWORLD_SOURCE_DIR "/tests/fuzz/corpora") / decoder))
        files.push_back(entry.path());
    std::ranges::sort(files);
    return files;
}

std::vector<std::uint8_t> bytes_of(const fs::path& file) {
    std::ifstream in(file, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
}

std::string_view view(const std::vector<std::uint8_t>& bytes) {
    return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

class Decoders : public testing::TestWithParam<FuzzTarget> {};

TEST_P(Decoders, ReadsItsCorpusAndDamagedCopiesOfItOrThrowsItsOwnError) {
    constexpr std::size_t kCopies = 2000;  // of all files together, at least one of each
    const std::vector<fs::path> files = corpus(GetParam().name);
    ASSERT_FALSE(files.empty());
    std::mt19937 random(1);
    for (const fs::path& file : files) {
        SCOPED_TRACE(file);
        const std::vector<std::uint8_t> bytes = bytes_of(file);
        ASSERT_NO_THROW(GetParam().fuzz(view(bytes)));
        for (std::size_t i = 0; i <= kCopies / files.size(); ++i)
            ASSERT_NO_THROW(GetParam().fuzz(view(damaged(bytes, random)))) << "copy " << i;
    }
}

std::string name_of(const testing::TestParamInfo<FuzzTarget>& info) {
    return std::string(info.param.name);
}

INSTANTIATE_TEST_SUITE_P(Each, Decoders, testing::ValuesIn(kFuzzTargets), name_of);

}  // namespace
