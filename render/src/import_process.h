#pragma once
#include <sys/types.h>

#include <filesystem>
#include <string>

namespace render {

/// One run of musicworld_mesh_import on one file: started by the constructor (posix_spawn, so safe beside
/// other threads), killed by the destructor if it still runs. The child limits its own memory and processor
/// time; the parent limits bytes and waiting.
class ImportProcess {
public:
    /// Throws std::runtime_error ("found ..., expected ...") when the program cannot be started.
    explicit ImportProcess(const std::filesystem::path& file);
    ~ImportProcess();
    ImportProcess(const ImportProcess&) = delete;
    ImportProcess& operator=(const ImportProcess&) = delete;

    /// All that the child wrote, once it has ended well. Throws std::runtime_error ("found ..., expected
    /// ...") when it crashed, took longer than 20 s from this call on, or wrote more than any allowed mesh
    /// needs. Call once.
    [[nodiscard]] std::string output();

private:
    void read_until_closed(std::string& bytes);
    [[nodiscard]] int wait_for_exit();

    pid_t child_ = -1;
    int pipe_ = -1;
};

}  // namespace render
