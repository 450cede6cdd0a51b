#include "sensors/stick_names.h"

#include <algorithm>

namespace app {
namespace {

bool is_word(std::string_view name) {
    return !name.empty() && name.size() <= StickNames::kLongestName &&
           std::all_of(name.begin(), name.end(),
                       [](char c) { return c > ' ' && c < 0x7f && c != ',' && c != '"' && c != '\''; });
}

}  // namespace

std::optional<std::size_t> StickNames::index_of(std::string_view name) {
    const auto found = std::find(names_.begin(), names_.end(), name);
    if (found != names_.end()) return static_cast<std::size_t>(found - names_.begin());
    if (!open_ || names_.size() == kMostSticks || !is_word(name)) return std::nullopt;
    names_.emplace_back(name);
    return names_.size() - 1;
}

}  // namespace app
