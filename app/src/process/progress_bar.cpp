#include "process/progress_bar.h"

#include <fmt/format.h>
#include <unistd.h>

#include "process/standard_streams.h"

namespace app {
namespace {
constexpr int kWidth = 40;
}

ProgressBar::ProgressBar(bool enabled) : enabled_(enabled && isatty(STDERR_FILENO) != 0) {}

void ProgressBar::show(double share) {
    const int cells = static_cast<int>(share * kWidth);
    if (!enabled_ || cells == drawn_) return;
    drawn_ = cells;
    tell_as_is(fmt::format("\r[{:#<{}}{:.<{}}] {:3.0f} %", "", cells, "", kWidth - cells, 100 * share));
}

void ProgressBar::clear() {
    if (!enabled_) return;
    tell_as_is(fmt::format("\r{:{}}\r", "", kWidth + 10));
}

}  // namespace app
