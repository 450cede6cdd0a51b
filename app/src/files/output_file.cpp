#include "files/output_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <chrono>
#include <climits>
#include <cstring>
#include <stdexcept>
#include <string>
#include <system_error>
#include <thread>

#include "files/bad_input.h"

namespace app {
namespace fs = std::filesystem;
namespace {

constexpr std::string_view kPartial = ".partial";
constexpr std::chrono::seconds kPatience{10};  // until a named pipe has a reader
constexpr std::chrono::milliseconds kLookAgain{20};

std::string_view text_of(std::span<const std::uint8_t> bytes) {
    return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

[[noreturn]] void refuse(const fs::path& file, const std::string& found, const std::string& remedy) {
    throw BadInput(fmt::format("{}: error: found {}, expected the name of a file to write; {}", file.string(),
                               found, remedy));
}

[[noreturn]] void fail(const fs::path& file) {
    throw std::runtime_error("error: " + cannot("write " + file.string()) +
                             "; free some space or choose another --out");
}

fs::path folder_of(const fs::path& file) {
    return file.has_parent_path() ? file.parent_path() : fs::path(".");
}

/// Whether a symbolic link stands for an open file of a process: what it says is no path.
bool is_of_process(const fs::path& link) {
    std::error_code ignored;
    return fs::weakly_canonical(folder_of(link), ignored).string().starts_with("/proc/");
}

/// A name that may have a suffix.
fs::path partial_of(const fs::path& file) {
    const std::string name = file.filename().string();
    return folder_of(file) / (name.substr(0, NAME_MAX - kPartial.size()) + std::string(kPartial));
}

/// Standard output (/dev/stdout) is the stream of this process, at its place; others are opened.
FileDescriptor open_device(const fs::path& device) {
    std::error_code ignored;
    const std::string number = device.filename().string();
    int own = -1;
    if (fs::weakly_canonical(folder_of(device), ignored) == fmt::format("/proc/{}/fd", getpid()) &&
        std::from_chars(number.data(), number.data() + number.size(), own).ec == std::errc())
        return FileDescriptor(fcntl(own, F_DUPFD_CLOEXEC, 0));
    const auto deadline = std::chrono::steady_clock::now() + kPatience;
    FileDescriptor out = open_file(device, O_WRONLY | O_NOCTTY | O_NONBLOCK);
    while (!out && errno == ENXIO && fs::is_fifo(device, ignored) &&
           std::chrono::steady_clock::now() < deadline) {
        std::this_thread::sleep_for(kLookAgain);
        out = open_file(device, O_WRONLY | O_NOCTTY | O_NONBLOCK);
    }
    if (out) (void)fcntl(out.get(), F_SETFL, fcntl(out.get(), F_GETFL) & ~O_NONBLOCK);
    return out;
}

void write_to_device(const fs::path& staged, const fs::path& device) {
    std::fflush(stdout);  // what was printed before comes before
    const FileDescriptor in = open_file(staged, O_RDONLY);
    if (!in) fail(device);
    FileDescriptor out = open_device(device);
    if (!out) fail(device);
    std::array<char, 65536> block;
    for (;;) {
        const ssize_t got = ::read(in.get(), block.data(), block.size());
        if (got == 0) break;
        if (got < 0 && errno == EINTR) continue;
        if (got < 0 || !out.write({block.data(), static_cast<std::size_t>(got)})) fail(device);
    }
    if (!out.close()) fail(device);
    std::error_code ignored;
    fs::remove(staged, ignored);
}

/// One that may be written to but not read cannot be saved, and counts as saved.
void save_names_of(const fs::path& folder) {
    const FileDescriptor names = open_file(folder, O_RDONLY);
    if (!names && errno == EACCES) return;
    if (!names || !save(names)) throw std::runtime_error("error: " + cannot("save " + folder.string()));
}

/// A file, or a folder and all that it holds.
void save_all(const fs::path& path) {
    if (fs::is_directory(path))
        for (const fs::path& entry : entries_of(path)) save_all(entry);
    save_on_disk(path);
}

/// Where a file may be staged beside `file`: where there is none, or a regular one, which a run has left.
fs::path free_partial_of(const fs::path& file) {
    const fs::path partial = partial_of(file);
    std::error_code error;
    const fs::file_type type = fs::symlink_status(partial, error).type();
    if (type != fs::file_type::not_found && type != fs::file_type::regular)
        refuse(partial, "what is no file", "move it away");
    return partial;
}

/// By way of a copy beside it.
void move_across_file_systems(const fs::path& staged, const fs::path& target) {
    const fs::path partial = free_partial_of(target);
    std::error_code error;
    fs::remove(partial, error);
    try {
        fs::copy(staged, partial, fs::copy_options::recursive);
        save_all(partial);
        fs::rename(partial, target);
    } catch (const std::runtime_error& failed) {
        remove_tree(partial, error);
        const auto* reason = dynamic_cast<const fs::filesystem_error*>(&failed);
        if (!reason) throw;
        errno = reason->code().value();
        fail(target);
    }
    remove_tree(staged, error);
}

void move(const fs::path& staged, const fs::path& target) {
    save_all(staged);
    std::error_code error;
    fs::rename(staged, target, error);
    if (error == std::errc::cross_device_link)
        move_across_file_systems(staged, target);
    else if (error)
        throw std::runtime_error("error: " + cannot("write " + target.string(), error.value()));
    save_names_of(folder_of(target));
}

}  // namespace

void write_file(const fs::path& file, std::string_view text) {
    FileDescriptor out = open_file(file, O_WRONLY | O_CREAT | O_TRUNC);
    if (out && out.write(text) && out.close()) return;
    const int reason = errno;
    std::error_code ignored;
    if (fs::is_regular_file(file, ignored)) fs::remove(file, ignored);
    errno = reason;
    fail(file);
}

void write_file(const fs::path& file, std::span<const std::uint8_t> bytes) {
    write_file(file, text_of(bytes));
}

void save_on_disk(const fs::path& path) {
    const FileDescriptor file = open_file(path, O_RDONLY);
    if (!file || !save(file)) throw std::runtime_error("error: " + cannot("save " + path.string()));
}

// The library gives up where a signal interrupts it.

void refuse_replacing(const fs::path& output, std::span<const fs::path> inputs) {
    for (const fs::path& input : inputs)
        if (std::error_code none; fs::is_regular_file(output, none) && fs::equivalent(output, input, none))
            throw BadInput(
                fmt::format("error: found {} as an output, which is read, too; expected a file of its own",
                            output.string()));
}

std::vector<fs::path> entries_of(const fs::path& folder) {
    for (;;) {
        std::vector<fs::path> entries;
        std::error_code error;
        for (fs::directory_iterator entry(folder, error), end; !error && entry != end; entry.increment(error))
            entries.push_back(entry->path());
        std::ranges::sort(entries);
        if (!error) return entries;
        if (error != std::errc::interrupted) throw fs::filesystem_error("cannot look into", folder, error);
    }
}

void remove_tree(const fs::path& folder, std::error_code& error) {
    do fs::remove_all(folder, error);
    while (error == std::errc::interrupted);
}

void remove_tree(const fs::path& folder) {
    std::error_code error;
    remove_tree(folder, error);
    if (error) throw fs::filesystem_error("cannot remove", folder, error);
}

OutputPlace output_place(const fs::path& name) {
    constexpr int kMostLinks = 40;  // as Linux follows
    using Kind = OutputPlace::Kind;
    fs::path path = name;
    std::error_code error;
    bool of_process = false;
    for (int links = 0; fs::symlink_status(path, error).type() == fs::file_type::symlink; ++links) {
        if ((of_process = is_of_process(path))) break;
        const fs::path to = fs::read_symlink(path, error);
        if (error || links == kMostLinks) refuse(name, "links without an end", "correct them");
        path = to.is_absolute() ? to : folder_of(path) / to;
    }
    switch (fs::status(path, error).type()) {
        case fs::file_type::not_found:
            return {path, Kind::nothing};
        case fs::file_type::directory:
            return {path, Kind::folder};
        case fs::file_type::regular:
            return {path, of_process ? Kind::written_to : Kind::file};
        case fs::file_type::character:
        case fs::file_type::block:
        case fs::file_type::fifo:
            return {path, Kind::written_to};
        case fs::file_type::none:
            refuse(name, error.message(), "choose another");
        default:
            if (of_process) return {path, Kind::written_to};  // open already: a stream
            refuse(name, "a socket", "choose another");
    }
}

void put_in_place(const fs::path& staged, const fs::path& name) {
    const OutputPlace place = output_place(name);
    if (place.kind == OutputPlace::Kind::written_to)
        write_to_device(staged, place.path);
    else
        move(staged, place.path);
}

OutputFile::OutputFile(fs::path file) : file_(std::move(file)) {
    const OutputPlace place = output_place(file_);
    if (!file_.has_filename() || place.kind == OutputPlace::Kind::folder)
        refuse(file_, "a folder", "name a file in it");
    if (place.kind == OutputPlace::Kind::written_to) {
        memory_ = FileDescriptor(memfd_create("musicworld", MFD_CLOEXEC));
        if (!memory_) throw std::runtime_error("error: " + cannot("make a file in memory"));
        partial_ = fmt::format("/proc/{}/fd/{}", getpid(), memory_.get());  // for other programs, too
        return;
    }
    std::error_code error;
    if (const fs::path folder = folder_of(place.path); !fs::is_directory(folder, error))
        throw BadInput(
            fmt::format("{}: error: found no such folder, expected one to write {} into; make it first",
                        folder.string(), file_.filename().string()));
    partial_ = free_partial_of(place.path);
    kept_ = fs::exists(fs::symlink_status(partial_, error));  // not ours, until it is written
}

OutputFile::~OutputFile() {
    std::error_code ignored;
    if (!kept_ && !memory_) fs::remove(partial_, ignored);
}

void OutputFile::finish() {
    put_in_place(partial_, file_);
    kept_ = true;
}

void write_finished_file(const fs::path& file, std::string_view text) {
    OutputFile out(file);
    write_file(out.partial(), text);
    out.finish();
}

void write_finished_file(const fs::path& file, std::span<const std::uint8_t> bytes) {
    write_finished_file(file, text_of(bytes));
}

}  // namespace app
