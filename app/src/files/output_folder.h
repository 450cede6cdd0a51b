#pragma once
#include <array>
#include <filesystem>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "files/file_descriptor.h"
#include "files/output_file.h"

namespace app {

// What commands write. The first of a list leads: a folder that has it is a finished run; it is removed first,
// so that a folder whose products are being exchanged does not look finished.

/// `play`; in real time also the measurements, from latency.json on.
inline constexpr std::array<std::string_view, 17> kPlayProducts = {
    "summary.json", "frames",       "audio.wav",    "events.csv",     "contacts.csv", "hits.mid",
    "report.html",  "latency.json", "latency.html", "departures.csv", "samples.csv",  "frames.csv",
    "notes.csv",    "blocks.csv",   "leads.csv",    "errors.csv",     "stems"};
/// `simulate`: times.csv or, with workers, timing.csv and workers.svg.
inline constexpr std::array<std::string_view, 7> kSimulateProducts = {
    "summary.json", "frames", "states.csv", "energy.csv", "times.csv", "timing.csv", "workers.svg"};
inline constexpr std::array<std::string_view, 5> kCompareProducts = {
    "compare.json", "compare.csv", "report.html", "experiment.toml", "figures"};
inline constexpr std::array<std::string_view, 2> kAuditionProducts = {"audition.wav", "audition.png"};
inline constexpr std::array<std::string_view, 3> kModesProducts = {"modes.json", "modes.png", "frames"};

/// The folder that a run writes its products into. They are staged in its hidden subfolder `.unfinished`: until
/// finish() the products of an earlier run stay. finish() puts them in place one by one, the leading product
/// last, so that a folder with it is a finished run, though adornments may be missing; one that stopped halfway has
/// some of the others and not the leading one. A folder serves one run at a time (advisory lock). One thread at a
/// time.
///
/// It holds a few file descriptors in reserve, so that a run whose descriptors others have used up can still write
/// what it has computed.
class OutputFolder {
public:
    /// Makes the folder (parents too) and an empty staging folder, removing one that an interrupted run left.
    /// Throws BadInput when that cannot be: a file is in the way, no permission, another run is writing
    /// there, a product's name is a folder's, or `frames` or `figures` hold files that no run wrote and finish() would
    /// delete.
    /// `goes_on`: keeps what the interrupted run has staged, to go on with it.
    explicit OutputFolder(const std::filesystem::path& folder,
                          std::span<const std::string_view> products = kPlayProducts, bool goes_on = false);
    /// Without finish() or keep(): removes what was staged, and the folder if this run made it and nothing else is in
    /// it.
    ~OutputFolder();
    OutputFolder(const OutputFolder&) = delete;
    OutputFolder& operator=(const OutputFolder&) = delete;

    /// Where to write the product `name` (a file, or a folder to be made by the caller).
    [[nodiscard]] std::filesystem::path path(std::string_view name) const { return staging_ / name; }
    /// An existing folder for temporary files; never moved into place.
    [[nodiscard]] std::filesystem::path scratch() const { return staging_ / "scratch"; }

    /// Makes what adorns the results and is none of them: plots, a video. `name`: the product that it is; empty
    /// for a file elsewhere. If that, or putting it in place, throws std::runtime_error the results stand, and
    /// failures() says why it is missing.
    void adorn(std::string_view name, const std::function<void()>& work);
    [[nodiscard]] const std::vector<std::string>& failures() const { return failures_; }

    /// From now on what is staged stays without finish(), too: a run can go on with it.
    void keep();
    /// After finish(): a product that something else now stands for. What cannot be removed stays, which is no loss.
    void remove_product(std::string_view name) const;
    /// Of a run that goes on: stages a product again that the interrupted run had begun to put in place.
    void take_back(std::string_view name);

    /// Gives back the descriptors in reserve: what is written from now on may use them.
    void free_reserve() { reserve_.clear(); }
    /// Puts everything staged in place (output_file.h), the leading product last, removes the products of earlier
    /// runs (known names only) that this run has not, and the staging folder. Throws std::runtime_error; the
    /// leading product is then not there, and what is not in place stays in the staging folder.
    void finish();

private:
    class InterruptionNotice;

    /// Moves what `name` leads to away, or removes what is a file; devices and pipes stay.
    void remove_earlier(std::string_view name);

    std::filesystem::path folder_, staging_;
    std::vector<std::string_view> products_;
    bool made_folder_ = false, finishing_ = false, kept_ = false;
    FileDescriptor lock_;
    std::vector<FileDescriptor> reserve_;
    std::vector<std::string> failures_, adornments_;
    std::unique_ptr<InterruptionNotice> notice_;
};

/// For the end of a command, when all is in place and printed: throws std::runtime_error, with all failures, if there
/// is one.
void throw_if_any(const std::vector<std::string>& failures, const std::filesystem::path& out);

}  // namespace app
