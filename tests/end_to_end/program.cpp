#include "program.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sndfile.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <cstdlib>
#include <fstream>
#include <sstream>
#include <stdexcept>
#include <utility>

extern char** environ;

namespace end_to_end {
namespace fs = std::filesystem;
namespace {

std::vector<std::string> program_with(const std::vector<std::string>& arguments) {
    std::vector<std::string> words = {MUSICWORLD_PROGRAM};
    words.insert(words.end(), arguments.begin(), arguments.end());
    return words;
}

int spawn(std::vector<std::string> words, const std::vector<std::string>& environment, const fs::path& out,
          const fs::path& err) {
    std::vector<char*> argv, envp;
    for (std::string& word : words) argv.push_back(word.data());
    argv.push_back(nullptr);
    std::vector<std::string> added = environment;
    for (std::string& entry : added) envp.push_back(entry.data());
    const auto set_anew = [&](const std::string& entry) {
        const std::string name = entry.substr(0, entry.find('=') + 1);
        return std::any_of(added.begin(), added.end(),
                           [&](const std::string& a) { return a.starts_with(name); });
    };
    for (char** e = environ; *e; ++e)
        if (!set_anew(*e)) envp.push_back(*e);
    envp.push_back(nullptr);
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_addopen(&actions, 0, "/dev/null", O_RDONLY, 0);
    posix_spawn_file_actions_addopen(&actions, 1, out.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
    posix_spawn_file_actions_addopen(&actions, 2, err.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
    posix_spawnattr_t attributes;
    posix_spawnattr_init(&attributes);
    sigset_t heeded;  // shells have these ignored by what they start in the background
    sigemptyset(&heeded);
    sigaddset(&heeded, SIGINT), sigaddset(&heeded, SIGHUP);
    posix_spawnattr_setsigdefault(&attributes, &heeded);
    posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSIGDEF);
    pid_t pid = -1;
    const int error = posix_spawnp(&pid, argv[0], &actions, &attributes, argv.data(), envp.data());
    posix_spawnattr_destroy(&attributes);
    posix_spawn_file_actions_destroy(&actions);
    if (error != 0) throw std::runtime_error("cannot start " + words[0]);
    return pid;
}

Ended collect(int pid, const fs::path& out, const fs::path& err) {
    int status = 0;
    if (waitpid(pid, &status, 0) != pid) throw std::runtime_error("waitpid failed");
    return {WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status), read(out), read(err)};
}

}  // namespace

Ended run(const std::vector<std::string>& arguments, const std::vector<std::string>& environment) {
    return run_command(program_with(arguments), environment);
}

Ended run_command(const std::vector<std::string>& words, const std::vector<std::string>& environment) {
    const Folder folder;
    return collect(spawn(words, environment, folder / "out", folder / "err"), folder / "out", folder / "err");
}

void expect_refused(const Ended& ended, const std::string& mentions, int status) {
    EXPECT_EQ(ended.status, status) << ended.err;
    EXPECT_EQ(std::count(ended.err.begin(), ended.err.end(), '\n'), 1) << ended.err;
    // Bad input: what was found and what was expected; a failure of the system: what could not be done.
    const bool failure = ended.err.find("error: cannot ") != std::string::npos;
    const std::vector<std::string> words =
        failure ? std::vector<std::string>{": "} : std::vector<std::string>{"found", "expected"};
    for (const std::string& word : words)
        EXPECT_NE(ended.err.find(word), std::string::npos) << word << " in: " << ended.err;
    EXPECT_NE(ended.err.find(mentions), std::string::npos) << mentions << " in: " << ended.err;
    // Csound writes a row of dashes to standard output when it runs under the sanitizer.
    EXPECT_EQ(ended.out.find_first_not_of('-'), std::string::npos) << ended.out;
}

Started::Started(const std::vector<std::string>& arguments, const fs::path& folder)
    : out_(folder / "out"), err_(folder / "err") {
    pid_ = spawn(program_with(arguments), {}, out_, err_);
}

Ended Started::wait() {
    return collect(pid_, out_, err_);
}

Folder::Folder() {
    std::string name = (fs::temp_directory_path() / "musicworld-test-XXXXXX").string();
    if (!mkdtemp(name.data())) throw std::runtime_error("mkdtemp failed");
    path_ = name;
}

Folder::~Folder() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
}

