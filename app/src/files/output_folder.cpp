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
#include <tuple>

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

bool is_frame_name(const std::string& name) {
    const std::size_t digits = name.find_first_not_of("0123456789");
    return digits != std::string::npos && digits >= 6 && name.substr(digits) == ".png";
}

bool is_figure_name(const std::string& name) {
    return name.find_first_not_of("0123456789") >= 2 && name.find('_') != std::string::npos &&
           (name.ends_with(".svg") || name.ends_with(".png"));
}

bool is_stem_name(const std::string& name) {
    return name.find_first_not_of("0123456789") >= 2 && name.find('_') != std::string::npos &&
           name.ends_with(".wav");
}

/// Products that are folders have no extension.
void check_places(const fs::path& folder, const std::vector<std::string_view>& products) {
    for (const std::string_view name : products) {
        const bool is_folder = name.find('.') == std::string_view::npos;
        const OutputPlace::Kind kind = output_place(folder / name).kind;
        if (!is_folder && kind == OutputPlace::Kind::folder)
            refuse(folder / name, "a folder where the run's file is to be");
        if (is_folder && kind == OutputPlace::Kind::written_to)
            refuse(folder / name, "a device where the run's folder is to be");
    }
}

/// finish() replaces `frames`, `figures` and `stems` as a whole, so they must hold nothing but a run's.
void check_contents(const fs::path& pictures, const char* what, bool (*is_name)(const std::string&)) {
    std::error_code error;
    if (!fs::is_directory(pictures, error)) return;
    for (const fs::path& picture : entries_of(pictures)) {
        const std::string name = picture.filename().string();
        if (!is_name(name))
            throw BadInput(
                fmt::format("{}: error: found {}, expected only {} of an earlier run (they are "
                            "replaced); choose another --out or move the file away",
                            pictures.string(), name, what));
    }
}

}  // namespace

/// While this lives, a SIGINT, SIGTERM or SIGHUP that ends the program at once first says on standard error what stays
/// in the folder of an unfinished run. Where signals are handled or ignored already it does nothing. One at a
/// time.
class OutputFolder::InterruptionNotice {
public:
    explicit InterruptionNotice(const fs::path& unfinished, bool kept = false) {
        const std::string text =
            fmt::format("{}interrupted: what was done so far stays in {}, which {}\n",
                        isatty(STDERR_FILENO) != 0 ? "\n" : "", unfinished.string(),
                        kept ? "simulate --resume goes on with and any other run there removes"
                             : "the next run there removes");
        const std::size_t size = std::min(text.size(), notice.size());
        std::copy_n(text.begin(), size, notice.begin());
        notice_size = static_cast<std::sig_atomic_t>(size);
        struct sigaction action {};
        action.sa_handler = print_notice_and_end;
        action.sa_flags = static_cast<int>(SA_RESETHAND);
        for (const int signal : {SIGINT, SIGTERM, SIGHUP})
            if (is_handled_by(signal, SIG_DFL)) sigaction(signal, &action, nullptr);
    }
    ~InterruptionNotice() {
        notice_size = 0;
        for (const int signal : {SIGINT, SIGTERM, SIGHUP})
            if (is_handled_by(signal, print_notice_and_end)) std::signal(signal, SIG_DFL);
    }
    InterruptionNotice(const InterruptionNotice&) = delete;
    InterruptionNotice& operator=(const InterruptionNotice&) = delete;
};

