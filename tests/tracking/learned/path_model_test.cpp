#include "tracking/path_model.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <limits>

#include "learned/contact_view.h"
#include "learned/learned_path.h"
#include "learned/model_of_random_weights.h"
#include "learned/network_training.h"
#include "mutation.h"
#include "tracking/trace.h"

namespace tracking {
namespace {

std::string message_of(const std::string& bytes) {
    try {
        (void)parse_path_model(bytes, "m.model");
    } catch (const TraceError& error) {
        return error.what();
    }
    return "accepted";
}

TEST(PathModel, ComesBackToTheBit) {
    PathModel model = model_of_random_weights(32, 7);
    model.provenance = {{"made_by", "a test: with a colon"}, {"input", "abc"}, {"input", "def"}};
    const std::string bytes = format_path_model(model);
    const PathModel back = parse_path_model(bytes, "m.model");
    EXPECT_EQ(format_path_model(back), bytes);
    EXPECT_EQ(back.provenance, model.provenance);
    for (std::size_t i = 0; i < model.layers.size(); ++i) {
        EXPECT_EQ(back.layers[i].weights, model.layers[i].weights);
        EXPECT_EQ(back.layers[i].bias, model.layers[i].bias);
    }
}

/// With a network of contacts.
PathModel with_contacts(std::size_t hidden) {
    PathModel model = model_of_random_weights(hidden, 3);
    RandomStream random(5);
    model.contacts =
        initial_layers(kContactInputs, std::min<std::size_t>(hidden, 64), kContactOutputs, random);
    return model;
}

TEST(PathModel, ComesBackWithItsNetworkOfContacts) {
    const PathModel model = with_contacts(16);
    const std::string bytes = format_path_model(model);
    const PathModel back = parse_path_model(bytes, "m.model");
    EXPECT_EQ(format_path_model(back), bytes);
    ASSERT_TRUE(back.contacts);
    for (std::size_t i = 0; i < 3; ++i) EXPECT_EQ((*back.contacts)[i].weights, (*model.contacts)[i].weights);
    EXPECT_LT(format_path_model(with_contacts(PathModel::kMostHidden)).size(), 196000U);  // and a head
    for (std::size_t at = 0; at < bytes.size(); at += at < 300 ? 1 : 97) {
        std::string changed = bytes;
        changed[at] = static_cast<char>(changed[at] ^ 0x20);
        EXPECT_TRUE(message_of(changed).starts_with("m.model:")) << at;
        EXPECT_TRUE(message_of(bytes.substr(0, at)).starts_with("m.model:")) << at;
    }
    std::string other = bytes;
    other.replace(other.find("contacts: 106"), 13, "contacts: 107");
    EXPECT_NE(message_of(other).find("expected sizes 106 N N 19"), std::string::npos) << message_of(other);
}

/// With the trust of two sticks, every number another.
PathModel with_trust() {
    PathModel model = with_contacts(8);
    double next = 0.125;
    for (const char* stick : {"left", "r\xc3\xa9-2"}) {
        Trust& trust = model.trust.emplace_back();
        trust.stick = stick;
        for (Trust::Lead& lead : trust.leads) {
            for (Trust::Sums* sums : {&lead.position, &lead.shaft})
                *sums = {next, -next / 2, next * 3, next * 5, next * 7, next * 11};
            lead.regions = {next * 13, next * 17, {-next, next}};
            next += 0.25;
        }
    }
    return model;
}

TEST(PathModel, ComesBackWithTheTrustOfItsSticks) {
    const PathModel model = with_trust();
    const std::string bytes = format_path_model(model);
    EXPECT_NE(bytes.find("\ntrust: left\ntrust: r\xc3\xa9-2\nchecksum: "), std::string::npos);
    const PathModel back = parse_path_model(bytes, "m.model");
    EXPECT_EQ(format_path_model(back), bytes);
    ASSERT_EQ(back.trust.size(), 2U);
    EXPECT_EQ(back.trust[1].stick, "r\xc3\xa9-2");
    EXPECT_EQ(std::memcmp(&back.trust[1].leads, &model.trust[1].leads, sizeof model.trust[1].leads), 0);
    // Without it the file is what it was before there was any.
    PathModel plain = model;
    plain.trust.clear();
    EXPECT_EQ(format_path_model(plain).find("trust: "), std::string::npos);
    EXPECT_EQ(bytes.size() - format_path_model(plain).size(),
              2 * 80 * sizeof(double) + std::string_view("trust: left\ntrust: r\xc3\xa9-2\n").size());
}

TEST(PathModel, DamagedTrustIsRefusedWithItsPlace) {
    const PathModel model = with_trust();
    const std::string bytes = format_path_model(model);
    for (std::size_t at = bytes.size() - 2 * 80 * sizeof(double); at < bytes.size(); at += 13) {
        std::string changed = bytes;
        changed[at] = static_cast<char>(changed[at] ^ 0x20);
        EXPECT_TRUE(message_of(changed).starts_with("m.model:")) << at;
        EXPECT_TRUE(message_of(bytes.substr(0, at)).starts_with("m.model:")) << at;
    }
    for (const double wrong : {std::numeric_limits<double>::quiet_NaN(), -1e-9, 1e13}) {
        PathModel bad = model;
        bad.trust[1].leads[4].shaft.model_square = wrong;
        const std::string message = message_of(format_path_model(bad));
        EXPECT_NE(message.find("a number of trust of"), std::string::npos) << message;
        EXPECT_NE(message.find("expected one from 0 to 1e+12; "), std::string::npos) << message;
        EXPECT_EQ(message.find("-0.0"), std::string::npos) << message;
        EXPECT_TRUE(message.starts_with("m.model:byte ")) << message;
    }
    const std::string no_text =
        message_of(std::string(bytes).replace(bytes.find("\ntrust: left") + 8, 1, "\xff"));
    EXPECT_NE(no_text.find(": error: found byte 0xff, expected UTF-8"), std::string::npos) << no_text;
    EXPECT_NE(no_text.find("; make it again with `musicworld train`"), std::string::npos) << no_text;
    PathModel twice = model;
    twice.trust[1].stick = "left";
    EXPECT_NE(message_of(format_path_model(twice)).find("found 'left', expected the name of another stick"),
              std::string::npos);
    for (const char* no_word : {"", "two words", "two\twords", "two\nlines"}) {
        PathModel bad = model;
        bad.trust[0].stick = no_word;
        EXPECT_THROW((void)format_path_model(bad), std::invalid_argument) << no_word;
    }
}

TEST(PathModel, OfTheGreatestSizeTakesLessThan200kB) {
    EXPECT_LT(format_path_model(model_of_random_weights(PathModel::kMostHidden, 1)).size(), 200000U);
}

TEST(PathModel, EveryTruncationAndEveryChangedByteIsRefusedWithItsPlace) {
    const std::string bytes = format_path_model(model_of_random_weights(8, 3));
    for (std::size_t length = 0; length < bytes.size(); length += length < 200 ? 1 : 97)
        EXPECT_TRUE(message_of(bytes.substr(0, length)).starts_with("m.model:")) << length;
    for (std::size_t at = 0; at < bytes.size(); at += at < 200 ? 1 : 97) {
        std::string changed = bytes;
        changed[at] = static_cast<char>(changed[at] ^ 0x20);
        EXPECT_TRUE(message_of(changed).starts_with("m.model:")) << at;
    }
    EXPECT_TRUE(message_of(bytes + "x").starts_with("m.model:byte"));
}

TEST(PathModel, SaysWhatIsWrong) {
    const PathModel good = model_of_random_weights(8, 3);
    const std::string bytes = format_path_model(good);
    EXPECT_NE(message_of("t,stick,px\n0,left,1\n\n").find("m.model:1:1: error: found"), std::string::npos);
    std::string other = bytes;
    other.replace(other.find(" 1\n"), 3, " 2\n");
    EXPECT_NE(message_of(other).find("MusicWorld path model 1"), std::string::npos);
    std::string sizes = bytes;
    sizes.replace(sizes.find(" 8 8 "), 5, " 8 9 ");
    EXPECT_NE(message_of(sizes).find("bytes of weights, expected"), std::string::npos);
    sizes.replace(sizes.find("sizes: "), 9, "sizes: 87");
    EXPECT_NE(message_of(sizes).find("m.model:2:8: error: found"), std::string::npos);
    std::string early = bytes;
    early.insert(early.find("sizes: "), "checksum: 0\n");
    EXPECT_NE(message_of(early).find("m.model:2:1: error: found 'checksum: 0', expected the line \"sizes"),
              std::string::npos)
        << message_of(early);
    for (const float wrong :
         {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity(), 1e7F}) {
        PathModel bad = good;
        bad.layers[1].weights(3, 2) = wrong;
        EXPECT_NE(message_of(format_path_model(bad)).find("a finite one"), std::string::npos) << wrong;
    }
}

TEST(PathModel, ProvenanceThatTheFormatCannotHoldIsRefused) {
    PathModel model = model_of_random_weights(8, 3);
    for (const auto& line :
         {std::pair("two words", "x"), {"", "x"}, {"key", "two\nlines"}, {"checksum", "0"}}) {
        model.provenance = {line};
        EXPECT_THROW((void)format_path_model(model), std::invalid_argument) << line.first;
    }
}

TEST(PathModel, MutatedFilesAreRefusedOrHarmless) {
    const std::string bytes = format_path_model(model_of_random_weights(8, 3));
    std::mt19937 random(5);
    int refused = 0;
    for (int i = 0; i < 3000; ++i) {
        try {
            (void)parse_path_model(mutated(bytes, random), "fuzz.model");
        } catch (const TraceError& error) {
            ++refused;
            expect_located(error.what());
        }
    }
    EXPECT_GT(refused, 2700);  // the others' edits leave every byte as it was
}

}  // namespace
}  // namespace tracking
