#include "simulate/growing_table.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <stdexcept>

#include "files/bad_input.h"

namespace app {

namespace fs = std::filesystem;

GrowingTable::GrowingTable(const fs::path& file, const std::string& header)
    : file_(file), out_(open_file(file, O_WRONLY | O_CREAT | O_TRUNC)), rows_(header) {
    check(bool(out_));
}

GrowingTable::GrowingTable(const fs::path& file, std::uint64_t bytes) : file_(file), bytes_(bytes) {
    std::error_code none;
    const std::uintmax_t there = fs::is_regular_file(file, none) ? fs::file_size(file, none) : 0;
    if (there < bytes || none)
        throw BadInput(
            fmt::format("{}: error: found {} bytes, expected the {} of when the checkpoint was saved",
                        file.string(), there, bytes));
    out_ = open_file(file, O_WRONLY);
    check(bool(out_));
    check(::ftruncate(out_.get(), static_cast<off_t>(bytes)) == 0);
    check(::lseek(out_.get(), 0, SEEK_END) >= 0);
}

void GrowingTable::add(const std::string& rows) {
    constexpr std::size_t kBlock = 65536;
    rows_ += rows;
    if (rows_.size() >= kBlock) write();
}

std::uint64_t GrowingTable::save() {
    write();
    check(app::save(out_));
    return bytes_;
}

void GrowingTable::finish() {
    write();
    check(out_.close());
}

void GrowingTable::write() {
    check(out_.write(rows_));
    bytes_ += rows_.size();
    rows_.clear();
}

void GrowingTable::check(bool done) const {
    if (!done)
        throw std::runtime_error("error: " + cannot("write " + file_.string()) +
                                 "; free some space or choose another --out");
}

}  // namespace app
