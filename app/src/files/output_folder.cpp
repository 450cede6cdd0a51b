#include "files/output_folder.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <climits>
#include <csignal>
#include <cstring>
#include <stdexcept>
#include <string>
#include <system_error>

#include "files/bad_input.h"

namespace app {
namespace fs = std::filesystem;
namespace {

// Of InterruptionNotice, whose handler can neither be given anything nor allocate.
std::array<char, PATH_MAX + 200> notice;
volatile std::sig_atomic_t notice_size = 0;

void print_notice_and_end(int signal) {
    (void)!write(STDERR_FILENO, notice.data(), static_cast<std::size_t>(notice_size));
    (void)raise(signal);  // SA_RESETHAND: now it ends the program
}

bool is_handled_by(int signal, void (*handler)(int)) {
    struct sigaction now {};
    return sigaction(signal, nullptr, &now) == 0 && now.sa_handler == handler;
}

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

bool is_figure_name(const std::string& name) {
    return name.find_first_not_of("0123456789") >= 2 && name.find('_') != std::string::npos &&
           (name.ends_with(".svg") || name.ends_with(".png"));
}

/// finish() replaces `frames` and `figures` as a whole, so they must hold nothing but pictures of a run.
void check_pictures(const fs::path& frames, bool (*is_name)(const std::string&)) {
    std::error_code error;
    if (!fs::is_directory(fs::symlink_status(frames, error))) return;
    for (fs::directory_iterator entry(frames, error), end; !error && entry != end; entry.increment(error)) {
        const std::string name = entry->path().filename().string();
        if (!is_name(name))
            throw BadInput(
                fmt::format("{}: error: found {}, expected only pictures of an earlier run (they are "
                            "replaced); choose another --out or move the file away",
                            frames.string(), name));
    }
    if (error) refuse(frames, error.message());
}

std::string_view text_of(std::span<const std::uint8_t> bytes) {
    return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

}  // namespace

/// While this lives, a SIGINT or SIGTERM that ends the program at once first says on standard error what stays
/// in the folder of an unfinished run. Where signals are handled or ignored already it does nothing. One at a
/// time.
class OutputFolder::InterruptionNotice {
public:
    explicit InterruptionNotice(const fs::path& unfinished) {
        const std::string text =
            fmt::format("{}interrupted: what was done so far stays in {}, which the next run there removes\n",
                        isatty(STDERR_FILENO) != 0 ? "\n" : "", unfinished.string());
        const std::size_t size = std::min(text.size(), notice.size());
        std::copy_n(text.begin(), size, notice.begin());
        notice_size = static_cast<std::sig_atomic_t>(size);
        struct sigaction action {};
        action.sa_handler = print_notice_and_end;
        action.sa_flags = static_cast<int>(SA_RESETHAND);
        for (const int signal : {SIGINT, SIGTERM})
            if (is_handled_by(signal, SIG_DFL)) sigaction(signal, &action, nullptr);
    }
    ~InterruptionNotice() {
        notice_size = 0;
        for (const int signal : {SIGINT, SIGTERM})
            if (is_handled_by(signal, print_notice_and_end)) std::signal(signal, SIG_DFL);
    }
    InterruptionNotice(const InterruptionNotice&) = delete;
    InterruptionNotice& operator=(const InterruptionNotice&) = delete;
};

OutputFolder::OutputFolder(const fs::path& folder, std::span<const std::string_view> products)
    : folder_(folder), staging_(folder / ".unfinished"), products_(products.begin(), products.end()) {
    std::error_code error;
    made_folder_ = fs::create_directories(folder_, error);
    std::error_code none;  // a path that cannot even be looked at has failed above
    if (fs::exists(folder_, none) && !fs::is_directory(folder_, none)) refuse(folder_, "a file");
    if (error) refuse(folder_, error.message());
    lock_ = FileDescriptor(::open(folder_.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
    if (!lock_) refuse(folder_, std::strerror(errno));
    // File systems without locks are used without.
    if (::flock(lock_.get(), LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK)
        throw BadInput(
            fmt::format("{}: error: found another run writing into it, expected one run a folder; "
                        "wait for it or choose another --out",
                        folder_.string()));
    for (const auto& [pictures, is_name] :
         {std::pair("frames", &is_frame_name), {"figures", &is_figure_name}})
        if (std::ranges::count(products_, pictures) > 0) check_pictures(folder_ / pictures, is_name);
    notice_ = std::make_unique<InterruptionNotice>(staging_);
    fs::remove_all(staging_, error);
    if (!error) fs::create_directory(staging_, error);
    if (!error) fs::create_directory(scratch(), error);
    if (error) refuse(folder_, error.message());
}

OutputFolder::~OutputFolder() {
    std::error_code ignored;  // a destructor cannot report it
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

void write_file(const fs::path& file, std::string_view text) {
    FileDescriptor out(::open(file.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666));
    if (!out || !out.write(text) || !out.close())
        throw std::runtime_error("error: " + cannot("write " + file.string()) +
                                 "; free some space or choose another --out");
}

void write_file(const fs::path& file, std::span<const std::uint8_t> bytes) {
    write_file(file, text_of(bytes));
}

fs::path partial_name(const fs::path& file) {
    const fs::path folder = file.has_parent_path() ? file.parent_path() : fs::path(".");
    std::error_code error;
    if (!file.has_filename() || fs::is_directory(file, error))
        throw BadInput(
            fmt::format("{}: error: found a folder, expected the name of a file to write", file.string()));
    if (!fs::is_directory(folder, error))
        throw BadInput(
            fmt::format("{}: error: found no such folder, expected one to write {} into; make it first",
                        folder.string(), file.filename().string()));
    return file.string() + ".partial";
}

void write_finished_file(const fs::path& file, std::string_view text) {
    const fs::path partial = partial_name(file);
    try {
        write_file(partial, text);
        fs::rename(partial, file);
    } catch (const std::runtime_error&) {  // filesystem_error is one
        std::error_code ignored;
        fs::remove(partial, ignored);
        throw;
    }
}

void write_finished_file(const fs::path& file, std::span<const std::uint8_t> bytes) {
    write_finished_file(file, text_of(bytes));
}

}  // namespace app
