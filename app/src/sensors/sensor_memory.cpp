#include "sensors/sensor_memory.h"

#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <stdexcept>

namespace app {
namespace {

[[noreturn]] void fail_memory(const char* action) {
    throw std::runtime_error("error: " + cannot(action));
}

}  // namespace

void SensorReport::set_text(std::string_view line) {
    text.fill(0);
    std::copy_n(line.data(), std::min(line.size(), text.size() - 1), text.data());
}

SharedSensorMemory::SharedSensorMemory() : descriptor_(memfd_create("musicworld", MFD_CLOEXEC)) {
    if (!descriptor_) fail_memory("make shared memory");
    if (ftruncate(descriptor_.get(), sizeof(SensorMemory)) != 0) fail_memory("size shared memory");
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
    memory_.reset(static_cast<SensorMemory*>(memory));
}

void SharedSensorMemory::Unmap::operator()(SensorMemory* memory) const {
    munmap(memory, sizeof(SensorMemory));
}

}  // namespace app
