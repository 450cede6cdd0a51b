#include "trace/fpzip_block.h"

#include <fpzip.h>
#include <linux/audit.h>
#include <linux/filter.h>
#include <linux/seccomp.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <sys/time.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <csignal>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <system_error>

#include "trace/binary_place.h"

namespace tracking {
namespace {

// Recordings in which nothing moves have 5 values a byte with 22 columns (the times differ), more with more columns.
constexpr std::size_t kMostValues = std::size_t{1} << 25, kMostValuesOfByte = 64;
// Of processor time: twenty times what fpzip takes (0.05 us a value), and what a process takes.
constexpr double kStartS = 0.1, kValueS = 1e-6;

std::size_t most_values(std::string_view bytes) {
    return std::min(bytes.size(), kMostValues / kMostValuesOfByte) * kMostValuesOfByte;
}

/// What the child tells, in memory that both see; the values follow.
struct Answer {
    enum class State : int { unfinished, no_header, other_array, too_large, broken, whole };
    State state;
    int columns, rows;

    float* values() { return reinterpret_cast<float*>(this + 1); }
};

/// Memory that parent and child share; none where there is none left.
class SharedAnswer {
public:
    explicit SharedAnswer(std::size_t values)
        : size_(sizeof(Answer) + values * sizeof(float)),
          memory_(mmap(nullptr, size_, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS | MAP_NORESERVE, -1,
                       0)) {}
    ~SharedAnswer() {
        if (*this) munmap(memory_, size_);
    }
    SharedAnswer(const SharedAnswer&) = delete;
    SharedAnswer& operator=(const SharedAnswer&) = delete;
    explicit operator bool() const { return memory_ != MAP_FAILED; }
    Answer* operator->() const { return static_cast<Answer*>(memory_); }
    Answer& operator*() const { return *static_cast<Answer*>(memory_); }

private:
    std::size_t size_;
    void* memory_;
};

/// Of what the process inherited, it keeps neither descriptors nor what its parent does about signals: blocked ones would
/// survive a fork, and a handler would keep it from ending.
void forget_the_parent() {
    closefrom(0);
    for (const int signal : {SIGINT, SIGTERM, SIGPROF, SIGXCPU}) (void)std::signal(signal, SIG_DFL);
    sigset_t none;
    sigemptyset(&none);
    (void)sigprocmask(SIG_SETMASK, &none, nullptr);
}

/// The process ends (SIGPROF) when it has used so much more processor time: wrong bytes make fpzip loop for ever. Should it
/// not, it ends a second or two later (SIGXCPU).
void limit_time(double seconds) {
    rlimit whole{};
    if (getrlimit(RLIMIT_CPU, &whole) == 0) {
        whole.rlim_cur = std::min(whole.rlim_max, static_cast<rlim_t>(std::ceil(seconds)) + 1);
        (void)setrlimit(RLIMIT_CPU, &whole);
    }
    itimerval limit{};
    limit.it_value.tv_sec = static_cast<time_t>(seconds);
    limit.it_value.tv_usec = static_cast<suseconds_t>(1e6 * (seconds - std::floor(seconds)));
    (void)setitimer(ITIMER_PROF, &limit, nullptr);
}

/// From here on the process may compute, ask for memory and end, and on processors other than x86-64 whatever needs neither
/// files nor its parent's descriptors. (Sanitizers do more.)
void allow_nothing_else() {
    const rlimit none{0, 0};
    (void)setrlimit(RLIMIT_CORE, &none);
    (void)setrlimit(RLIMIT_FSIZE, &none);
#if !defined(MUSICWORLD_SANITIZED) && defined(__x86_64__)
    constexpr std::uint32_t kNumber = offsetof(seccomp_data, nr), kMachine = offsetof(seccomp_data, arch);
    sock_filter filter[] = {BPF_STMT(BPF_LD | BPF_W | BPF_ABS, kMachine),
                            BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, AUDIT_ARCH_X86_64, 0, 8),
                            BPF_STMT(BPF_LD | BPF_W | BPF_ABS, kNumber),
                            BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, SYS_brk, 7, 0),
                            BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, SYS_mmap, 6, 0),
                            BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, SYS_munmap, 5, 0),
                            BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, SYS_mprotect, 4, 0),
                            BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, SYS_madvise, 3, 0),
                            BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, SYS_mremap, 2, 0),
                            BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, SYS_exit_group, 1, 0),
                            BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_KILL_PROCESS),
                            BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ALLOW)};
    const sock_fprog program{sizeof filter / sizeof *filter, filter};
    if (prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) == 0)
        (void)prctl(PR_SET_SECCOMP, SECCOMP_MODE_FILTER, &program, 0, 0);
