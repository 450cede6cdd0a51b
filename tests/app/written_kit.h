#pragma once
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <string>

#include "kit/kit.h"

namespace app {

/// A drum with a wide flat head at height 0.
inline constexpr const char* kFlatDrum = R"(
name = "Flat"
[[instrument]]
name = "table"
kind = "drum"
size = [2, 0.2, 2]
position = [0, -0.1, 0]
midi_note = 38
)";

/// A kit's text in a file of its own for as long as the test needs it.
class WrittenKit {
public:
    explicit WrittenKit(const std::string& text)
        : file_(std::filesystem::path(::testing::TempDir()) /
                ("musicworld_kit_" + std::to_string(::getpid()) + ".toml")) {
        std::ofstream(file_, std::ios::binary) << text;
    }
    ~WrittenKit() { std::filesystem::remove(file_); }
    WrittenKit(const WrittenKit&) = delete;
    WrittenKit& operator=(const WrittenKit&) = delete;

    [[nodiscard]] const std::filesystem::path& file() const { return file_; }
    [[nodiscard]] Kit read() const { return read_kit(file_); }

private:
    std::filesystem::path file_;
};

}  // namespace app
