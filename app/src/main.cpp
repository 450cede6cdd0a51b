#include <csignal>

#include "command_line.h"

int main(int argc, char** argv) {
    // A file that may not grow and a reader that went away are errors to report, not reasons to die.
    std::signal(SIGXFSZ, SIG_IGN);
    std::signal(SIGPIPE, SIG_IGN);
    return app::run_command_line(argc, argv);
}
