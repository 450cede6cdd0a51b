#include "tracking/trace.h"

#include <algorithm>
#include <limits>

#include "tracking/input.h"

namespace tracking {

double Trace::t0_s() const {
    double t = std::numeric_limits<double>::infinity();
    for (const StickTrace& stick : sticks) t = std::min(t, stick.samples.front().t_s);
    return t;
}

double Trace::t_end_s() const {
    double t = -std::numeric_limits<double>::infinity();
    for (const StickTrace& stick : sticks) t = std::max(t, stick.samples.back().t_s);
    return t;
}

Trace read_trace(const std::filesystem::path& file) {
    const std::string name = file.string();
    return parse_trace(read_bytes(name), name);
}

}  // namespace tracking
