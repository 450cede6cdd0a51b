#pragma once
#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <string>

#include "tracking/trace.h"

namespace tracking {

/// What every trace promises, wherever it came from; no coordinate beyond `farthest_m`: 1000 m, and a
/// rounding where units or axes were converted.
inline void expect_valid(const Trace& trace, double farthest_m = 1000 * (1 + 1e-12)) {
    ASSERT_FALSE(trace.sticks.empty());
    for (const StickTrace& stick : trace.sticks) {
        ASSERT_GE(stick.samples.size(), 2u);
        ASSERT_FALSE(stick.name.empty());
        for (std::size_t i = 0; i < stick.samples.size(); ++i) {
            const PoseSample& sample = stick.samples[i];
            ASSERT_TRUE(sample.position.allFinite());
            ASSERT_LE(sample.position.cwiseAbs().maxCoeff(), farthest_m);
            ASSERT_LE(std::abs(sample.t_s), 1e7);
            ASSERT_NEAR(sample.orientation.norm(), 1, 1e-12);
            ASSERT_TRUE(i == 0 || sample.t_s > stick.samples[i - 1].t_s);
        }
    }
    static_cast<void>(format_trace(trace));
}

/// One line FILE:PLACE: error: found ..., expected ...
inline void expect_located(const std::string& message) {
    ASSERT_TRUE(message.starts_with("fuzz.")) << message;
    ASSERT_NE(message.find(": error: found "), std::string::npos) << message;
    ASSERT_NE(message.find(", expected "), std::string::npos) << message;
    ASSERT_EQ(message.find_first_of(std::string("\n\r\0", 3)), std::string::npos) << message;
}

/// `text` with one to three places changed, left out, repeated or cut off.
inline std::string mutated(std::string text, std::mt19937& random) {
    const auto below = [&](std::size_t n) { return static_cast<std::size_t>(random() % n); };
    const std::string tokens[] = {
        "nan", ",", "\t", "\n", "1e99", "-", "\"", std::string(1, '\0'), "\xFF\xFF\xFF\xFF", " "};
    for (std::size_t edits = 1 + below(3); edits > 0 && !text.empty(); --edits) {
        const std::size_t at = below(text.size());
        const std::size_t kind = below(6);
        if (kind == 0) text[at] = static_cast<char>(random() & 0xFF);
        if (kind == 1) text.erase(at, 1 + below(8));
        if (kind == 2) text.insert(at, tokens[below(std::size(tokens))]);
        if (kind == 3) text.insert(at, text.substr(below(text.size()), below(40)));
        if (kind == 4 && below(3) == 0) text.resize(at);
        if (kind == 5) text[at] = static_cast<char>('0' + below(10));
    }
    return text;
}

struct Outcomes {
    int read = 0, refused = 0;
};

/// Reads `count` mutations of `good` by `reader`: each must end in a valid trace or a located error.
template <class Reader>
Outcomes mutate_and_read(const std::string& good, int count, unsigned seed, Reader reader) {
    std::mt19937 random(seed);
    Outcomes outcomes;
    for (int i = 0; i < count; ++i) {
        const std::string text = mutated(good, random);
        try {
            const Trace trace = reader(text);
            expect_valid(trace);
            ++outcomes.read;
        } catch (const TraceError& error) {
            expect_located(error.what());
            ++outcomes.refused;
        }
        if (::testing::Test::HasFailure()) {
            ADD_FAILURE() << "mutation " << i << " of seed " << seed;
            break;
        }
    }
    return outcomes;
}

}  // namespace tracking
