#include "files/interruption_notice.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <climits>
#include <csignal>

namespace app {
namespace {

// A handler can neither be given anything nor allocate.
std::array<char, PATH_MAX + 200> notice;
volatile std::sig_atomic_t notice_size = 0;

void tell_and_end(int signal) {
    (void)!write(STDERR_FILENO, notice.data(), static_cast<std::size_t>(notice_size));
    (void)raise(signal);  // SA_RESETHAND: now it ends the program
}

bool is_handled_by(int signal, void (*handler)(int)) {
    struct sigaction now {};
    return sigaction(signal, nullptr, &now) == 0 && now.sa_handler == handler;
}

}  // namespace

InterruptionNotice::InterruptionNotice(const std::filesystem::path& unfinished) {
    const std::string text =
        fmt::format("{}interrupted: what was done so far stays in {}, which the next run there removes\n",
                    isatty(STDERR_FILENO) != 0 ? "\n" : "", unfinished.string());
    const std::size_t size = std::min(text.size(), notice.size());
    std::copy_n(text.begin(), size, notice.begin());
    notice_size = static_cast<std::sig_atomic_t>(size);
    struct sigaction action {};
    action.sa_handler = tell_and_end;
    action.sa_flags = static_cast<int>(SA_RESETHAND);
    for (const int signal : {SIGINT, SIGTERM})
        if (is_handled_by(signal, SIG_DFL)) sigaction(signal, &action, nullptr);
}

InterruptionNotice::~InterruptionNotice() {
    notice_size = 0;
    for (const int signal : {SIGINT, SIGTERM})
        if (is_handled_by(signal, tell_and_end)) std::signal(signal, SIG_DFL);
}

}  // namespace app
