#pragma once

namespace app {

/// Kills a process group when this object ends, or when this program does, however that happens: a small
/// child of its own waits at a pipe whose other end only this program has. Needs no handler of signals and
/// may live on any thread.
class GroupKeeper {
public:
    /// `group`: the process id of its leader, which must not be collected before this object ends. Throws
    /// std::runtime_error, one line.
    explicit GroupKeeper(int group);
    ~GroupKeeper();
    GroupKeeper(const GroupKeeper&) = delete;
    GroupKeeper& operator=(const GroupKeeper&) = delete;

private:
    int pipe_ = -1;
    int keeper_ = -1;
};

}  // namespace app
