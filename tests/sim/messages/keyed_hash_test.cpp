#include "messages/keyed_hash.h"

#include <gtest/gtest.h>

#include <numeric>
#include <vector>

namespace {

// The vectors of the reference implementation (github.com/veorq/SipHash, vectors.h): key 00 .. 0f, messages of the
// bytes 00, 01, ... of each length.
TEST(KeyedHash, IsSipHash24) {
    sim::Secret key;
    std::iota(key.begin(), key.end(), std::uint8_t{0});
    std::vector<std::uint8_t> message(15);
    std::iota(message.begin(), message.end(), std::uint8_t{0});
    const auto of = [&](std::size_t length) {
        return sim::keyed_hash(key, std::span(message).first(length));
    };
    EXPECT_EQ(of(0), 0x726fdb47dd0e0e31u);
    EXPECT_EQ(of(1), 0x74f839c593dc67fdu);
    EXPECT_EQ(of(8), 0x93f5f5799a932462u);
    EXPECT_EQ(of(15), 0xa129ca6149be45e5u);  // the paper's example, too
}

TEST(KeyedHash, SecretsAreRandomAndReadBackFromText) {
    const sim::Secret one = sim::make_secret(), other = sim::make_secret();
    EXPECT_NE(one, other);
    EXPECT_EQ(sim::from_hex(sim::to_hex(one)), one);
    EXPECT_EQ(sim::to_hex({0x0f, 0xa0}), "0fa0" + std::string(28, '0'));
    for (const char* text :
         {"", "0f", "0fa00000000000000000000000000000x", "zfa00000000000000000000000000000"})
        EXPECT_FALSE(sim::from_hex(text)) << text;
}

}  // namespace
