#pragma once
#include <cstdlib>
#include <filesystem>
#include <optional>

/// The folder of recordings and reference numbers of others, which are no part of the project: what MUSICWORLD_SHARED names, else
/// `shared` beside the checkout; none where there is neither. The tests that need no more than numbers have theirs in tests/reference.
[[nodiscard]] inline std::optional<std::filesystem::path> shared_folder() {
    const char* named = std::getenv("MUSICWORLD_SHARED");
    const std::filesystem::path folder =
        named && *named ? std::filesystem::path(named)
                        : std::filesystem::path(MUSICWORLD_SOURCE_DIR).parent_path() / "shared";
    if (!std::filesystem::is_directory(folder / "traces")) return std::nullopt;
    return folder;
}
