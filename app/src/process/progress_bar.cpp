#include "process/progress_bar.h"

#include <fmt/format.h>
#include <unistd.h>

#include <cstdio>

namespace app {
namespace {
constexpr int kWidth = 40;
}

ProgressBar::ProgressBar(bool enabled) : enabled_(enabled && isatty(STDERR_FILENO) != 0) {}

void ProgressBar::show(double share) {
    const int cells = static_cast<int>(share * kWidth);
    if (!enabled_ || cells == drawn_) return;
    drawn_ = cells;
    fmt::print(stderr, "\r[{:#<{}}{:.<{}}] {:3.0f} %", "", cells, "", kWidth - cells, 100 * share);
    std::fflush(stderr);
}

void ProgressBar::clear() {
    if (!enabled_) return;
    fmt::print(stderr, "\r{:{}}\r", "", kWidth + 10);
    std::fflush(stderr);
}

}  // namespace app
