#include "files/file_descriptor.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <memory>
#include <stdexcept>

#include "files/bad_input.h"

namespace app {

bool FileDescriptor::write(std::string_view bytes) const noexcept {
    while (!bytes.empty()) {
        const ssize_t wrote = ::write(number_, bytes.data(), bytes.size());
        if (wrote > 0) bytes.remove_prefix(static_cast<std::size_t>(wrote));
        if (wrote == 0) errno = ENOSPC;
        if (wrote == 0 || (wrote < 0 && errno != EINTR)) return false;
    }
    return true;
}

bool FileDescriptor::close() noexcept {
    const int number = std::exchange(number_, -1);
    return number < 0 || ::close(number) == 0;
}

Pipe make_pipe() {
    int ends[2];
    if (pipe2(ends, O_CLOEXEC) != 0) throw std::runtime_error("error: " + cannot("make a pipe"));
    return {FileDescriptor(ends[0]), FileDescriptor(ends[1])};
}

std::string read_file(const std::filesystem::path& file) {
    const std::unique_ptr<std::FILE, int (*)(std::FILE*)> in(std::fopen(file.c_str(), "rbe"), &std::fclose);
    std::string text;
    std::array<char, 65536> block;
    while (const std::size_t got = in ? std::fread(block.data(), 1, block.size(), in.get()) : 0)
        text.append(block.data(), got);
    if (!in || std::ferror(in.get()) != 0) throw BadInput("error: " + cannot("read " + file.string()));
    return text;
}

std::string cannot(std::string_view action, int error) {
    return fmt::format("cannot {}: {}", action, std::strerror(error != 0 ? error : errno));
}

}  // namespace app
