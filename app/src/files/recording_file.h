#pragma once
#include <tracking/trace.h>

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace app {

/// A native trace that grows: OUT.partial until finish() renames it. What has been flushed is a trace, up to
/// its last complete line: a stick's first row waits for its second one, without which no trace may have it.
class RecordingFile {
public:
    /// Throws BadInput when OUT cannot be made there.
    explicit RecordingFile(const std::filesystem::path& out);
    ~RecordingFile();  ///< removes an empty OUT.partial; any other stays, unless it was finished
    RecordingFile(const RecordingFile&) = delete;
    RecordingFile& operator=(const RecordingFile&) = delete;

    /// Before the first row.
    void begin(const tracking::Trace& keys, bool oriented);
    void add(std::size_t stick, const std::string& name, const tracking::PoseSample& sample);
    /// Writes the rows so far. Throws std::runtime_error, one line.
    void flush();
    /// Writes what is left and gives the file its name. Throws std::runtime_error.
    void finish();

private:
    struct Row {
        std::size_t stick;
        std::string text;
    };
    void write(const std::string& text);

    std::filesystem::path out_, partial_;
    int descriptor_ = -1;
    std::string head_;
    std::vector<Row> rows_;               // not yet written
    std::vector<std::uint64_t> samples_;  // of each stick
    bool oriented_ = true, wrote_ = false, finished_ = false;
};

}  // namespace app
