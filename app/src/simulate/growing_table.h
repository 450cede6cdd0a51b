#pragma once
#include <cstdint>
#include <filesystem>
#include <string>

#include "files/file_descriptor.h"

namespace app {

/// A CSV file that grows while a simulation runs. Throws std::runtime_error when it cannot be written.
class GrowingTable {
public:
    GrowingTable(const std::filesystem::path& file, const std::string& header);
    /// Goes on with a file whose first `bytes` are what was saved; what lies behind them is cut off. Throws BadInput if it
    /// has less.
    GrowingTable(const std::filesystem::path& file, std::uint64_t bytes);

    void add(const std::string& rows);
    /// Has all rows on the disk; returns the bytes that they take.
    std::uint64_t save();
    void finish();

private:
    void write();
    void check(bool done) const;

    std::filesystem::path file_;
    FileDescriptor out_;
    std::string rows_;         // not yet written
    std::uint64_t bytes_ = 0;  // written
};

}  // namespace app
