#pragma once
#include <filesystem>

namespace app {

/// While this lives, a SIGINT or SIGTERM that ends the program at once first says on standard error what stays
/// in the folder of an unfinished run. Where signals are handled or ignored already it does nothing. One at a
/// time.
class InterruptionNotice {
public:
    explicit InterruptionNotice(const std::filesystem::path& unfinished);
    ~InterruptionNotice();
    InterruptionNotice(const InterruptionNotice&) = delete;
    InterruptionNotice& operator=(const InterruptionNotice&) = delete;
};

}  // namespace app
