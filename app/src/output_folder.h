#pragma once
#include <cstdint>
#include <filesystem>
#include <span>
#include <string_view>

namespace app {

/// The folder that a run writes its products into, all of them or none. They are staged in its hidden
/// subfolder `.unfinished`; finish() moves them into place by rename, summary.json last, so that a folder
/// with a summary.json is a finished run. A folder serves one run at a time (advisory lock). One thread at a
/// time.
class OutputFolder {
public:
    /// Makes the folder (parents too) and an empty staging folder, removing one that an interrupted run left.
    /// Throws BadInput when that cannot be: a file is in the way, no permission, another run is writing
    /// there, or `frames` holds files that no run wrote and finish() would delete.
    explicit OutputFolder(const std::filesystem::path& folder);
    /// Without finish(): removes what was staged, and the folder if this run made it and nothing else is in
    /// it.
    ~OutputFolder();
    OutputFolder(const OutputFolder&) = delete;
    OutputFolder& operator=(const OutputFolder&) = delete;

    [[nodiscard]] const std::filesystem::path& folder() const { return folder_; }
    /// Where to write the product `name` (a file, or a folder to be made by the caller).
    [[nodiscard]] std::filesystem::path path(std::string_view name) const { return staging_ / name; }
    /// An existing folder for temporary files; never moved into place.
    [[nodiscard]] std::filesystem::path scratch() const { return staging_ / "scratch"; }

    /// Removes the products of earlier runs (known names only: frames, audio.wav, events.csv, contacts.csv,
    /// hits.mid, summary.json, report.html), moves everything staged into place and removes the staging
    /// folder. Throws std::runtime_error; summary.json is then not there.
    void finish();

private:
    void lock();
    void make_staging();

    std::filesystem::path folder_, staging_;
    bool made_folder_ = false, finished_ = false;
    int lock_ = -1;
};

/// Writes a whole file, replacing an older one. Every write and the close are checked: throws
/// std::runtime_error "FILE: error: found REASON (disk full, ...), expected to write N bytes; ...".
void write_file(const std::filesystem::path& file, std::span<const std::uint8_t> bytes);
void write_file(const std::filesystem::path& file, std::string_view text);

}  // namespace app
