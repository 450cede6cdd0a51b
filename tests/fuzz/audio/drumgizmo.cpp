// Regions of recorded sounds.
#include "fuzz_target.h"
#include "region_text.h"

void fuzz_drumgizmo(std::string_view bytes) {
    try {
        (void)audio::parse_drumgizmo(bytes, "fuzz");
    } catch (const audio::SampleError& fault) {
        require_located(fault, "");
    }
}
