#pragma once
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "files/file_descriptor.h"
#include "files/interruption_notice.h"

namespace app {

/// What `play` writes: summary.json, frames, audio.wav, events.csv, contacts.csv, hits.mid, report.html, and,
/// in real time, the measurements (latency.json, latency.html, departures.csv and tables). The first of a
/// list leads: a folder that has it is a finished run.
[[nodiscard]] std::span<const std::string_view> play_products();
/// What `compare` writes: compare.json, compare.csv, report.html.
[[nodiscard]] std::span<const std::string_view> compare_products();
/// What `simulate` writes: summary.json, frames, states.csv, energy.csv, and times.csv or, with workers,
/// timing.csv and workers.svg.
[[nodiscard]] std::span<const std::string_view> simulate_products();

/// What `modes` writes: modes.json, modes.png, frames.
[[nodiscard]] std::span<const std::string_view> modes_products();

/// The folder that a run writes its products into, all of them or none. They are staged in its hidden
/// subfolder `.unfinished`; finish() moves them into place by rename, the leading product last, so that
/// a folder with it is a finished run. A folder serves one run at a time (advisory lock). One thread at a
/// time.
class OutputFolder {
public:
    /// Makes the folder (parents too) and an empty staging folder, removing one that an interrupted run left.
    /// Throws BadInput when that cannot be: a file is in the way, no permission, another run is writing
    /// there, or `frames` holds files that no run wrote and finish() would delete.
    explicit OutputFolder(const std::filesystem::path& folder,
                          std::span<const std::string_view> products = play_products());
    /// Without finish(): removes what was staged, and the folder if this run made it and nothing else is in
    /// it.
    ~OutputFolder();
    OutputFolder(const OutputFolder&) = delete;
    OutputFolder& operator=(const OutputFolder&) = delete;

    /// Where to write the product `name` (a file, or a folder to be made by the caller).
    [[nodiscard]] std::filesystem::path path(std::string_view name) const { return staging_ / name; }
    /// An existing folder for temporary files; never moved into place.
    [[nodiscard]] std::filesystem::path scratch() const { return staging_ / "scratch"; }

    /// Removes the products of earlier runs (known names only), moves everything staged into place, the
    /// leading product last, and removes the staging folder. Throws std::runtime_error; the leading product
    /// is then not there.
    void finish();

private:
    void lock();
    void make_staging();

    std::filesystem::path folder_, staging_;
    std::vector<std::string_view> products_;
    bool made_folder_ = false, finished_ = false;
    FileDescriptor lock_;
    std::optional<InterruptionNotice> notice_;
};

/// Writes a whole file, replacing an older one. Every write and the close are checked: throws
/// std::runtime_error "error: cannot write FILE: REASON; ...".
void write_file(const std::filesystem::path& file, std::span<const std::uint8_t> bytes);
void write_file(const std::filesystem::path& file, std::string_view text);

}  // namespace app
