#pragma once
#include <filesystem>
#include <string>
#include <string_view>
#include <utility>

namespace app {

/// A file descriptor that this object owns and closes; -1: none.
class FileDescriptor {
public:
    explicit FileDescriptor(int number = -1) noexcept : number_(number) {}
    ~FileDescriptor() { close(); }
    FileDescriptor(FileDescriptor&& other) noexcept : number_(std::exchange(other.number_, -1)) {}
    FileDescriptor& operator=(FileDescriptor&& other) noexcept {
        std::swap(number_, other.number_);
        return *this;
    }

    [[nodiscard]] int get() const noexcept { return number_; }
    [[nodiscard]] explicit operator bool() const noexcept { return number_ >= 0; }
    /// Writes all of it, waiting for room; false: errno says why not.
    [[nodiscard]] bool write(std::string_view bytes) const noexcept;
    /// False if the system could not write what was still to be written (errno says why).
    bool close() noexcept;

private:
    int number_;
};

/// open(2) with O_CLOEXEC, tried again where a signal interrupts it; none: errno says why.
[[nodiscard]] FileDescriptor open_file(const std::filesystem::path& file, int flags,
                                       unsigned mode = 0666) noexcept;

/// Has the bytes of an open file, or the names in an open folder, on the disk. False: errno says why. Places that
/// cannot be saved so (some network file systems) count as saved.
[[nodiscard]] bool save(const FileDescriptor& file) noexcept;

/// The two ends of a pipe, which children inherit only where that is asked for.
struct Pipe {
    FileDescriptor out, in;  ///< to read from; to write into
};
/// Throws std::runtime_error.
[[nodiscard]] Pipe make_pipe();

/// "cannot ACTION: REASON" for what the operating system has refused; `error`: its number (errno's, as it is
/// now, if it is 0).
[[nodiscard]] std::string cannot(std::string_view action, int error = 0);

}  // namespace app
