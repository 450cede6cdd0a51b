#pragma once
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace app {

/// The sticks of a source by index: a given list, or as they come, at most kMostSticks.
class StickNames {
public:
    static constexpr std::size_t kMostSticks = 16, kLongestName = 64;

    /// Empty: as they come.
    explicit StickNames(std::vector<std::string> names = {})
        : names_(std::move(names)), open_(names_.empty()) {}

    /// None for a stick that was not asked for, one too many, or a name that is not a word.
    [[nodiscard]] std::optional<std::size_t> index_of(std::string_view name);
    [[nodiscard]] const std::vector<std::string>& names() const { return names_; }

private:
    std::vector<std::string> names_;
    bool open_;
};

}  // namespace app
