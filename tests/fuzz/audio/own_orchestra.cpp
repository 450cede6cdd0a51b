// Orchestras that are put behind the bundled one.
#include "audio/own_orchestra.h"

#include <vector>

#include "audio/samples.h"
#include "fuzz_target.h"

void fuzz(std::string_view bytes) {
    static const std::vector<std::string> kTaken = {"drum", "sample"};
    try {
        audio::check_own_orchestra(bytes, "fuzz", kTaken);
    } catch (const audio::SampleError& fault) {
        require_located(fault, "fuzz");
    }
}
