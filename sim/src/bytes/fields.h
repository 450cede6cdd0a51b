#pragma once
#include <array>
#include <concepts>
#include <cstdint>
#include <limits>
#include <string>
#include <tuple>
#include <vector>

namespace sim {

// What travels is declared once, by a function that gives an archive all fields in order: their names,
// separated by blanks, and the fields themselves, those with rules in wrappers:
//
//   void fields(auto& archive, Is<Reach> auto& r) {
//       archive("low high speed", finite(r.low), finite(r.high), Within{r.speed, 0, 1e9});
//   }
//
// write_fields makes bytes of them. read_fields reads these, and throws DecodeError where a rule is broken.
//
// A number travels as it lies in memory, a bool as u8 of 0 or 1, a matrix column by column, a vector as u32
// count and its elements, anything else as its own fields; an empty struct has none. A count is at most what
// the bytes that are left can hold.

template <typename T, typename Of>
concept Is = std::same_as<std::remove_const_t<T>, Of>;

/// Each number of it is at least `low` and at most `high`.
template <typename T>
struct Within {
    T& value;
    double low, high;
};
template <typename T>
[[nodiscard]] Within<T> finite(T& value) {
    return {value, std::numeric_limits<double>::lowest(), std::numeric_limits<double>::max()};
}
/// An enum, up to `last`, as u8.
template <typename T>
struct Choice {
    T& value;
    std::remove_const_t<T> last;
    static constexpr std::size_t kLeastBytes = 1;
};
/// Flags in one u8, lowest bit first; their names are separated by commas.
template <typename... Bool>
struct Bits {
    std::tuple<Bool&...> flags;
    explicit Bits(Bool&... each) : flags(each...) {}
    static constexpr std::size_t kLeastBytes = 1;
};
/// A std::size_t as u32.
template <typename T>
struct Count {
    T& value;
    static constexpr std::size_t kLeastBytes = 4;
};
template <typename T>
struct Text {
    T& value;
    std::uint32_t longest;  ///< [bytes]
    static constexpr std::size_t kLeastBytes = 4;
};
/// What a peer says of itself, which goes into reports and onto terminals. Written it is cut to `longest`;
/// read it is printable ASCII, with a question mark for any other byte.
template <typename T>
struct Words {
    T& value;
    std::uint32_t longest;
    static constexpr std::size_t kLeastBytes = 4;
};
/// A list of elements whose fields `fields(archive, element)` gives.
template <typename T, typename Fields>
struct Each {
    T& list;
    Fields fields;
    static constexpr std::size_t kLeastBytes = 4;
};
/// A list, with its count, that write(ByteWriter&, list) and read(ByteReader&, list) code by hand.
template <typename T>
struct Packed {
    T& list;
    static constexpr std::size_t kLeastBytes = 4;
};

template <typename T>
constexpr bool kIsList = false;
template <typename T>
constexpr bool kIsList<std::vector<T>> = true;
template <typename T>
concept IsMatrix = requires(const T& m) {
    m.coeff(0, 0);
};

}  // namespace sim
