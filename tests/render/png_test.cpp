#include <gtest/gtest.h>

#include <random>
#include <stdexcept>

#include "render/renderer.h"

namespace {

render::Image noise(int width, int height, unsigned seed) {
    std::mt19937 random(seed);
    render::Image image{width, height, {}};
    for (int i = 0; i < 3 * width * height; ++i) image.rgb.push_back(static_cast<std::uint8_t>(random()));
    return image;
}

TEST(Png, DecodingWhatWasEncodedGivesTheSamePixelsForOddAndEvenSizes) {
    for (const auto& [width, height] : {std::pair{1, 1}, {7, 5}, {64, 48}, {3, 200}}) {
        const render::Image image = noise(width, height, 1);
        const render::Image back = render::decode_png(render::encode_png(image));
        EXPECT_EQ(back.width, width);
        EXPECT_EQ(back.height, height);
        EXPECT_EQ(back.rgb, image.rgb);
    }
}

TEST(Png, TheSamePixelsGiveTheSameBytesWithThePngSignature) {
    const std::vector<std::uint8_t> bytes = render::encode_png(noise(20, 10, 2));
    EXPECT_EQ(bytes, render::encode_png(noise(20, 10, 2)));
    const std::vector<std::uint8_t> signature = {0x89, 'P', 'N', 'G', '\r', '\n', 0x1a, '\n'};
    ASSERT_GE(bytes.size(), signature.size());
    EXPECT_TRUE(std::equal(signature.begin(), signature.end(), bytes.begin()));
}

TEST(Png, ImagesThatFollowEachOtherHaveTheBytesThatTheyHaveAlone) {
    std::mt19937 random(3);
    render::PngEncoder encoder;
    render::Image image = noise(33, 50, 4);
    for (int k = 0; k < 60; ++k) {
        if (k == 30) image = noise(50, 33, 5);  // another size, as many pixels
        const std::vector<std::uint8_t> bytes = encoder.encode(image);
        ASSERT_EQ(bytes, render::encode_png(image)) << k;
        ASSERT_EQ(render::decode_png(bytes).rgb, image.rgb) << k;
        for (unsigned changes = random() % 3; changes > 0; --changes)
            ++image.rgb[random() % image.rgb.size()];
    }
}

TEST(Png, AnImageWithoutPixelsOrWithTooFewBytesIsRefused) {
    EXPECT_THROW((void)render::encode_png({}), std::invalid_argument);
    EXPECT_THROW((void)render::encode_png({2, 2, {1, 2, 3}}), std::invalid_argument);
}

TEST(Png, ThreeThousandDamagedFilesEndInAnErrorOrAnImageOfTheStatedSize) {
    const std::vector<std::uint8_t> sound = render::encode_png(noise(24, 18, 3));
    std::mt19937 random(4);
    for (int round = 0; round < 3000; ++round) {
        std::vector<std::uint8_t> bytes = sound;
        for (unsigned change = 0; change <= random() % 4; ++change)
            bytes[random() % bytes.size()] = static_cast<std::uint8_t>(random());
        if (random() % 4 == 0) bytes.resize(random() % bytes.size());
        try {
            const render::Image image = render::decode_png(bytes);
            EXPECT_EQ(image.rgb.size(), std::size_t{3} * static_cast<std::size_t>(image.width) *
                                            static_cast<std::size_t>(image.height));
        } catch (const std::runtime_error& error) {
            EXPECT_EQ(std::string(error.what()).rfind("PNG: error: found ", 0), 0u) << error.what();
        }
    }
}

}  // namespace