std::string read(const fs::path& file) {
    std::ifstream stream(file, std::ios::binary);
    std::ostringstream text;
    text << stream.rdbuf();
    return text.str();
}

void write(const fs::path& file, const std::string& text) {
    std::ofstream(file, std::ios::binary) << text;
}

std::map<std::string, std::string> read_tree(const fs::path& folder, const std::vector<std::string>& except) {
    std::map<std::string, std::string> files;
    for (const fs::directory_entry& entry : fs::recursive_directory_iterator(folder))
        if (entry.is_regular_file()) files[fs::relative(entry.path(), folder).string()] = read(entry.path());
    for (const std::string& name : except) files.erase(name);
    return files;
}

std::vector<std::map<std::string, std::string>> read_csv(const fs::path& file) {
    std::istringstream lines(read(file));
    const auto fields = [](const std::string& line) {
        std::vector<std::string> result;
        std::string field;
        bool quoted = false;
        for (const char c : line + ",") {
            if (c == '"')
                quoted = !quoted;
            else if (c == ',' && !quoted)
                result.push_back(std::exchange(field, ""));
            else
                field += c;
        }
        return result;
    };
    std::string line;
    std::getline(lines, line);
    const std::vector<std::string> names = fields(line);
    std::vector<std::map<std::string, std::string>> rows;
    while (std::getline(lines, line)) {
        const std::vector<std::string> values = fields(line);
        std::map<std::string, std::string> row;
        for (std::size_t i = 0; i < names.size() && i < values.size(); ++i) row[names[i]] = values[i];
        rows.push_back(row);
    }
    return rows;
}

std::vector<int> read_wav(const fs::path& file, int& channels) {
    SF_INFO info{};
    SNDFILE* sound = sf_open(file.c_str(), SFM_READ, &info);
    if (!sound) throw std::runtime_error("cannot read " + file.string());
    channels = info.channels;
    std::vector<int> samples(static_cast<std::size_t>(info.frames) * static_cast<std::size_t>(info.channels));
    sf_readf_int(sound, samples.data(), info.frames);
    sf_close(sound);
    return samples;
}

namespace {

/// Calls row(line, time) for every row of samples and other(line) for every other line.
template <class Row, class Other>
void each_line(const std::string& text, const Row& row, const Other& other) {
    std::istringstream lines(text);
    for (std::string line; std::getline(lines, line);) {
        const bool data =
            !line.empty() && (std::isdigit(static_cast<unsigned char>(line[0])) || line[0] == '-');
        if (data)
            row(line, std::strtod(line.c_str(), nullptr));
        else
            other(line);
    }
}

}  // namespace

std::string cut_trace(const std::string& text, double until, double from) {
    std::string result;
    each_line(
        text,
        [&](const std::string& line, double t) {
            if (t < until && t >= from) result += line + "\n";
        },
        [&](const std::string& line) { result += line + "\n"; });
    return result;
}

std::pair<double, double> time_span(const std::string& text) {
    std::pair<double, double> span(1e300, -1e300);
    each_line(
        text,
        [&](const std::string&, double t) {
            span = {std::min(span.first, t), std::max(span.second, t)};
        },
        [](const std::string&) {});
    return span;
}

fs::path bundled(const std::string& name) {
    return fs::path(MUSICWORLD_SOURCE_DIR) / "assets" / name;
}

bool has_python() {
    return std::system("python3 -c '' 2>/dev/null") == 0;
}

std::string python_example() {
    return "exec:python3 '" + bundled("predictors/difference.py").string() + "'";
}

}  // namespace end_to_end
