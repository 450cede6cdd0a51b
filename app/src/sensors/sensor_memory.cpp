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
#include <filesystem>
#include <stdexcept>
#include <utility>

namespace app {
namespace fs = std::filesystem;
namespace {

constexpr std::string_view kMemoryPrefix = "musicworld.";
constexpr int kMostNames = 100;  // several threads may be making memory
constexpr const char* kFolder = "/dev/shm";

[[noreturn]] void fail_memory(const char* action) {
    throw std::runtime_error("error: " + cannot(action));
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
FileDescriptor make_memory() {
    FileDescriptor memory;
    for (int n = 0; !memory; ++n) {
        const std::string name = fmt::format("/{}{}.{}", kMemoryPrefix, getpid(), n);
        memory = FileDescriptor(shm_open(name.c_str(), O_CREAT | O_EXCL | O_RDWR, 0600));
        if (memory)
            shm_unlink(name.c_str());
        else if (errno != EEXIST || n == kMostNames)
            fail_memory("make shared memory");
    }
    if (ftruncate(memory.get(), sizeof(SensorMemory)) != 0) fail_memory("size shared memory");
    return memory;
}

}  // namespace

void SensorReport::set_text(std::string_view line) {
    text.fill(0);
    std::copy_n(line.data(), std::min(line.size(), text.size() - 1), text.data());
}

SharedSensorMemory::SharedSensorMemory() : descriptor_(make_memory()) {
    map();
    memory_->version = tracking::StickState::kVersion;
}

SharedSensorMemory::SharedSensorMemory(int descriptor) : descriptor_(descriptor) {
    struct stat found {};
    const bool large_enough = fstat(descriptor, &found) == 0 && found.st_size == off_t{sizeof(SensorMemory)};
    if (large_enough) map();
    if (!large_enough || memory_->version != tracking::StickState::kVersion)
        throw std::runtime_error(
            "error: found no shared memory of this build, expected to be started by the program itself");
}

void SharedSensorMemory::map() {
    void* memory = mmap(nullptr, sizeof(SensorMemory), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_POPULATE,
                        descriptor_.get(), 0);
    if (memory == MAP_FAILED) fail_memory("map shared memory");
    memory_ = static_cast<SensorMemory*>(memory);
}

SharedSensorMemory::SharedSensorMemory(SharedSensorMemory&& other) noexcept
    : descriptor_(std::move(other.descriptor_)), memory_(std::exchange(other.memory_, nullptr)) {}

SharedSensorMemory::~SharedSensorMemory() {
    if (memory_) munmap(memory_, sizeof(SensorMemory));
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
