#pragma once
#include <cstddef>
#include <string>
#include <string_view>

#include "tracking/input.h"

namespace tracking {

[[nodiscard]] inline bool is_blank(char c) {
    return c == ' ' || c == '\t';
}

/// A field of a line: its text without surrounding blanks, and where it starts in the line (0-based byte).
struct Field {
    std::string_view text;
    std::size_t offset = 0;
};

/// One line of a text file, without its line end, that knows its place for messages.
class Line {
public:
    Line(const std::string& file, std::size_t number, std::string_view text)
        : file_(&file), number_(number), text_(text) {}

    [[nodiscard]] std::string_view text() const { return text_; }
    [[nodiscard]] std::size_t number() const { return number_; }

    /// Throws TraceError: FILE:LINE:COLUMN: error: found `found`, expected `expected`; `remedy`.
    /// The column counts characters (UTF-8) from 1.
    [[noreturn]] void fail(std::size_t offset, const std::string& found, const std::string& expected,
                           const std::string& remedy) const;

    /// Throws for control characters, DEL and what is not UTF-8; `remedy` ends the message.
    void require_text(const char* remedy = "save the trace as plain CSV text in UTF-8") const;

    /// The field that starts at byte `offset` and ends at the next comma; `offset` moves behind that comma,
    /// or to npos at the line's end.
    [[nodiscard]] Field next_field(std::size_t& offset) const;

    /// The finite number in a field with |number| <= limit; `what` names it in messages.
    [[nodiscard]] double number_in(const Field& field, const char* what, double limit,
                                   const char* limit_text) const;

private:
    const std::string* file_;
    std::size_t number_;
    std::string_view text_;
};

/// Splits a text into lines at LF or CRLF.
class LineReader {
public:
    LineReader(std::string_view text, const std::string& file) : file_(&file), rest_(text) {}

    [[nodiscard]] bool at_end() const { return rest_.empty(); }
    [[nodiscard]] Line next();
    /// True if nothing but line ends and blanks is left.
    [[nodiscard]] bool only_blank_left() const;
    [[nodiscard]] std::size_t lines_read() const { return number_; }

private:
    const std::string* file_;
    std::string_view rest_;
    std::size_t number_ = 0;
};

/// `text` in quotes, shortened, without control characters: fit for a one-line message.
[[nodiscard]] std::string in_quotes(std::string_view text);

/// `text` without blanks and tabs at its ends.
[[nodiscard]] std::string_view trimmed(std::string_view text);

/// Byte offset of the first control character or byte that is not UTF-8; npos if there is none.
[[nodiscard]] std::size_t first_unprintable(std::string_view text);

}  // namespace tracking
