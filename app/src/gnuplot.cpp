#include "gnuplot.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <fstream>
#include <iterator>
#include <stdexcept>

#include "output_folder.h"

namespace app {
namespace fs = std::filesystem;
namespace {

constexpr int kCommandNotFound = 127;  // what a child that could not be started ends with

class FileActions {
public:
    FileActions() { posix_spawn_file_actions_init(&actions_); }
    ~FileActions() { posix_spawn_file_actions_destroy(&actions_); }
    FileActions(const FileActions&) = delete;
    FileActions& operator=(const FileActions&) = delete;
    void open(int descriptor, const fs::path& file, int flags) {
        posix_spawn_file_actions_addopen(&actions_, descriptor, file.c_str(), flags, 0666);
    }
    [[nodiscard]] const posix_spawn_file_actions_t* get() const { return &actions_; }

private:
    posix_spawn_file_actions_t actions_;
};

/// This program's environment with the locale C, so that numbers have points.
std::vector<char*> plain_environment(std::string& locale) {
    std::vector<char*> variables;
    for (char** variable = environ; *variable != nullptr; ++variable)
        if (std::strncmp(*variable, "LC_ALL=", 7) != 0) variables.push_back(*variable);
    variables.push_back(locale.data());
    variables.push_back(nullptr);
    return variables;
}

std::string read_text(const fs::path& file) {
    std::ifstream in(file, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

[[noreturn]] void fail_missing() {
    throw std::runtime_error(
        "error: found no gnuplot, expected it for the report's plots; install the package gnuplot-nox");
}

/// Waits for gnuplot; returns its exit status, or 128 + the signal that ended it.
int wait_for(pid_t child) {
    int status = 0;
    while (waitpid(child, &status, 0) < 0)
        if (errno != EINTR)
            throw std::runtime_error(fmt::format("error: lost gnuplot: {}", std::strerror(errno)));
    return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
}

void run_gnuplot(const fs::path& script, const fs::path& messages) {
    FileActions files;
    files.open(STDIN_FILENO, "/dev/null", O_RDONLY);
    files.open(STDOUT_FILENO, messages, O_WRONLY | O_CREAT | O_TRUNC);
    files.open(STDERR_FILENO, messages, O_WRONLY | O_CREAT | O_APPEND);
    std::string program = "gnuplot", defaults = "--default-settings", file = script.string(),
                locale = "LC_ALL=C";
    char* arguments[] = {program.data(), defaults.data(), file.data(), nullptr};
    std::vector<char*> environment = plain_environment(locale);
    pid_t child = 0;
    const int error = posix_spawnp(&child, "gnuplot", files.get(), nullptr, arguments, environment.data());
    if (error == ENOENT) fail_missing();
    if (error != 0)
        throw std::runtime_error(fmt::format("error: cannot start gnuplot: {}", std::strerror(error)));
    const int status = wait_for(child);
    if (status == kCommandNotFound) fail_missing();
    if (status != 0)
        throw std::runtime_error(fmt::format("error: gnuplot ended with status {}: {}", status,
                                             gnuplot_string(read_text(messages).substr(0, 400))));
}

}  // namespace

std::vector<std::string> draw_svg(const std::vector<PlotScript>& scripts, const fs::path& scratch) {
    const auto svg_file = [&](std::size_t index) { return scratch / fmt::format("plot{:03}.svg", index); };
    std::string commands;
    for (std::size_t i = 0; i < scripts.size(); ++i)
        commands += fmt::format(
            "reset\nset terminal svg size {},{} noenhanced font 'sans-serif,12'\nset output {}\n{}\n"
            "set output\n",
            scripts[i].width, scripts[i].height, gnuplot_string(svg_file(i).string()), scripts[i].commands);
    const fs::path script = scratch / "plots.gp";
    write_file(script, commands);
    run_gnuplot(script, scratch / "plots.log");
    std::vector<std::string> pictures;
    for (std::size_t i = 0; i < scripts.size(); ++i) {
        pictures.push_back(read_text(svg_file(i)));
        if (pictures.back().find("</svg>") == std::string::npos)
            throw std::runtime_error(
                fmt::format("{}: error: found an unfinished plot, expected a whole one; is the "
                            "disk full?",
                            svg_file(i).string()));
    }
    return pictures;
}

std::string gnuplot_string(std::string_view text) {
    std::string quoted = "'";
    for (const char c : text) {
        if (c == '\'') quoted += '\'';
        quoted += static_cast<unsigned char>(c) < 0x20 || c == 0x7f ? ' ' : c;
    }
    return quoted + "'";
}

}  // namespace app
