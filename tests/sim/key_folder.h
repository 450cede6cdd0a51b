#pragma once
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <string>
#include <vector>

#include "sim/distributed_world.h"

namespace sim_test {

/// Keys in a folder of their own, which goes away.
class KeyFolder {
public:
    explicit KeyFolder(const std::vector<std::string>& workers) {
        std::string pattern = (std::filesystem::temp_directory_path() / "musicworld-keys-XXXXXX").string();
        if (!mkdtemp(pattern.data())) throw std::runtime_error("no folder for keys");
        parent_ = pattern;
        sim::make_keys(path(), workers);
    }
    ~KeyFolder() {
        std::error_code ignored;
        std::filesystem::remove_all(parent_, ignored);
    }
    KeyFolder(const KeyFolder&) = delete;
    KeyFolder& operator=(const KeyFolder&) = delete;

    [[nodiscard]] std::filesystem::path path() const { return parent_ / "keys"; }

private:
    std::filesystem::path parent_;
};

}  // namespace sim_test