#endif
}

Answer::State decompress(FPZ* stream, std::size_t most, Answer& answer) {
    if (fpzip_read_header(stream) == 0) return Answer::State::no_header;
    const auto positive = [](int extent) { return extent > 0; };
    if (stream->type != FPZIP_TYPE_FLOAT || stream->nz != 1 || stream->nf != 1 || !positive(stream->nx) ||
        !positive(stream->ny))
        return Answer::State::other_array;
    answer.columns = stream->nx;
    answer.rows = stream->ny;
    if (static_cast<std::size_t>(stream->nx) * static_cast<std::size_t>(stream->ny) > most)
        return Answer::State::too_large;
    limit_time(kStartS + kValueS * stream->nx * stream->ny);
    allow_nothing_else();
    return fpzip_read(stream, answer.values()) > 0 ? Answer::State::whole : Answer::State::broken;
}

/// The child. Reading the header takes arithmetic alone, whatever the bytes. A file in memory ends where the bytes end; a buffer, to libfpzip, never.
[[noreturn]] void decompress_and_end(std::string_view bytes, Answer& answer) {
    forget_the_parent();
    std::FILE* file = fmemopen(const_cast<char*>(bytes.data()), bytes.size(), "rb");
    limit_time(kStartS);
    if (FPZ* stream = file == nullptr ? nullptr : fpzip_read_from_file(file); stream != nullptr)
        answer.state = decompress(stream, most_values(bytes), answer);
    _exit(0);
}

std::string finding(const Answer& answer, bool ended_well) {
    if (!ended_well) return "floats that fpzip fails at";
    switch (answer.state) {
        case Answer::State::no_header:
            return "floats that are not fpzip's";
        case Answer::State::other_array:
            return "an array of fpzip that is no table of floats";
        case Answer::State::too_large:
            return "a table of " + std::to_string(answer.rows) + " rows of " +
                   std::to_string(answer.columns) + " floats";
        default:
            return "floats that end too soon";
    }
}

}  // namespace

FloatTable decompress_floats(std::string_view bytes, const std::string& file, std::size_t at) {
    if (bytes.empty()) fail_at_byte(file, at, "no floats", "a table of them, as fpzip compresses it");
    const std::size_t most = most_values(bytes);
    SharedAnswer answer(most);
    if (!answer)
        fail_at_byte(file, at, "no memory for the " + std::to_string(most) + " floats that it may hold",
                     "4 bytes each", "free some memory");
    const pid_t child = fork();
    if (child < 0) throw std::system_error(errno, std::generic_category(), "cannot start a process");
    if (child == 0) decompress_and_end(bytes, *answer);
    int status = 0;
    while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
    }
    const bool ended_well = WIFEXITED(status) && WEXITSTATUS(status) == 0;
    const Answer::State state = answer->state;
    const int columns = answer->columns, rows = answer->rows;
    if (!ended_well || state != Answer::State::whole || columns < 1 || rows < 1 ||
        static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows) > most)
        fail_at_byte(file, at, finding(*answer, ended_well),
                     "a table of at most " + std::to_string(most) + " floats, as fpzip compresses it");
    FloatTable table{static_cast<std::size_t>(columns), static_cast<std::size_t>(rows), {}};
    table.values.assign(answer->values(), answer->values() + table.columns * table.rows);
    return table;
}

}  // namespace tracking
