#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "mutation.h"
#include "tracking/trace.h"

namespace tracking {
namespace {

const std::vector<std::string>& seeds() {
    static const std::vector<std::string> texts = {
        "# units: mm\n# up: z\n# rate_hz: 120\n# source: x\n# tip_m: 0,0,-0.35\n# shaft: +y\n"
        "t,stick,px,py,pz,qw,qx,qy,qz\n0,a,1,2,3,1,0,0,0\n0,b,1,2,3,,,,\n0.1,a,4,5,6,0.6,0.8,0,0\n0.2,b,1,2,"
        "3,0,0,0,1\n",
        "t,stick,px,py,pz\r\n0,a,1,2,3\r\n1e-3,a,-1.5e-2,2,3\r\n",
        "# up: y\nt,stick,px,py,pz,rx,ry,rz\n0,a,1,2,3,0,0,0\n1,a,1,2,3,0.1,-0.2,3\n2,a,1,2,3,3,3,3\n",
        "\xEF\xBB\xBFt,stick,px,py,pz,ex,ey,ez\n0,\xC3\xBC,1,2,3,10,20,30\n1,\xC3\xBC,1,2,3,,,\n",
    };
    return texts;
}

const std::vector<std::string>& tokens() {
    static const std::vector<std::string> all = {"nan",
                                                 "inf",
                                                 "-",
                                                 "+",
                                                 "1e999",
                                                 "1e-999",
                                                 "1000",
                                                 "1000.0000001",
                                                 "-0",
                                                 ",",
                                                 ",,,,",
                                                 "\n",
                                                 "\r",
                                                 "\r\n",
                                                 "#",
                                                 "# up: z\n",
                                                 std::string(1, '\0'),
                                                 "\xFF",
                                                 "\xE2\x82",
                                                 " ",
                                                 "\t",
                                                 ":",
                                                 "0x1p3",
                                                 "1.01",
                                                 "99999999999999999999",
                                                 "\"",
                                                 "t,stick,px,py,pz\n"};
    return all;
}

std::string mutated(std::mt19937& random) {
    const auto below = [&](std::size_t n) { return static_cast<std::size_t>(random() % n); };
    std::string text = seeds()[below(seeds().size())];
    for (std::size_t edits = 1 + below(2); edits > 0 && !text.empty(); --edits) {
        const std::size_t at = below(text.size());
        switch (below(6)) {
            case 0:
                text[at] = static_cast<char>(random() & 0xFF);
                break;
            case 1:
                text.erase(at, 1 + below(8));
                break;
            case 2:
                text.insert(at, tokens()[below(tokens().size())]);
                break;
            case 3:
                text.insert(at, text.substr(below(text.size()), below(40)));
                break;
            case 4:
                text.resize(at);
                break;
            default:
                text[at] = static_cast<char>('0' + below(10));
                break;
        }
    }
    return text;
}

TEST(TraceFuzz, TwentyThousandMutationsAreReadAsValidTracesOrRefusedInOneLocatedLine) {
    std::mt19937 random(20240607);
    int read = 0;
    for (int i = 0; i < 20000; ++i) {
        const std::string text = mutated(random);
        try {
            const Trace trace = parse_trace(text, "fuzz.csv");
            ASSERT_NO_FATAL_FAILURE(expect_valid(trace, 1000)) << text;
            const std::string written = format_trace(trace);
            ASSERT_EQ(format_trace(parse_trace(written, "again.csv")), written) << text;
            ++read;
        } catch (const TraceError& error) {
            ASSERT_TRUE(std::string(error.what()).starts_with("fuzz.csv:")) << error.what() << "\n" << text;
            ASSERT_NO_FATAL_FAILURE(expect_located(error.what())) << text;
        }
    }
    // Both outcomes must be exercised for the loop to mean anything.
    EXPECT_GT(read, 300);
    EXPECT_LT(read, 19000);
}

}  // namespace
}  // namespace tracking
