#pragma once
#include <cstdint>
#include <filesystem>
#include <span>
#include <string_view>
#include <system_error>
#include <vector>

#include "files/file_descriptor.h"

namespace app {

// The one place where what a command writes becomes a finished file. Only regular files are replaced; devices and
// pipes are written to, symbolic links followed. What is in place is whole and saved to the disk.

/// Writes a whole file, replacing an older one. Every write and the close are checked: throws std::runtime_error
/// "error: cannot write FILE: REASON; ...", and no part of it is left.
void write_file(const std::filesystem::path& file, std::span<const std::uint8_t> bytes);
void write_file(const std::filesystem::path& file, std::string_view text);

/// Where an output of a name comes to lie.
struct OutputPlace {
    std::filesystem::path path;  ///< behind all symbolic links
    enum class Kind { nothing, file, folder, written_to } kind;
};
/// Throws BadInput for what can be no output: links in a circle, a socket (but an open one, such as standard output
/// may be), a name that is too long, a place that
/// may not be looked at.
[[nodiscard]] OutputPlace output_place(const std::filesystem::path& name);

/// Throws BadInput when an output is a file that the command also reads (by whatever name).
void refuse_replacing(const std::filesystem::path& output, std::span<const std::filesystem::path> inputs);

/// What lies in a folder, by name. Throws std::filesystem::filesystem_error.
[[nodiscard]] std::vector<std::filesystem::path> entries_of(const std::filesystem::path& folder);
/// Has a file's bytes, or a folder's names, on the disk. Throws std::runtime_error.
void save_on_disk(const std::filesystem::path& path);
/// Removes a folder and all that it holds, if it is there.
void remove_tree(const std::filesystem::path& folder, std::error_code& error);
void remove_tree(const std::filesystem::path& folder);

/// Saves a staged file, or a folder with all that it holds, to the disk and moves it to where `name` leads;
/// across file systems by a copy beside it, NAME.partial, where nothing but a regular file may be. A file that is
/// there is replaced at once, a folder must have gone before. A folder that it lies in and that may not be read has
/// its names not saved. To a device, a pipe or an open stream the bytes are written; a named pipe is given ten
/// seconds to be opened by a reader. Throws std::runtime_error; what was staged is then still there, and what was
/// there is as it was, unless it is already replaced and its folder cannot be saved.
void put_in_place(const std::filesystem::path& staged, const std::filesystem::path& name);

/// A file that is made beside its place and put there when it is whole.
class OutputFile {
public:
    /// Throws BadInput when FILE cannot be made: no such folder, a folder of that name, as output_place().
    explicit OutputFile(std::filesystem::path file);
    /// Removes what was staged, unless it was finished, is to be kept or was there before.
    ~OutputFile();
    OutputFile(const OutputFile&) = delete;
    OutputFile& operator=(const OutputFile&) = delete;

    /// Where to write it until finish(): FILE.partial, a long name shortened; of a device, memory.
    [[nodiscard]] const std::filesystem::path& partial() const { return partial_; }
    /// From now on it stays there without finish(), too.
    void keep_partial() { kept_ = true; }
    /// Throws as put_in_place().
    void finish();

private:
    std::filesystem::path file_, partial_;
    FileDescriptor memory_;
    bool kept_ = false;
};

/// Writes and finishes an OutputFile.
void write_finished_file(const std::filesystem::path& file, std::span<const std::uint8_t> bytes);
void write_finished_file(const std::filesystem::path& file, std::string_view text);

}  // namespace app
