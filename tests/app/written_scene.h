#pragma once
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <string>

#include "files/bad_input.h"
#include "scene/scene.h"

namespace app {

/// A scene's text in a file of its own for as long as the test needs it.
class WrittenScene {
public:
    explicit WrittenScene(const std::string& text)
        : file_(std::filesystem::path(::testing::TempDir()) /
                ("musicworld_scene_" + std::to_string(::getpid()) + ".toml")) {
        std::ofstream(file_, std::ios::binary) << text;
    }
    ~WrittenScene() { std::filesystem::remove(file_); }
    WrittenScene(const WrittenScene&) = delete;
    WrittenScene& operator=(const WrittenScene&) = delete;

    [[nodiscard]] const std::filesystem::path& file() const { return file_; }
    [[nodiscard]] Scene read(std::optional<double> dt_s = {}) const { return read_scene(file_, dt_s); }
    /// What the reader says against it; nothing when it is accepted.
    [[nodiscard]] std::string refusal() const {
        try {
            (void)read();
        } catch (const BadInput& wrong) {
            return wrong.what();
        }
        return {};
    }

private:
    std::filesystem::path file_;
};

}  // namespace app