OutputFolder::OutputFolder(const fs::path& folder, std::span<const std::string_view> products, bool goes_on)
    : folder_(output_place(folder).path),
      staging_(folder_ / ".unfinished"),
      products_(products.begin(), products.end()) {
    constexpr int kReserve = 16;  // a program to start takes three, a folder to look through a few
    std::error_code error;
    made_folder_ = fs::create_directories(folder_, error);
    std::error_code none;  // a path that cannot even be looked at has failed above
    if (fs::exists(folder_, none) && !fs::is_directory(folder_, none)) refuse(folder_, "a file");
    if (error) refuse(folder_, error.message());
    lock_ = open_file(folder_, O_RDONLY | O_DIRECTORY);
    if (!lock_) refuse(folder_, std::strerror(errno));
    // File systems without locks are used without.
    if (::flock(lock_.get(), LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK)
        throw BadInput(
            fmt::format("{}: error: found another run writing into it, expected one run a folder; "
                        "wait for it or choose another --out",
                        folder_.string()));
    try {
        check_places(folder_, products_);
        for (const auto& [name, what, is_name] : {std::tuple("frames", "pictures", &is_frame_name),
                                                  {"figures", "pictures", &is_figure_name},
                                                  {"stems", "stems", &is_stem_name}})
            if (std::ranges::count(products_, name) > 0) check_contents(folder_ / name, what, is_name);
    } catch (const fs::filesystem_error& failed) {
        refuse(folder_, failed.code().message());
    }
    if (goes_on) {
        keep();
    } else {
        notice_ = std::make_unique<InterruptionNotice>(staging_);
        remove_tree(staging_, error);
    }
    if (!error) fs::create_directory(staging_, error);
    if (!error) fs::create_directory(scratch(), error);
    if (error) refuse(folder_, error.message());
    for (int i = 0; i < kReserve; ++i)
        if (FileDescriptor spare = open_file("/dev/null", O_RDONLY)) reserve_.push_back(std::move(spare));
}

OutputFolder::~OutputFolder() {
    std::error_code ignored;          // a destructor cannot report it
    if (finishing_ || kept_) return;  // what is not in place is kept
    remove_tree(staging_, ignored);
    if (made_folder_) fs::remove(folder_, ignored);
}

void OutputFolder::keep() {
    if (std::exchange(kept_, true)) return;
    notice_.reset();
    notice_ = std::make_unique<InterruptionNotice>(staging_, true);
}

void OutputFolder::remove_product(std::string_view name) const {
    std::error_code stays;
    remove_tree(output_place(folder_ / name).path, stays);
}

void OutputFolder::take_back(std::string_view name) {
    std::error_code none;
    const OutputPlace place = output_place(folder_ / name);
    const bool is_product = place.kind == OutputPlace::Kind::file || place.kind == OutputPlace::Kind::folder;
    if (is_product && !fs::exists(staging_ / name, none)) fs::rename(place.path, staging_ / name);
}

void OutputFolder::remove_earlier(std::string_view name) {
    const OutputPlace earlier = output_place(folder_ / name);
    using Kind = OutputPlace::Kind;
    // One step, which cannot stop halfway; and on the same file system, unless a link leads elsewhere.
    if (earlier.kind == Kind::folder) {
        std::error_code elsewhere;
        fs::rename(earlier.path, scratch() / ("earlier_" + std::string(name)), elsewhere);
        if (elsewhere) remove_tree(earlier.path);
    } else if (earlier.kind == Kind::file) {
        fs::remove(earlier.path);
    }
}

void OutputFolder::adorn(std::string_view name, const std::function<void()>& work) {
    if (!name.empty()) adornments_.emplace_back(name);
    try {
        work();
    } catch (const std::runtime_error& failed) {
        failures_.emplace_back(failed.what());
    }
}

void OutputFolder::finish() {
    free_reserve();
    finishing_ = true;
    try {
        std::vector<fs::path> staged;
        for (const fs::path& entry : entries_of(staging_))
            if (entry != scratch()) staged.push_back(entry);
        remove_earlier(products_.front());
        const auto leading = std::ranges::find(staged, products_.front(), &fs::path::filename);
        if (leading != staged.end()) std::rotate(leading, leading + 1, staged.end());
        for (const std::string_view name : products_)
            if (fs::is_directory(staging_ / name) || !fs::exists(staging_ / name)) remove_earlier(name);
        for (const fs::path& product : staged) {
            const std::string name = product.filename().string();
            const auto put = [&] { put_in_place(product, folder_ / name); };
            if (std::ranges::find(adornments_, name) != adornments_.end())
                adorn("", put);
            else
                put();
        }
    } catch (const std::runtime_error& failed) {  // filesystem_error is one
        throw std::runtime_error(fmt::format("{}; the run is not complete, what it has computed stays in {}",
                                             failed.what(), staging_.string()));
    }
    std::error_code ignored;  // the next run removes it
    remove_tree(staging_, ignored);
    notice_.reset();
}

void throw_if_any(const std::vector<std::string>& failures, const fs::path& out) {
    constexpr std::string_view kError = "error: ";
    if (failures.empty()) return;
    std::string all = failures.front();
    for (const std::string_view more : std::span(failures).subspan(1))
        all += fmt::format("; {}", more.substr(more.starts_with(kError) ? kError.size() : 0));
    throw std::runtime_error(fmt::format("{}; all else is in {}", all, out.string()));
}

}  // namespace app
