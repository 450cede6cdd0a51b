// Orchestras that are put behind the bundled one.
#include "audio/own_orchestra.h"

#include <string>
#include <vector>

#include "audio/samples.h"
#include "fuzz_target.h"

void fuzz(std::string_view bytes) {
    static const std::vector<std::string> kTaken = {"drum", "sample"};
    try {
        const std::string text = audio::checked_own_orchestra(bytes, "fuzz", kTaken);
        require(text.find_first_of("\"\\#{}`\r\xff") == std::string::npos, "what makes texts or macros");
        require(audio::checked_own_orchestra(text, "fuzz", kTaken) == text, "a text that reads to another");
    } catch (const audio::SampleError& fault) {
        require_located(fault, "fuzz");
    }
}
