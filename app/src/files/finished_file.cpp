#include "files/finished_file.h"

#include <fmt/format.h>

#include <stdexcept>

#include "files/bad_input.h"
#include "files/output_folder.h"

namespace app {
namespace fs = std::filesystem;

void write_finished_file(const fs::path& file, std::span<const std::uint8_t> bytes) {
    const fs::path folder = file.has_parent_path() ? file.parent_path() : fs::path(".");
    std::error_code error;
    if (!file.has_filename() || fs::is_directory(file, error))
        throw BadInput(
            fmt::format("{}: error: found a folder, expected the name of a file to write", file.string()));
    if (!fs::is_directory(folder, error))
        throw BadInput(
            fmt::format("{}: error: found no such folder, expected one to write {} into; make it first",
                        folder.string(), file.filename().string()));
    fs::path partial = file;
    partial += ".partial";
    try {
        write_file(partial, bytes);
        fs::rename(partial, file);
    } catch (const std::runtime_error&) {  // filesystem_error is one
        fs::remove(partial, error);
        throw;
    }
}

void write_finished_file(const fs::path& file, std::string_view text) {
    write_finished_file(file, std::span(reinterpret_cast<const std::uint8_t*>(text.data()), text.size()));
}

}  // namespace app
