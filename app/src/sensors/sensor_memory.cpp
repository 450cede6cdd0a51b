#include "sensors/sensor_memory.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <csignal>
#include <cstring>
#include <filesystem>
#include <stdexcept>
#include <utility>

namespace app {
namespace fs = std::filesystem;
namespace {

constexpr std::string_view kMemoryPrefix = "musicworld.";
constexpr int kMostNames = 100;  // several threads may be making memory
constexpr const char* kFolder = "/dev/shm";

[[noreturn]] void fail_memory(const char* what) {
    throw std::runtime_error(fmt::format(
        "error: found that {} shared memory failed ({}), expected it to work", what, std::strerror(errno)));
}

/// The process in "musicworld.PID.N"; 0 for another name.
pid_t maker_of(std::string_view name) {
    if (!name.starts_with(kMemoryPrefix)) return 0;
    name.remove_prefix(kMemoryPrefix.size());
    pid_t pid = 0;
    const auto [end, error] = std::from_chars(name.data(), name.data() + name.size(), pid);
    return error == std::errc{} && end != name.data() + name.size() && *end == '.' ? pid : 0;
}

/// A new descriptor of nameless shared memory.
int make_memory() {
    int descriptor = -1;
    for (int n = 0; descriptor < 0; ++n) {
        const std::string name = fmt::format("/{}{}.{}", kMemoryPrefix, getpid(), n);
        descriptor = shm_open(name.c_str(), O_CREAT | O_EXCL | O_RDWR, 0600);
        if (descriptor >= 0)
            shm_unlink(name.c_str());
        else if (errno != EEXIST || n == kMostNames)
            fail_memory("making");
    }
    if (ftruncate(descriptor, sizeof(SensorMemory)) != 0) {
        close(descriptor);
        fail_memory("sizing");
    }
    return descriptor;
}

}  // namespace

void SensorReport::set_text(std::string_view line) {
    text.fill(0);
    std::copy_n(line.data(), std::min(line.size(), text.size() - 1), text.data());
}

SharedSensorMemory::SharedSensorMemory() : descriptor_(make_memory()) {
    map();
}

SharedSensorMemory::SharedSensorMemory(int descriptor) : descriptor_(descriptor) {
    struct stat found {};
    if (fstat(descriptor, &found) != 0 || found.st_size < static_cast<off_t>(sizeof(SensorMemory)))
        throw std::runtime_error(
            "error: found no shared memory, expected to be started by the program itself");
    map();
}

void SharedSensorMemory::map() {
    void* memory = mmap(nullptr, sizeof(SensorMemory), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_POPULATE,
                        descriptor_, 0);
    if (memory == MAP_FAILED) {
        close(descriptor_);
        fail_memory("mapping");
    }
    memory_ = static_cast<SensorMemory*>(memory);
}

SharedSensorMemory::SharedSensorMemory(SharedSensorMemory&& other) noexcept
    : descriptor_(std::exchange(other.descriptor_, -1)), memory_(std::exchange(other.memory_, nullptr)) {}

SharedSensorMemory::~SharedSensorMemory() {
    if (memory_) munmap(memory_, sizeof(SensorMemory));
    if (descriptor_ >= 0) close(descriptor_);
}

void sweep_left_memory() noexcept {
    std::error_code error;
    for (fs::directory_iterator at(kFolder, error), end; !error && at != end; at.increment(error)) {
        const std::string name = at->path().filename().string();
        const pid_t maker = maker_of(name);
        if (maker <= 0 || kill(maker, 0) == 0 || errno != ESRCH) continue;
        struct stat found {};
        if (stat(at->path().c_str(), &found) == 0 && found.st_uid == geteuid())
            shm_unlink(("/" + name).c_str());
    }
}

}  // namespace app
