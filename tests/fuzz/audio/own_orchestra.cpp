// Orchestras that are put behind the bundled one.
#include "audio/own_orchestra.h"

#include <string>
#include <vector>

#include "audio/samples.h"
#include "fuzz_target.h"

void fuzz_own_orchestra(std::string_view bytes) {
    static const std::vector<std::string> kTaken = {"drum", "sample"};
    try {
        const std::string text = audio::checked_own_orchestra(bytes, "fuzz", kTaken);
        require(text.find_first_of("\"\\#{}`\r\xff") == std::string::npos, "what makes texts or macros");
        // Arguments that were bounded are bounded once more; nothing else changes.
        const std::string again = audio::checked_own_orchestra(text, "fuzz", kTaken);
        std::size_t met = 0;
        for (const char c : again) met += met < text.size() && text[met] == c;
        require(met == text.size() && (again == text || text.find(" limit(") != std::string::npos),
                "a text that reads to another");
    } catch (const audio::SampleError& fault) {
        require_located(fault, "fuzz");
    }
}
