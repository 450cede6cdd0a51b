#pragma once
#include <sys/types.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include "sim/simulation.h"

/// This test program as other processes, and what /proc tells of them.
namespace sim_test {

inline std::vector<std::string> command_line(const std::filesystem::path& process = "/proc/self") {
    std::ifstream file(process / "cmdline", std::ios::binary);
    std::vector<std::string> words;
    for (std::string word; std::getline(file, word, '\0');) words.push_back(word);
    return words;
}

/// The word after `name`; empty: none.
inline std::string option(const std::vector<std::string>& words, const std::string& name) {
    for (std::size_t i = 0; i + 1 < words.size(); ++i) {
        if (words[i] == name) return words[i + 1];
    }
    return {};
}

/// This program, to run one (disabled) test in each process.
inline sim::WorkerLaunch run_test(const std::string& test, int count) {
    return {std::filesystem::read_symlink("/proc/self/exe"),
            {"--gtest_filter=" + test, "--gtest_also_run_disabled_tests"},
            count};
}

inline std::vector<pid_t> children_of(pid_t parent) {
    std::vector<pid_t> children;
    for (const auto& entry : std::filesystem::directory_iterator("/proc")) {
        std::ifstream file(entry.path() / "stat");
        std::string stat;
        if (!std::isdigit(entry.path().filename().string()[0]) || !std::getline(file, stat)) continue;
        std::istringstream fields(stat.substr(stat.rfind(')') + 1));
        std::string state;
        pid_t of = 0;
        fields >> state >> of;
        if (of == parent && state != "Z") children.push_back(std::stoi(entry.path().filename()));
    }
    std::sort(children.begin(), children.end());
    return children;
}

/// Waits for what another process is to bring about; the limit is only there so that a broken test ends.
template <typename Condition>
bool comes_true(Condition condition) {
    for (int i = 0; i < 1000; ++i) {
        if (condition()) return true;
        std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    return false;
}

}  // namespace sim_test
