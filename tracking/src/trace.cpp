#include "tracking/trace.h"

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <limits>
#include <memory>
#include <system_error>

#include "text_cursor.h"
#include "tracking/import.h"

namespace tracking {
namespace {

constexpr std::size_t kLargestFile = std::size_t{1} << 30;

struct FileCloser {
    void operator()(std::FILE* file) const { std::fclose(file); }
};

[[noreturn]] void fail(const std::string& name, const std::string& found, const std::string& remedy) {
    Line(name, 1, "").fail(0, found, "a trace file that can be read", remedy);
}

}  // namespace

double Trace::t0_s() const {
    double t = std::numeric_limits<double>::infinity();
    for (const StickTrace& stick : sticks) t = std::min(t, stick.samples.front().t_s);
    return t;
}

double Trace::t_end_s() const {
    double t = -std::numeric_limits<double>::infinity();
    for (const StickTrace& stick : sticks) t = std::max(t, stick.samples.back().t_s);
    return t;
}

std::string read_bytes(const std::string& name) {
    std::error_code ignored;
    if (std::filesystem::is_directory(name, ignored)) fail(name, "a directory", "name the file in it");
    const std::unique_ptr<std::FILE, FileCloser> file(std::fopen(name.c_str(), "rb"));
    if (!file) fail(name, std::generic_category().message(errno), "check the path and its permissions");
    std::string text;
    constexpr std::size_t kChunk = std::size_t{1} << 20;
    for (std::size_t got = kChunk; got == kChunk;) {
        const std::size_t before = text.size();
        text.resize(before + kChunk);
        got = std::fread(text.data() + before, 1, kChunk, file.get());
        text.resize(before + got);
        if (text.size() > kLargestFile) fail(name, "more than 1 GiB", "split the trace");
    }
    if (std::ferror(file.get()) != 0) fail(name, "a read error", "check the disk");
    if (text.empty()) fail(name, "an empty file", "check that the trace is complete");
    return text;
}

Trace read_trace(const std::filesystem::path& file) {
    const std::string name = file.string();
    return parse_trace(read_bytes(name), name);
}

}  // namespace tracking
