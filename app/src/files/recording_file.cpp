#include "files/recording_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <tracking/trace_rows.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <stdexcept>
#include <system_error>

#include "files/bad_input.h"

namespace app {
namespace fs = std::filesystem;

RecordingFile::RecordingFile(const fs::path& out) : out_(out), partial_(out) {
    partial_ += ".partial";
    const fs::path folder = out.has_parent_path() ? out.parent_path() : fs::path(".");
    std::error_code ignored;
    if (!out.has_filename() || fs::is_directory(out, ignored))
        throw BadInput(
            fmt::format("{}: error: found a folder, expected the name of a file to write", out.string()));
    if (!fs::is_directory(folder, ignored))
        throw BadInput(
            fmt::format("{}: error: found no such folder, expected one to write {} into; make it first",
                        folder.string(), out.filename().string()));
    descriptor_ = open(partial_.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
    if (descriptor_ < 0)
        throw BadInput(
            fmt::format("{}: error: found no way to write it ({}), expected a file that may be written",
                        partial_.string(), std::strerror(errno)));
}

RecordingFile::~RecordingFile() {
    if (descriptor_ >= 0) close(descriptor_);
    std::error_code ignored;
    if (!wrote_ && !finished_) fs::remove(partial_, ignored);
}

void RecordingFile::begin(const tracking::Trace& keys, bool oriented) {
    oriented_ = oriented;
    head_ = tracking::format_trace_head(keys, oriented);
}

void RecordingFile::add(std::size_t stick, const std::string& name, const tracking::PoseSample& sample) {
    if (stick >= samples_.size()) samples_.resize(stick + 1);
    ++samples_[stick];
    rows_.push_back({stick, {}});
    tracking::append_trace_row(rows_.back().text, name, sample, oriented_);
}

void RecordingFile::flush() {
    std::string text;
    std::vector<Row> alone;
    for (Row& row : rows_) {
        if (samples_[row.stick] < 2)
            alone.push_back(std::move(row));
        else
            text += row.text;
    }
    rows_ = std::move(alone);
    if (text.empty()) return;
    if (!wrote_) text.insert(0, head_);
    wrote_ = true;
    write(text);
}

void RecordingFile::write(const std::string& text) {
    std::size_t done = 0;
    while (done < text.size()) {
        const ssize_t size = ::write(descriptor_, text.data() + done, text.size() - done);
        if (size < 0 && errno == EINTR) continue;
        if (size <= 0)
            throw std::runtime_error(fmt::format(
                "{}: error: found no way to write on ({}), expected room; what was recorded until then "
                "is kept there",
                partial_.string(), std::strerror(size < 0 ? errno : ENOSPC)));
        done += static_cast<std::size_t>(size);
    }
}

void RecordingFile::finish() {
    flush();
    if (fsync(descriptor_) != 0 && errno != EINVAL && errno != EROFS)
        throw std::runtime_error(
            fmt::format("{}: error: found that saving it failed ({}), expected room on the disk",
                        partial_.string(), std::strerror(errno)));
    fs::rename(partial_, out_);
    finished_ = true;
}

}  // namespace app
