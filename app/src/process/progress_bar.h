#pragma once

namespace app {

/// A progress bar on standard error; silent unless enabled and standard error is a terminal.
class ProgressBar {
public:
    explicit ProgressBar(bool enabled);
    void show(double share);
    void clear();

private:
    bool enabled_;
    int drawn_ = -1;
};

}  // namespace app
