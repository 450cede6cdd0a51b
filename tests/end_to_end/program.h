#pragma once
#include <filesystem>
#include <map>
#include <string>
#include <utility>
#include <vector>

/// Runs the built program as a user would, and reads what it wrote.
namespace end_to_end {

struct Ended {
    int status = -1;  ///< exit status; 128 + signal when killed
    std::string out, err;
};

/// Runs `musicworld ARGS...` and waits. `environment`: NAME=VALUE added to this process's own or in its
/// place.
Ended run(const std::vector<std::string>& arguments, const std::vector<std::string>& environment = {});
/// The same of any program.
Ended run_command(const std::vector<std::string>& words, const std::vector<std::string>& environment = {});

/// Expects the one line on standard error that a refusal is: what was found (with `mentions` in it), what was
/// expected; nothing on standard output.
void expect_refused(const Ended& ended, const std::string& mentions = "found", int status = 2);

/// Starts it; for tests that meddle with it while it runs.
class Started {
public:
    Started(const std::vector<std::string>& arguments, const std::filesystem::path& folder);
    [[nodiscard]] int pid() const { return pid_; }
    Ended wait();

private:
    int pid_ = -1;
    std::filesystem::path out_, err_;
};

/// A folder of its own that goes away with the object.
class Folder {
public:
    Folder();
    ~Folder();
    Folder(const Folder&) = delete;
    Folder& operator=(const Folder&) = delete;
    std::filesystem::path operator/(const std::string& name) const { return path_ / name; }

private:
    std::filesystem::path path_;
};

std::string read(const std::filesystem::path& file);
void write(const std::filesystem::path& file, const std::string& text);
/// All files below a folder, by relative path, but those in `except`.
std::map<std::string, std::string> read_tree(const std::filesystem::path& folder,
                                             const std::vector<std::string>& except);

/// Rows of a CSV file by column name (no quotes within quotes).
std::vector<std::map<std::string, std::string>> read_csv(const std::filesystem::path& file);
/// Interleaved samples of a WAV file.
std::vector<int> read_wav(const std::filesystem::path& file, int& channels);

/// The part of a native trace with t < until, and with t >= from.
std::string cut_trace(const std::string& text, double until, double from = -1e9);

/// Earliest and latest sample time of a native trace.
std::pair<double, double> time_span(const std::string& text);

std::filesystem::path bundled(const std::string& name);  ///< a file of assets/

bool has_python();
std::string python_example();  ///< a predictor: the bundled example in Python

}  // namespace end_to_end
