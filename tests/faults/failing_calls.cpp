// A library to preload: makes one of a program's calls to the system fail, among those on files below a folder. It acts
// in the first process alone; what that starts is left in peace.
//
//   FAULTS_UNDER  the folder, absolute
//   FAULTS_ERROR  ENOSPC, EIO, EMFILE, EINTR, or SHORT: writes that take half of what they are given
//   FAULTS_AT     which of the calls that can fail so, from 1; 0: none, they are counted
//   FAULTS_STAY   1: all later ones, too, as on a disk that is full
//   FAULTS_LOG    a file: how many such calls there were, then the first that failed and its path
#include <dlfcn.h>
#include <fcntl.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/uio.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <climits>
#include <cstdarg>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string>

namespace {

enum Call : unsigned { opens = 1, writes = 2, closes = 4, saves = 8, moves = 16, makes = 32, removes = 64 };

struct Error {
    const char* name;
    int number;
    unsigned calls;  // that may fail so
};
constexpr Error kErrors[] = {{"ENOSPC", ENOSPC, opens | writes | closes | saves | moves | makes},
                             {"EIO", EIO, opens | writes | closes | saves | moves | makes | removes},
                             {"EMFILE", EMFILE, opens},
                             {"EINTR", EINTR, opens | writes | closes | saves},
                             {"SHORT", 0, writes}};

struct Plan {
    std::string under, log;
    Error error{"", 0, 0};
    long at = 0;
    bool stays = false;
    std::atomic<long> count{0};
    std::string hit;

    Plan() {
        const auto taken = [](const char* name) {
            const char* value = std::getenv(name);
            std::string text = value != nullptr ? value : "";
            unsetenv(name);
            return text;
        };
        under = taken("FAULTS_UNDER"), log = taken("FAULTS_LOG");
        const std::string name = taken("FAULTS_ERROR");
        for (const Error& known : kErrors)
            if (name == known.name) error = known;
        at = std::atol(taken("FAULTS_AT").c_str());
        stays = taken("FAULTS_STAY") == "1";
        unsetenv("LD_PRELOAD");
    }
    ~Plan() {
        if (log.empty()) return;
        const std::string text = std::to_string(count) + "\n" + hit + "\n";
        const int file =
            static_cast<int>(syscall(SYS_openat, AT_FDCWD, log.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600));
        (void)!syscall(SYS_write, file, text.data(), text.size());
        syscall(SYS_close, file);
        under.clear();
    }

