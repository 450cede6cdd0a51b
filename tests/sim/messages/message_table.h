#pragma once
#include <cxxabi.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <map>
#include <sstream>
#include <string>
#include <typeinfo>

#include "bytes/archives.h"
#include "messages/worker_messages.h"
#include "messages/world_scene_codec.h"

namespace sim_test {

using sim::fields;  // also of Eigen's types

/// As C++ names it, without the namespace.
template <typename T>
std::string type_name() {
    int status = 0;
    char* const full = abi::__cxa_demangle(typeid(T).name(), nullptr, nullptr, &status);
    std::string name = full;
    std::free(full);
    name = name.substr(0, name.find('<'));
    return name.substr(name.rfind(':') + 1);
}

/// An archive that records what fields there are: "u32 to, number; list of OfferedBody bodies", and the
/// structs among them.
class FieldTable {
public:
    static constexpr bool kReads = false, kWrites = false;
    /// Of each struct the rest of a row: fields and bytes.
    using Parts = std::map<std::string, std::string>;
    explicit FieldTable(Parts& parts) : parts_(parts) {}

    template <typename... T>
    void operator()(const char* names, T&&... values) {
        std::istringstream words(names);
        (add(words, type(values)), ...);
        std::string more;
        EXPECT_FALSE(words >> more) << "more names than fields: " << names;
    }
    void check(bool, const char*) {}
    [[nodiscard]] const std::string& text() const { return text_; }

    /// "fields | bytes", the latter with empty lists.
    template <typename T>
    static std::string row(T& value, Parts& parts) {
        FieldTable table(parts);
        sim::LeastBytes least;
        if constexpr (!std::is_empty_v<T>) fields(table, value), fields(least, value);
        return table.text() + " | " + std::to_string(least.bytes());
    }

private:
    void add(std::istringstream& names, const std::string& type) {
        std::string name;
        EXPECT_TRUE(names >> name) << "a field without a name";
        for (std::size_t at = 0; (at = name.find(',', at)) != name.npos; at += 2) name.insert(at + 1, " ");
        text_ += type == last_ ? ", " : (text_.empty() ? "" : "; ") + type + " ";
        text_ += "`" + name + "`";
        last_ = type;
    }
    template <typename T>
    std::string type(T& value) {
        if constexpr (std::is_same_v<T, bool>) {
            return "flag";
        } else if constexpr (std::is_arithmetic_v<T>) {
            const char* const kind = std::is_floating_point_v<T> ? "f" : std::is_signed_v<T> ? "i" : "u";
            return kind + std::to_string(8 * sizeof(T));
        } else if constexpr (sim::kIsList<T>) {
            typename T::value_type element{};
            return "list of " + type(element);
        } else if constexpr (sim::IsMatrix<T>) {
            typename T::Scalar number{};
            return (value.size() > 0 ? std::to_string(value.size()) : "m") + " " + type(number);
        } else {
            const std::string name = type_name<T>();
            if (!parts_.contains(name)) parts_[name] = row(value, parts_);
            return name;
        }
    }
    template <std::size_t N>
    std::string type(std::array<std::uint8_t, N>&) {
        return std::to_string(N) + " bytes";
    }
    template <typename T>
    std::string type(sim::Within<T>& ranged) {
        return type(ranged.value);
    }
    template <typename T>
    std::string type(sim::Choice<T>&) {
        return "u8";
    }
    template <typename... Bool>
    std::string type(sim::Bits<Bool...>& bits) {
        std::apply([](auto&... flag) { ((flag = true), ...); },
                   bits.flags);  // so that all that depends on them is told
        return "bits";
    }
    template <typename T>
    std::string type(sim::Count<T>&) {
        return "u32";
    }
    template <typename T>
    std::string type(sim::Text<T>&) {
        return "text";
    }
    template <typename T>
    std::string type(sim::Words<T>&) {
        return "text";
    }
    template <typename T, typename Fields>
    std::string type(sim::Each<T, Fields>& each) {
        FieldTable table(parts_);
        typename T::value_type element{};
        each.fields(table, element);
        return "list of (" + table.text() + ")";
    }
    template <typename T>
    std::string type(sim::Packed<T>&) {
        if constexpr (sim::kIsList<T>)
            return "list of " + type_name<typename T::value_type>();
        else
            return "list of Update";
    }

    Parts& parts_;
    std::string text_, last_;
};

}  // namespace sim_test
