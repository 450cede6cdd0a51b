#include "files/checksum.h"

#include <gtest/gtest.h>
#include <tracking/trace.h>

#include <string_view>
#include <vector>

#include "files/output_folder.h"
#include "sample_play_result.h"

namespace {

std::span<const std::uint8_t> bytes_of(std::string_view text) {
    return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()};
}

/// The test vectors of FIPS 180: the empty message, "abc" and a million times "a" (more than one block of
/// reading).
TEST(Sha256, OfTheThreeMessagesOfTheStandard) {
    const TemporaryFolder folder;
    const auto digest = [&](std::string_view text) {
        app::write_file(folder.path() / "message", text);
        return app::sha256_of_file(folder.path() / "message");
    };
    EXPECT_EQ(digest(""), "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
    EXPECT_EQ(digest("abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
    EXPECT_EQ(digest(std::string(1000000, 'a')),
              "cdc76e5c9914fb9281a1c7e284d73e67f1809a48a497200e046d39ccc7112cd0");
}

TEST(Sha256, AFileThatIsMissingOrAFolderIsBadInputThatNamesIt) {
    const TemporaryFolder folder;
    for (const std::filesystem::path& path : {folder.path() / "absent.csv", folder.path()}) {
        try {
            (void)app::sha256_of_file(path);
            FAIL() << path;
        } catch (const tracking::TraceError& error) {
            EXPECT_TRUE(std::string(error.what()).starts_with(path.string() + ":1:1: error: found "))
                << error.what();
        }
    }
}

/// Values published with the algorithm.
TEST(Fnv1a, OfThePublishedStrings) {
    EXPECT_EQ(app::fnv1a_64(bytes_of("")), 0xcbf29ce484222325U);
    EXPECT_EQ(app::fnv1a_64(bytes_of("a")), 0xaf63dc4c8601ec8cU);
    EXPECT_EQ(app::fnv1a_64(bytes_of("foobar")), 0x85944171f73967e8U);
    EXPECT_EQ(app::fnv1a_64(bytes_of("bar"), app::fnv1a_64(bytes_of("foo"))), 0x85944171f73967e8U);
}

TEST(Fingerprint, Is16HexDigitsRepeatsAndChangesWithOneByteOfTheFrame) {
    std::vector<std::uint8_t> frame(3000, 17);
    const std::string first = app::fingerprint(frame);
    EXPECT_EQ(first.size(), 16U);
    EXPECT_EQ(first.find_first_not_of("0123456789abcdef"), std::string::npos);
    EXPECT_EQ(app::fingerprint(frame), first);
    frame[2999] ^= 1;
    EXPECT_NE(app::fingerprint(frame), first);
}

}  // namespace
