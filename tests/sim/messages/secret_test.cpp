#include "messages/secret.h"

#include <gtest/gtest.h>

namespace {

TEST(Secret, IsRandomAndReadsBackFromText) {
    const sim::Secret one = sim::make_secret(), other = sim::make_secret();
    EXPECT_NE(one, other);
    EXPECT_EQ(sim::from_hex(sim::to_hex(one)), one);
    EXPECT_EQ(sim::to_hex({0x0f, 0xa0}), "0fa0" + std::string(28, '0'));
    for (const char* text :
         {"", "0f", "0fa00000000000000000000000000000x", "zfa00000000000000000000000000000"})
        EXPECT_FALSE(sim::from_hex(text)) << text;
}

}  // namespace
