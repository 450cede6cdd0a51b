#pragma once
#include <array>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string_view>
#include <vector>

#include "files/file_descriptor.h"

namespace app {

// What commands write. The first of a list leads: a folder that has it is a finished run; it is removed first,
// so that a folder whose products are being exchanged does not look finished.

/// `play`; in real time also the measurements, from latency.json on.
inline constexpr std::array<std::string_view, 16> kPlayProducts = {
    "summary.json", "frames",       "audio.wav",    "events.csv",     "contacts.csv", "hits.mid",
    "report.html",  "latency.json", "latency.html", "departures.csv", "samples.csv",  "frames.csv",
    "notes.csv",    "blocks.csv",   "leads.csv",    "errors.csv"};
/// `simulate`: times.csv or, with workers, timing.csv and workers.svg.
inline constexpr std::array<std::string_view, 7> kSimulateProducts = {
    "summary.json", "frames", "states.csv", "energy.csv", "times.csv", "timing.csv", "workers.svg"};
inline constexpr std::array<std::string_view, 5> kCompareProducts = {
    "compare.json", "compare.csv", "report.html", "experiment.toml", "figures"};
inline constexpr std::array<std::string_view, 3> kModesProducts = {"modes.json", "modes.png", "frames"};

/// The folder that a run writes its products into, all of them or none. They are staged in its hidden
/// subfolder `.unfinished`; finish() moves them into place by rename, the leading product last, so that
/// a folder with it is a finished run. A folder serves one run at a time (advisory lock). One thread at a
/// time.
class OutputFolder {
public:
    /// Makes the folder (parents too) and an empty staging folder, removing one that an interrupted run left.
    /// Throws BadInput when that cannot be: a file is in the way, no permission, another run is writing
    /// there, or `frames` or `figures` hold files that no run wrote and finish() would delete.
    explicit OutputFolder(const std::filesystem::path& folder,
                          std::span<const std::string_view> products = kPlayProducts);
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
    class InterruptionNotice;

    std::filesystem::path folder_, staging_;
    std::vector<std::string_view> products_;
    bool made_folder_ = false, finished_ = false;
    FileDescriptor lock_;
    std::unique_ptr<InterruptionNotice> notice_;
};

/// Writes a whole file, replacing an older one. Every write and the close are checked: throws
/// std::runtime_error "error: cannot write FILE: REASON; ...".
void write_file(const std::filesystem::path& file, std::span<const std::uint8_t> bytes);
void write_file(const std::filesystem::path& file, std::string_view text);

/// FILE.partial, for what becomes FILE by renaming it. Throws BadInput when FILE cannot be made there (no such
/// folder, a folder of that name).
[[nodiscard]] std::filesystem::path partial_name(const std::filesystem::path& file);

/// Writes FILE.partial, then renames it: FILE is never seen half-written, and an older one stays until the
/// new one is complete. Throws as partial_name(), std::runtime_error when writing fails.
void write_finished_file(const std::filesystem::path& file, std::span<const std::uint8_t> bytes);
void write_finished_file(const std::filesystem::path& file, std::string_view text);

}  // namespace app
