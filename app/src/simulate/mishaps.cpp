#include "simulate/mishaps.h"

#include <fmt/format.h>

#include <algorithm>

#include "files/bad_input.h"

namespace app {
namespace {

constexpr std::size_t kMostNames = 8;  // of a line on a terminal

/// "a, b (velocity), c and 5 more; first at step 21".
std::string names_of(const std::vector<Mishap>& mishaps) {
    std::vector<std::string> names;
    for (const Mishap& m : mishaps) {
        if (names.size() == kMostNames) break;
        names.push_back(m.what.empty() ? m.name : fmt::format("{} ({})", m.name, m.what));
    }
    std::string text = fmt::format("{}", fmt::join(names, ", "));
    if (mishaps.size() > kMostNames) text += fmt::format(" and {} more", mishaps.size() - kMostNames);
    return text + fmt::format("; first at step {}", mishaps.front().step);
}

}  // namespace

std::vector<std::string> Mishaps::lines() const {
    std::vector<std::string> all;
    const auto tell = [&all](const std::vector<Mishap>& mishaps, const char* one, const char* what) {
        if (mishaps.empty()) return;
        all.push_back(fmt::format("{} {}: {}", counted(mishaps.size(), one), what, names_of(mishaps)));
    };
    tell(quarantined, "body", "taken out (beyond the world's range or not finite)");
    tell(broken, "constraint", "broken (above the breaking force)");
    tell(limited, "body", "held at the limit of deformation");
    tell(spun, "body",
         "spun so fast that centrifugal load, which is left out, would be a stretch of over 1 %");
    return all;
}

}  // namespace app
