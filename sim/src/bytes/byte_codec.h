#pragma once
#include <Eigen/Geometry>
#include <array>
#include <bit>
#include <cstdint>
#include <cstring>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

namespace sim {

/// A message that cannot be one of ours: what was found, what was expected.
struct DecodeError : std::runtime_error {
    using std::runtime_error::runtime_error;
};

static_assert(std::endian::native == std::endian::little, "numbers are copied as they lie in memory");

/// Appends little-endian numbers. Doubles travel as their 64 bits.
class ByteWriter {
public:
    template <typename Number>
    void number(Number value) {
        static_assert(std::is_arithmetic_v<Number>);
        const std::size_t at = bytes_.size();
        bytes_.resize(at + sizeof value);
        std::memcpy(bytes_.data() + at, &value, sizeof value);
    }
    template <typename Derived>
    void matrix(const Eigen::MatrixBase<Derived>& m) {  ///< column by column
        for (Eigen::Index i = 0; i < m.size(); ++i) number<double>(m(i % m.rows(), i / m.rows()));
    }
    void text(const std::string& s) {
        number(static_cast<std::uint32_t>(s.size()));
        bytes_.insert(bytes_.end(), s.begin(), s.end());
    }
    void append(std::span<const std::uint8_t> more) { bytes_.insert(bytes_.end(), more.begin(), more.end()); }
    void count(std::size_t n) { number(static_cast<std::uint32_t>(n)); }
    [[nodiscard]] std::vector<std::uint8_t>& bytes() { return bytes_; }

private:
    std::vector<std::uint8_t> bytes_;
};

/// Reads what ByteWriter wrote; throws DecodeError rather than read beyond the end.
class ByteReader {
public:
    explicit ByteReader(std::span<const std::uint8_t> bytes) : bytes_(bytes) {}

    template <typename Number>
    [[nodiscard]] Number number() {
        Number value;
        std::memcpy(&value, take(sizeof value).data(), sizeof value);
        return value;
    }
    template <std::size_t N>
    [[nodiscard]] std::array<std::uint8_t, N> bytes() {
        std::array<std::uint8_t, N> bytes;
        std::memcpy(bytes.data(), take(N).data(), N);
        return bytes;
    }
    template <typename Matrix>
    void matrix(Matrix&& m) {
        for (Eigen::Index i = 0; i < m.size(); ++i) m(i % m.rows(), i / m.rows()) = number<double>();
    }
    [[nodiscard]] std::string text(std::uint32_t longest) {
        const std::uint32_t n = number<std::uint32_t>();
        if (n > longest)
            throw DecodeError("text of " + std::to_string(n) + " bytes, expected at most " +
                              std::to_string(longest));
        const std::span<const std::uint8_t> s = take(n);
        return {s.begin(), s.end()};
    }
    /// A count of records that are at least `record_bytes` each, so that no count makes us allocate more than
    /// the message could hold.
    [[nodiscard]] std::uint32_t count(std::size_t record_bytes) {
        const std::uint32_t n = number<std::uint32_t>();
        if (n > bytes_.size() / record_bytes) {
            throw DecodeError("a count of " + std::to_string(n) + " with " + std::to_string(bytes_.size()) +
                              " bytes left");
        }
        return n;
    }
    [[nodiscard]] bool flag() {
        const std::uint8_t value = number<std::uint8_t>();
        if (value > 1) throw DecodeError("a flag of " + std::to_string(value) + ", expected 0 or 1");
        return value == 1;
    }
    [[nodiscard]] std::size_t left() const noexcept { return bytes_.size(); }
    [[nodiscard]] std::span<const std::uint8_t> rest() const noexcept { return bytes_; }
    void expect_end() const {
        if (!bytes_.empty()) throw DecodeError(std::to_string(bytes_.size()) + " bytes too many");
    }
    /// The next n bytes.
    [[nodiscard]] std::span<const std::uint8_t> take(std::size_t n) {
        if (n > bytes_.size())
            throw DecodeError("message ends " + std::to_string(n - bytes_.size()) + " bytes too early");
        const std::span<const std::uint8_t> taken = bytes_.first(n);
        bytes_ = bytes_.subspan(n);
        return taken;
    }

private:
    std::span<const std::uint8_t> bytes_;
};

}  // namespace sim
