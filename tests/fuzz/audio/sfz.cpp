// Regions of recorded sounds.
#include "fuzz_target.h"
#include "region_text.h"

void fuzz_sfz(std::string_view bytes) {
    try {
        (void)audio::parse_sfz(bytes, "fuzz");
    } catch (const audio::SampleError& fault) {
        require_located(fault, "");
    }
}
