#include "sensors/row_decoder.h"

#include <fmt/format.h>

#include <algorithm>

namespace app {
namespace {

constexpr std::size_t kLongestHead = 2000;
constexpr const char* kDefaultHeader = "t,stick,px,py,pz,qw,qx,qy,qz";

bool belongs_to_head(std::string_view line) {
    return line.starts_with('#') || line.starts_with("t,");
}

tracking::TraceRows new_rows(const std::string& name) {
    return {name, tracking::RowOrder::live};
}

}  // namespace

RowDecoder::RowDecoder(std::string name, Take take, Refuse refuse)
    : name_(std::move(name)), take_(std::move(take)), refuse_(std::move(refuse)), rows_(new_rows(name_)) {}

void RowDecoder::piece(std::string_view bytes) {
    for (std::size_t end = bytes.find('\n'); end != std::string_view::npos; end = bytes.find('\n')) {
        grow(bytes.substr(0, end));
        this->end();
        bytes.remove_prefix(end + 1);
    }
    grow(bytes);
}

void RowDecoder::grow(std::string_view bytes) {
    if (skipping_) return;
    if (partial_.size() + bytes.size() <= kLongestLine) {
        partial_.append(bytes);
        return;
    }
    refuse_(
        fmt::format("{}: error: found a line of more than {} bytes, expected a row", name_, kLongestLine));
    skip_line();
}

void RowDecoder::end() {
    if (!skipping_) line(partial_);
    skipping_ = false;
    partial_.clear();
}

void RowDecoder::message(std::string_view text) {
    piece(text);
    end();
}

void RowDecoder::line(std::string_view text) {
    if (text.ends_with('\r')) text.remove_suffix(1);
    if (text.find_first_not_of(" \t") == std::string_view::npos) return;
    try {
        take_line(text);
    } catch (const tracking::TraceError& wrong) {
        refuse_(wrong.what());
    }
}

void RowDecoder::take_line(std::string_view text) {
    if (belongs_to_head(text)) {
        if (rows_.headed() || !given_head_) {
            rows_ = new_rows(name_);
            head_.clear();
        }
        given_head_ = true;
        (void)rows_.take(text);
        if (head_.size() + text.size() < kLongestHead) head_.append(text).append("\n");
        return;
    }
    if (!rows_.headed() && !given_head_) (void)rows_.take(kDefaultHeader);
    const bool short_row = !given_head_ && std::count(text.begin(), text.end(), ',') == 4;
    if (const auto row = rows_.take(short_row ? std::string(text) + ",,,," : std::string(text))) take_(*row);
}

}  // namespace app
