#pragma once
#include <algorithm>
#include <cstddef>
#include <filesystem>
#include <memory>
#include <new>
#include <span>
#include <string_view>
#include <type_traits>
#include <utility>

#include "files/file_descriptor.h"

namespace app {

/// Bytes that grow at their end, in a file without a name that is mapped into memory. What was not looked at lately
/// takes no memory of the process, however long a run is: pages go to the file and come back when they are read.
class GrowingFile {
public:
    /// Without a folder the file lies in the system's memory.
    explicit GrowingFile(std::filesystem::path folder) : folder_(std::move(folder)) {}
    ~GrowingFile();
    GrowingFile(GrowingFile&& other) noexcept;
    GrowingFile& operator=(GrowingFile&& other) noexcept;

    /// Room for so many bytes more after the first `used`; what was mapped may move. Throws std::runtime_error where
    /// the disk has no room.
    void reserve(std::size_t used, std::size_t more);
    [[nodiscard]] std::byte* data() const noexcept { return data_; }

private:
    void open();

    std::filesystem::path folder_;
    FileDescriptor file_;
    std::byte* data_ = nullptr;
    std::size_t room_ = 0, left_ = 0;  // left_: pages before it were let go
};

/// A vector of plain values in a GrowingFile, for what a run in real time measures and plays. Appending may wait for the
/// disk and throw as GrowingFile::reserve; references hold until then.
template <class T>
class DiskLog {
    static_assert(std::is_trivially_destructible_v<T>);

public:
    using value_type = T;
    DiskLog() : DiskLog(std::filesystem::path()) {}
    explicit DiskLog(std::filesystem::path folder) : file_(std::move(folder)) {}
    DiskLog(DiskLog&& other) noexcept : file_(std::move(other.file_)), size_(std::exchange(other.size_, 0)) {}
    DiskLog& operator=(DiskLog&& other) noexcept {
        std::swap(file_, other.file_), std::swap(size_, other.size_);
        return *this;
    }

    void push_back(const T& value) {
        file_.reserve(size_ * sizeof(T), sizeof(T));
        new (data() + size_++) T(value);
    }
    void append(std::span<const T> values) {
        file_.reserve(size_ * sizeof(T), values.size_bytes());
        std::uninitialized_copy(values.begin(), values.end(), data() + size_);
        size_ += values.size();
    }
    /// Leaves out what is behind the first `size`.
    void cut(std::size_t size) { size_ = std::min(size_, size); }
    [[nodiscard]] T* data() { return std::launder(reinterpret_cast<T*>(file_.data())); }
    [[nodiscard]] const T* data() const { return std::launder(reinterpret_cast<const T*>(file_.data())); }
    [[nodiscard]] std::size_t size() const { return size_; }
    [[nodiscard]] bool empty() const { return size_ == 0; }
    [[nodiscard]] T* begin() { return data(); }
    [[nodiscard]] T* end() { return data() + size_; }
    [[nodiscard]] const T* begin() const { return data(); }
    [[nodiscard]] const T* end() const { return data() + size_; }
    [[nodiscard]] T& operator[](std::size_t i) { return data()[i]; }
    [[nodiscard]] const T& operator[](std::size_t i) const { return data()[i]; }
    [[nodiscard]] T& front() { return *begin(); }
    [[nodiscard]] const T& front() const { return *begin(); }
    [[nodiscard]] T& back() { return data()[size_ - 1]; }
    [[nodiscard]] const T& back() const { return data()[size_ - 1]; }

private:
    GrowingFile file_;
    std::size_t size_ = 0;
};

/// Texts in the order in which they came, as a DiskLog.
class TextLog {
public:
    TextLog() : TextLog(std::filesystem::path()) {}
    explicit TextLog(const std::filesystem::path& folder) : bytes_(folder), ends_(folder) {}

    void push_back(std::string_view text) {
        bytes_.append({text.data(), text.size()});
        ends_.push_back(bytes_.size());
    }
    [[nodiscard]] std::size_t size() const { return ends_.size(); }
    [[nodiscard]] std::string_view operator[](std::size_t i) const {
        const std::size_t begin = i == 0 ? 0 : ends_[i - 1];
        return {bytes_.data() + begin, ends_[i] - begin};
    }

private:
    DiskLog<char> bytes_;
    DiskLog<std::size_t> ends_;
};

}  // namespace app
