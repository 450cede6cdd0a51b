#pragma once
#include <algorithm>
#include <charconv>
#include <iterator>
#include <string_view>

#include "bytes/byte_codec.h"
#include "bytes/fields.h"

namespace sim {

// The archives that fields() is called with, see fields.h.

[[nodiscard]] std::size_t bytes_of(const IsMatrix auto& m) {
    return sizeof m.coeff(0, 0) * static_cast<std::size_t>(m.size());
}

/// Adds up the bytes of fields whose lists and texts are empty; their values do not matter.
class LeastBytes {
public:
    static constexpr bool kReads = false, kWrites = false;
    template <typename... T>
    void operator()(const char*, const T&... values) {
        (add(values), ...);
    }
    void check(bool, const char*) {}
    template <typename T>
    void add(const T& value) {
        if constexpr (requires { T::kLeastBytes; })
            bytes_ += T::kLeastBytes;
        else if constexpr (std::is_arithmetic_v<T>)
            bytes_ += sizeof value;
        else if constexpr (kIsList<T>)
            bytes_ += sizeof(std::uint32_t);
        else if constexpr (IsMatrix<T>)
            bytes_ += bytes_of(value);
        else
            fields(*this, value);
    }
    template <typename T>
    void add(const Within<T>& ranged) {
        add(ranged.value);
    }
    template <std::size_t N>
    void add(const std::array<std::uint8_t, N>&) {
        bytes_ += N;
    }
    [[nodiscard]] std::size_t bytes() const { return bytes_; }

private:
    std::size_t bytes_ = 0;
};

class FieldWriter {
public:
    static constexpr bool kReads = false, kWrites = true;
    explicit FieldWriter(ByteWriter& out) : out_(out) {}
    template <typename... T>
    void operator()(const char*, const T&... values) {
        (put(values), ...);
    }
    void check(bool, const char*) {}
    template <typename T>
    void put(const T& value) {
        if constexpr (std::is_arithmetic_v<T>) {
            out_.number(value);
        } else if constexpr (kIsList<T>) {
            out_.count(value.size());
            for (const auto& element : value) put(element);
        } else if constexpr (IsMatrix<T>) {
            const auto& whole = value.eval();  // in one piece, also of a block
            out_.append({reinterpret_cast<const std::uint8_t*>(whole.data()), bytes_of(whole)});
        } else if constexpr (!std::is_empty_v<T>) {
            fields(*this, value);
        }
    }
    template <std::size_t N>
    void put(const std::array<std::uint8_t, N>& bytes) {
        out_.append(bytes);
    }
    template <typename T>
    void put(const Within<T>& ranged) {
        put(ranged.value);
    }
    template <typename T>
    void put(const Choice<T>& choice) {
        out_.number(static_cast<std::uint8_t>(choice.value));
    }
    template <typename... Bool>
    void put(const Bits<Bool...>& bits) {
        unsigned all = 0, bit = 1;
        std::apply([&](auto... flag) { ((all |= flag ? bit : 0, bit <<= 1), ...); }, bits.flags);
        out_.number(static_cast<std::uint8_t>(all));
    }
    template <typename T>
    void put(const Count<T>& count) {
        out_.count(count.value);
    }
    template <typename T>
    void put(const Text<T>& text) {
        out_.text(text.value);
    }
    template <typename T>
    void put(const Words<T>& words) {
        out_.text(words.value.substr(0, words.longest));
    }
    template <typename T, typename Fields>
    void put(const Each<T, Fields>& each) {
        out_.count(each.list.size());
        for (auto& element : each.list) each.fields(*this, element);
    }
    template <typename T>
    void put(const Packed<T>& packed) {
        write(out_, packed.list);
    }

private:
    ByteWriter& out_;
};

class FieldReader {
public:
    static constexpr bool kReads = true, kWrites = false;
    /// Which of the names that a declaration gives.
    struct Name {
        const char* names = "";
        int place = 0;
    };
    explicit FieldReader(ByteReader& in) : in_(in) {}
    template <typename... T>
    void operator()(const char* names, T&&... values) {
        int place = 0;
        (get({names, place++}, values), ...);
    }
    /// Throws DecodeError unless it holds.
    void check(bool holds, const char* what) {
        if (!holds) throw DecodeError(what);
    }
    template <typename T>
    void get(Name field, T& value) {
        if constexpr (std::is_same_v<T, bool>) {
            value = in_.flag();
        } else if constexpr (std::is_arithmetic_v<T>) {
            value = in_.number<T>();
        } else if constexpr (kIsList<T>) {
            value.resize(count([](auto& archive, auto& element) { archive.add(element); }, value));
            for (auto& element : value) get(field, element);
        } else if constexpr (IsMatrix<T>) {
            if constexpr (std::derived_from<T, Eigen::PlainObjectBase<T>>) {
                std::ranges::copy(in_.take(bytes_of(value)), reinterpret_cast<std::uint8_t*>(value.data()));
            } else {
                typename T::PlainObject whole;
                get(field, whole);
                value = whole;
            }
        } else if constexpr (!std::is_empty_v<T>) {
            fields(*this, value);
        }
    }
    template <std::size_t N>
    void get(Name, std::array<std::uint8_t, N>& bytes) {
        bytes = in_.bytes<N>();
    }
    template <typename T>
    void get(Name field, Within<T>& ranged) {
        get(field, ranged.value);
        expect_within(field, ranged.value, ranged);
    }
    template <typename T>
    void get(Name field, Choice<T>& choice) {
        const auto value = in_.number<std::uint8_t>();
        const auto last = static_cast<std::uint8_t>(choice.last);
        if (value > last) refuse(field, value, 0, last);
        choice.value = static_cast<T>(value);
    }
    template <typename... Bool>
    void get(Name field, Bits<Bool...>& bits) {
        constexpr unsigned kEnd = 1U << sizeof...(Bool);
        unsigned all = in_.number<std::uint8_t>();
        if (all >= kEnd) refuse(field, all, 0, kEnd - 1);
        std::apply([&](auto&... flag) { ((flag = all & 1, all >>= 1), ...); }, bits.flags);
    }
    template <typename T>
    void get(Name, Count<T>& count) {
        count.value = in_.number<std::uint32_t>();
    }
    template <typename T>
    void get(Name, Text<T>& text) {
        text.value = in_.text(text.longest);
    }
    template <typename T>
    void get(Name, Words<T>& words) {
        words.value = in_.text(words.longest);
        for (char& c : words.value)
            if (c < ' ' || c > '~') c = '?';
    }
    template <typename T, typename Fields>
    void get(Name, Each<T, Fields>& each) {
        each.list.resize(count(each.fields, each.list));
        for (auto& element : each.list) each.fields(*this, element);
    }
    template <typename T>
    void get(Name, Packed<T>& packed) {
        read(in_, packed.list);
    }

private:
    /// Of elements of those fields.
    template <typename Fields, typename Element>
    std::uint32_t count(const Fields& of_element, const std::vector<Element>&) {
        static const std::size_t least = [&] {
            LeastBytes bytes;
            Element element{};
            of_element(bytes, element);
            return bytes.bytes();
        }();
        return in_.count(least);
    }
    template <typename T, typename Range>
    void expect_within(Name field, const T& found, const Range& range) {
        if constexpr (std::is_arithmetic_v<T>) {
            if (!(found >= range.low && found <= range.high)) refuse(field, found, range.low, range.high);
        } else {
            for (const auto& each : found) expect_within(field, each, range);
        }
    }

    static std::string shown(double x) {
        char digits[32];
        return {digits, std::to_chars(digits, std::end(digits), x).ptr};
    }
    [[noreturn]] static void refuse(Name field, double found, double low, double high) {
        std::string_view name = field.names;
        while (field.place-- > 0) name.remove_prefix(name.find(' ') + 1);
        const bool any = high == std::numeric_limits<double>::max();
        throw DecodeError(std::string(name.substr(0, name.find(' '))) + ": found " + shown(found) +
                          ", expected " + (any ? "a finite number" : shown(low) + " to " + shown(high)));
    }

    ByteReader& in_;
};

template <typename T>
void write_fields(ByteWriter& out, const T& value) {
    FieldWriter(out).put(value);
}
template <typename T>
void read_fields(ByteReader& in, T& value) {
    FieldReader(in).get({}, value);
}

}  // namespace sim
