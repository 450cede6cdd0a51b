#include "process/standard_streams.h"

#include <fcntl.h>
#include <tracking/input.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <string>

namespace app {

void hold_closed_streams() {
    for (const int stream : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO})
        if (fcntl(stream, F_GETFD) < 0 && errno == EBADF)  // open() takes the lowest free number: this one
            (void)!open("/dev/null", stream == STDIN_FILENO ? O_WRONLY : O_RDONLY);
}

void tell(std::string_view line) noexcept {
    std::string text(line);
    std::ranges::replace(text, '\n', ' ');
    tell_as_is(tracking::printable(text) + '\n');
}

void tell_as_is(std::string_view text) noexcept {
    while (!text.empty()) {
        const ssize_t wrote = ::write(STDERR_FILENO, text.data(), text.size());
        if (wrote < 0 && errno == EINTR) continue;
        if (wrote <= 0) return;
        text.remove_prefix(static_cast<std::size_t>(wrote));
    }
}

}  // namespace app