    [[nodiscard]] bool is_below(const std::string& path) const {
        return !under.empty() && path.starts_with(under) && path != log &&
               (path.size() == under.size() || path[under.size()] == '/');
    }
    /// Whether this call is to fail.
    bool strikes(Call call, const char* name, const std::string& path) {
        if ((error.calls & call) == 0 || !is_below(path)) return false;
        const long number = ++count;
        const bool struck = at > 0 && (number == at || (stays && number > at));
        if (number == at) hit = std::string(name) + " " + path;
        if (struck) errno = error.number;
        return struck;
    }
};

Plan& plan() {
    static Plan the_plan;
    return the_plan;
}
[[gnu::constructor]] void begin() {
    (void)plan();
}

template <class Function>
Function* real(Function*, const char* name) {
    return reinterpret_cast<Function*>(dlsym(RTLD_NEXT, name));
}
#define REAL(name)                                          \
    [] {                                                    \
        static auto* const function = real(&::name, #name); \
        return function;                                    \
    }()

std::string path_of(int file) {
    char path[PATH_MAX];
    const ssize_t size = readlink(("/proc/self/fd/" + std::to_string(file)).c_str(), path, sizeof path);
    return size > 0 ? std::string(path, static_cast<std::size_t>(size)) : std::string();
}
std::string path_at(int folder, const char* path) {
    if (path == nullptr || *path == '/') return path != nullptr ? path : "";
    if (folder != AT_FDCWD) return path_of(folder) + "/" + path;
    char here[PATH_MAX];
    return getcwd(here, sizeof here) != nullptr ? std::string(here) + "/" + path : std::string(path);
}
/// Of a regular file that is open for writing; else empty.
std::string written_path(int file) {
    struct stat status {};
    if (fstat(file, &status) != 0 || !S_ISREG(status.st_mode) ||
        (fcntl(file, F_GETFL) & O_ACCMODE) == O_RDONLY)
        return {};
    return path_of(file);
}
mode_t mode_in(int flags, va_list arguments) {
    return (flags & (O_CREAT | __O_TMPFILE)) != 0 ? static_cast<mode_t>(va_arg(arguments, unsigned)) : 0;
}

bool strikes_open(int folder, const char* path) {
    return plan().strikes(opens, "open", path_at(folder, path));
}
bool strikes_write(int file) {
    return plan().strikes(writes, "write", written_path(file));
}
/// What a write of which half goes through takes.
std::size_t half(std::size_t size) {
    return plan().error.number == 0 ? (size + 1) / 2 : 0;
}

}  // namespace

extern "C" {

#define OPEN(name)                                                                \
    int name(const char* path, int flags, ...) {                                  \
        va_list arguments;                                                        \
        va_start(arguments, flags);                                               \
        const mode_t mode = mode_in(flags, arguments);                            \
        va_end(arguments);                                                        \
        return strikes_open(AT_FDCWD, path) ? -1 : REAL(name)(path, flags, mode); \
    }
#define OPENAT(name)                                                                    \
    int name(int folder, const char* path, int flags, ...) {                            \
        va_list arguments;                                                              \
        va_start(arguments, flags);                                                     \
        const mode_t mode = mode_in(flags, arguments);                                  \
        va_end(arguments);                                                              \
        return strikes_open(folder, path) ? -1 : REAL(name)(folder, path, flags, mode); \
    }
OPEN(open)
OPEN(open64)
OPENAT(openat)
OPENAT(openat64)
int creat(const char* path, mode_t mode) {
    return strikes_open(AT_FDCWD, path) ? -1 : REAL(creat)(path, mode);
}
FILE* fopen(const char* path, const char* mode) {
    return strikes_open(AT_FDCWD, path) ? nullptr : REAL(fopen)(path, mode);
}
FILE* fopen64(const char* path, const char* mode) {
    return strikes_open(AT_FDCWD, path) ? nullptr : REAL(fopen64)(path, mode);
}

ssize_t write(int file, const void* bytes, std::size_t size) {
    if (!strikes_write(file)) return REAL(write)(file, bytes, size);
    return half(size) > 0 ? REAL(write)(file, bytes, half(size)) : -1;
}
ssize_t pwrite(int file, const void* bytes, std::size_t size, off_t at) {
    if (!strikes_write(file)) return REAL(pwrite)(file, bytes, size, at);
    return half(size) > 0 ? REAL(pwrite)(file, bytes, half(size), at) : -1;
}
ssize_t pwrite64(int file, const void* bytes, std::size_t size, off64_t at) {
    if (!strikes_write(file)) return REAL(pwrite64)(file, bytes, size, at);
    return half(size) > 0 ? REAL(pwrite64)(file, bytes, half(size), at) : -1;
}
ssize_t writev(int file, const iovec* parts, int count) {
    if (!strikes_write(file)) return REAL(writev)(file, parts, count);
    return plan().error.number == 0 ? REAL(writev)(file, parts, 1) : -1;
}
std::size_t fwrite(const void* bytes, std::size_t size, std::size_t count, FILE* file) {
    return strikes_write(fileno(file)) && plan().error.number != EINTR && half(1) == 0
               ? 0
               : REAL(fwrite)(bytes, size, count, file);
}
int fclose(FILE* file) {
    const bool struck =
        plan().error.number != EINTR && plan().strikes(closes, "fclose", written_path(fileno(file)));
    const int result = REAL(fclose)(file);
    if (struck) errno = plan().error.number;
    return struck ? EOF : result;
}
int close(int file) {
    const bool struck = plan().strikes(closes, "close", written_path(file));
    const int result = REAL(close)(file);
    if (struck) errno = plan().error.number;
    return struck ? -1 : result;
}

int fsync(int file) {
    return plan().strikes(saves, "fsync", path_of(file)) ? -1 : REAL(fsync)(file);
}
int fdatasync(int file) {
    return plan().strikes(saves, "fdatasync", path_of(file)) ? -1 : REAL(fdatasync)(file);
}
int rename(const char* from, const char* to) noexcept {
    return plan().strikes(moves, "rename", path_at(AT_FDCWD, to)) ? -1 : REAL(rename)(from, to);
}
int link(const char* from, const char* to) noexcept {
    return plan().strikes(moves, "link", path_at(AT_FDCWD, to)) ? -1 : REAL(link)(from, to);
}
int mkdir(const char* path, mode_t mode) noexcept {
    return plan().strikes(makes, "mkdir", path_at(AT_FDCWD, path)) ? -1 : REAL(mkdir)(path, mode);
}
int remove(const char* path) noexcept {
    return plan().strikes(removes, "remove", path_at(AT_FDCWD, path)) ? -1 : REAL(remove)(path);
}
int unlink(const char* path) noexcept {
    return plan().strikes(removes, "unlink", path_at(AT_FDCWD, path)) ? -1 : REAL(unlink)(path);
}
int unlinkat(int folder, const char* path, int flags) noexcept {
    return plan().strikes(removes, "unlinkat", path_at(folder, path)) ? -1
                                                                      : REAL(unlinkat)(folder, path, flags);
}

}  // extern "C"
