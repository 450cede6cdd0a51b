// Regions of recorded sounds.
#include "fuzz_target.h"
#include "region_text.h"

void fuzz_sf2(std::string_view bytes) {
    try {
        (void)audio::parse_sf2(bytes, "fuzz");
    } catch (const audio::SampleError& fault) {
        require_located(fault, "");
    }
}
