// What libFuzzer calls: the decoder that MUSICWORLD_FUZZ_TARGET names.
#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <iterator>

#include "fuzz_target.h"

namespace {

const FuzzTarget& named_target() {
    const char* name = std::getenv("MUSICWORLD_FUZZ_TARGET");
    const auto found = std::ranges::find(kFuzzTargets, std::string_view(name ? name : ""), &FuzzTarget::name);
    require(found != std::end(kFuzzTargets), "no decoder of the name in MUSICWORLD_FUZZ_TARGET");
    return *found;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
    static const FuzzTarget& target = named_target();
    target.fuzz({reinterpret_cast<const char*>(bytes), size});
    return 0;
}
