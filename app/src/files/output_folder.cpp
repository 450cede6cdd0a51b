#include "files/output_folder.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <stdexcept>
#include <string>
#include <system_error>
#include <vector>

#include "files/bad_input.h"

namespace app {
namespace fs = std::filesystem;
namespace {

/// The first leads: it goes first, so that a folder whose products are being exchanged does not look
/// finished.
constexpr std::array<std::string_view, 16> kPlayProducts = {
    "summary.json", "frames",       "audio.wav",    "events.csv",     "contacts.csv", "hits.mid",
    "report.html",  "latency.json", "latency.html", "departures.csv", "samples.csv",  "frames.csv",
    "notes.csv",    "blocks.csv",   "leads.csv",    "errors.csv"};
constexpr std::array<std::string_view, 3> kModesProducts = {"modes.json", "modes.png", "frames"};
constexpr std::array<std::string_view, 7> kSimulateProducts = {
    "summary.json", "frames", "states.csv", "energy.csv", "times.csv", "timing.csv", "workers.svg"};
constexpr std::array<std::string_view, 3> kCompareProducts = {"compare.json", "compare.csv", "report.html"};

[[noreturn]] void refuse(const fs::path& path, const std::string& found) {
    throw BadInput(fmt::format("{}: error: found {}, expected a folder to write into; choose another --out",
                               path.string(), found));
}

void check_moved(const std::error_code& error, const fs::path& path) {
    if (error)
        throw std::runtime_error(
            fmt::format("{}: error: found {}, expected to put the run's results there; "
                        "the run is not complete",
                        path.string(), error.message()));
}

bool is_frame_name(const std::string& name) {
    const std::size_t digits = name.find_first_not_of("0123456789");
    return digits != std::string::npos && digits >= 6 && name.substr(digits) == ".png";
}

/// finish() replaces `frames` as a whole, so it must hold nothing but pictures of a run.
void check_frames(const fs::path& frames) {
    std::error_code error;
    if (!fs::is_directory(fs::symlink_status(frames, error))) return;
    for (fs::directory_iterator entry(frames, error), end; !error && entry != end; entry.increment(error)) {
        const std::string name = entry->path().filename().string();
        if (!is_frame_name(name))
            throw BadInput(
                fmt::format("{}: error: found {}, expected only pictures of an earlier run (they are "
                            "replaced); choose another --out or move the file away",
                            frames.string(), name));
    }
    if (error) refuse(frames, error.message());
}

void write_all(const fs::path& file, const void* data, std::size_t size) {
    const auto fail = [&] {
        throw std::runtime_error("error: " + cannot("write " + file.string()) +
                                 "; free some space or choose another --out");
    };
    FileDescriptor out(::open(file.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666));
    if (!out) fail();
    for (std::size_t done = 0; done < size;) {
        const ssize_t wrote = ::write(out.get(), static_cast<const char*>(data) + done, size - done);
        if (wrote < 0 && errno == EINTR) continue;
        if (wrote < 0) fail();
        done += static_cast<std::size_t>(wrote);
    }
    if (!out.close()) fail();
}

}  // namespace

std::span<const std::string_view> play_products() {
    return kPlayProducts;
}

std::span<const std::string_view> compare_products() {
    return kCompareProducts;
}

std::span<const std::string_view> modes_products() {
    return kModesProducts;
}
std::span<const std::string_view> simulate_products() {
    return kSimulateProducts;
}

OutputFolder::OutputFolder(const fs::path& folder, std::span<const std::string_view> products)
    : folder_(folder), staging_(folder / ".unfinished"), products_(products.begin(), products.end()) {
    std::error_code error;
    made_folder_ = fs::create_directories(folder_, error);
    std::error_code none;  // a path that cannot even be looked at has failed above
    if (fs::exists(folder_, none) && !fs::is_directory(folder_, none)) refuse(folder_, "a file");
    if (error) refuse(folder_, error.message());
    lock();
    if (std::find(products_.begin(), products_.end(), "frames") != products_.end())
        check_frames(folder_ / "frames");
    notice_.emplace(staging_);
    make_staging();
}

void OutputFolder::lock() {
    lock_ = FileDescriptor(::open(folder_.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
    if (!lock_) refuse(folder_, std::strerror(errno));
    // File systems without locks are used without.
    if (::flock(lock_.get(), LOCK_EX | LOCK_NB) == 0 || errno != EWOULDBLOCK) return;
    throw BadInput(
        fmt::format("{}: error: found another run writing into it, expected one run a folder; "
                    "wait for it or choose another --out",
                    folder_.string()));
}

void OutputFolder::make_staging() {
    std::error_code error;
    fs::remove_all(staging_, error);
    if (!error) fs::create_directory(staging_, error);
    if (!error) fs::create_directory(scratch(), error);
    if (error) refuse(folder_, error.message());
}

OutputFolder::~OutputFolder() {
    std::error_code ignored;  // a destructor has nobody to tell
    if (!finished_) {
        fs::remove_all(staging_, ignored);
        if (made_folder_) fs::remove(folder_, ignored);
    }
}

void OutputFolder::finish() {
    std::error_code error;
    fs::remove_all(scratch(), error);
    check_moved(error, scratch());
    for (const std::string_view name : products_) {
        fs::remove_all(folder_ / name, error);
        check_moved(error, folder_ / name);
    }
    std::vector<fs::path> staged;
    for (const fs::directory_entry& entry : fs::directory_iterator(staging_)) staged.push_back(entry.path());
    std::sort(staged.begin(), staged.end());
    std::stable_partition(staged.begin(), staged.end(),
                          [&](const fs::path& path) { return path.filename() != products_.front(); });
    for (const fs::path& product : staged) {
        const fs::path target = folder_ / product.filename();
        fs::rename(product, target, error);
        check_moved(error, target);
    }
    fs::remove(staging_, error);
    check_moved(error, staging_);
    notice_.reset();
    finished_ = true;
}

void write_file(const fs::path& file, std::span<const std::uint8_t> bytes) {
    write_all(file, bytes.data(), bytes.size());
}

void write_file(const fs::path& file, std::string_view text) {
    write_all(file, text.data(), text.size());
}

}  // namespace app
