#include "files/disk_log.h"

#include <fcntl.h>
#include <sys/mman.h>

#include <cerrno>
#include <cstdint>
#include <stdexcept>
#include <string>

namespace app {
namespace {

constexpr std::size_t kStep = std::size_t{1} << 18;  // whole pages; twice that stays in memory

[[noreturn]] void fail(const std::filesystem::path& folder, int error) {
    throw std::runtime_error("error: " + cannot("keep what is played in " + folder.string(), error) +
                             "; free some space or choose another --out");
}

}  // namespace

GrowingFile::~GrowingFile() {
    if (data_ != nullptr) munmap(data_, room_);
}

GrowingFile::GrowingFile(GrowingFile&& other) noexcept
    : folder_(std::move(other.folder_)),
      file_(std::move(other.file_)),
      data_(std::exchange(other.data_, nullptr)),
      room_(std::exchange(other.room_, 0)),
      left_(std::exchange(other.left_, 0)) {}

GrowingFile& GrowingFile::operator=(GrowingFile&& other) noexcept {
    std::swap(folder_, other.folder_), std::swap(file_, other.file_), std::swap(data_, other.data_);
    std::swap(room_, other.room_), std::swap(left_, other.left_);
    return *this;
}

void GrowingFile::open() {
    if (folder_.empty()) {
        file_ = FileDescriptor(memfd_create("log", MFD_CLOEXEC));
    } else {
        const std::filesystem::path name =
            folder_ / ("log" + std::to_string(reinterpret_cast<std::uintptr_t>(this)));
        file_ = open_file(name, O_RDWR | O_CREAT | O_EXCL, 0600);
        std::error_code none;
        if (file_) std::filesystem::remove(name, none);
    }
    if (!file_) fail(folder_, errno);
}

void GrowingFile::reserve(std::size_t used, std::size_t more) {
    if (used + more <= room_) return;
    if (!file_) open();
    const std::size_t room = (used + more + kStep - 1) / kStep * kStep;
    // A page without a place on the disk would end the program when it is written to.
    int error = 0;
    do error = posix_fallocate(file_.get(), static_cast<off_t>(room_), static_cast<off_t>(room - room_));
    while (error == EINTR);
    if (error != 0) fail(folder_, error);
    void* const data = data_ == nullptr
                           ? mmap(nullptr, room, PROT_READ | PROT_WRITE, MAP_SHARED, file_.get(), 0)
                           : mremap(data_, room_, room, MREMAP_MAYMOVE);
    if (data == MAP_FAILED) fail(folder_, errno);
    data_ = static_cast<std::byte*>(data), room_ = room;
    if (const std::size_t old = used / kStep * kStep; old > left_ + kStep) {
        (void)madvise(data_ + left_, old - kStep - left_, MADV_DONTNEED);
        left_ = old - kStep;
    }
}

}  // namespace app
