#pragma once
#include <Eigen/Core>
#include <algorithm>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

namespace app {

// The keys of a file format are declared once, by functions such as
//
//     void stick_keys(Fields& keys, StickDefinition& stick) {
//         keys.number("length", stick.length_m, {0.05, 2, "m"}, "Length of the drawn stick, hand to tip.");
//     }
//
// Run with a reader (files/toml_reader.h) they take the values from a file and check them; a value that the
// file leaves out stays as it was, which is the default. Run with a describer (files/format_description.h)
// they give the JSON Schema and the reference page. So such a function names all of its keys, whatever their
// values are.

/// Closed limits of a number, and its unit.
struct Range {
    double low = 0, high = 0;
    const char* unit = "";
};

enum class Need {
    no,
    given,  ///< in the table or in the defaults below it
    here,   ///< in the table itself, and not in defaults; a text is not empty
    own,    ///< likewise, or in the table of an included file that it changes
};

/// Whether the defaults do not give a key.
[[nodiscard]] inline bool is_own(Need need) {
    return need == Need::here || need == Need::own;
}

/// What else is to be said of a key.
struct Note {
    Need need = Need::no;
    const char* otherwise = "";  ///< the default in words, where it is no fixed value
    const char* example = "";    ///< as JSON; needed where there is no default
};

/// A word of a file and what it stands for.
template <class Value>
struct Word {
    const char* name;
    Value value;
};

enum class KeyType { text, choice, flag, number, fraction, whole, texts, text_or_texts, columns };

/// What a value of a type is called in a message, in the reference page and, as formats of fmt, in a JSON Schema:
/// {0} and {1} are the limits of numbers, {2} is the schema of a text.
struct KeyTypeText {
    const char *expected, *page, *schema;
};
[[nodiscard]] const KeyTypeText& text_of(KeyType type);

/// One key as it is declared.
struct Key {
    std::string_view name;
    KeyType type;
    std::string_view meaning;
    Note note;
    Range range = {};
    int size = 0;                           ///< of an array of numbers; 0: one number
    std::vector<std::string_view> words{};  ///< of a choice
};
/// Empty: the key has no default.
using KeyValue = std::variant<std::monostate, std::string, bool, std::vector<double>,
                              std::vector<std::string>, std::map<std::string, std::string>>;

/// What stands below the tables of a kind: nothing, the file's table [defaults], or [defaults.KIND].
enum class Below { nothing, defaults, defaults_of_kind };

class Fields;

/// What a kind of table is called in the reference, and what it is.
struct TableText {
    const char* name;
    const char* meaning;
    Below below = Below::nothing;
    const char* example = "";  ///< of a short one
};
/// A kind of table with the function that declares its keys.
template <class T>
struct TableKind : TableText {
    void (*keys)(Fields&, T&);
};

enum class TableForm {
    merged,    ///< one table, its keys merged over all layers; without any its defaults hold
    optional,  ///< likewise, but it may be missing
    array,     ///< an array of tables; those of a kind with defaults come from all layers
    named,     ///< a table of tables with free names
    partial,   ///< keys of a kind for the tables of that kind; checked where they are used
};
struct TableKey {
    std::string_view name;
    TableForm form;
    const TableText* table;
    std::string_view meaning = {};  ///< of the array or the named tables
};

/// A free parameter of a table and its limits.
struct ParameterRange {
    std::string name;
    double low, high;
};

class Fields {
public:
    using Texts = std::vector<std::string>;
    using Parameters = std::vector<std::pair<std::string, double>>;
    virtual ~Fields() = default;

    // Values may be std::optional: empty, unless the file has the key.

    void text(std::string_view key, auto& value, std::string_view meaning, Note note = {}) {
        one({key, KeyType::text, meaning, note}, value);
    }
    void texts(std::string_view key, Texts& value, std::string_view meaning, Note note = {}) {
        one({key, KeyType::texts, meaning, note}, value);
    }
    /// A text, or an array of them.
    void text_or_texts(std::string_view key, Texts& value, std::string_view meaning, Note note = {}) {
        one({key, KeyType::text_or_texts, meaning, note}, value);
    }
    /// Texts by name, or by stick and name as STICK.NAME.
    void columns(std::string_view key, std::map<std::string, std::string>& value, std::string_view meaning,
                 Note note = {}) {
        one({key, KeyType::columns, meaning, note}, value);
    }
    void flag(std::string_view key, auto& value, std::string_view meaning, Note note = {}) {
        one({key, KeyType::flag, meaning, note}, value);
    }

    void number(std::string_view key, auto& value, Range range, std::string_view meaning, Note note = {}) {
        one_number({key, KeyType::number, meaning, note, range}, value);
    }
    /// A number, or a text with a fraction: "1/60".
    void fraction(std::string_view key, auto& value, Range range, std::string_view meaning, Note note = {}) {
        one_number({key, KeyType::fraction, meaning, note, range}, value);
    }
    void integer(std::string_view key, auto& value, Range range, std::string_view meaning, Note note = {}) {
        one_number({key, KeyType::whole, meaning, note, range}, value);
    }
    template <class Vector>
    void vector(std::string_view key, Vector& value, Range range, std::string_view meaning, Note note = {}) {
        std::vector<double> wide(value.begin(), value.end());
        one({key, KeyType::number, meaning, note, range, int(value.size())}, wide);
        std::copy(wide.begin(), wide.end(), value.begin());
    }
    template <class Vector>
    void vector(std::string_view key, std::optional<Vector>& value, Range range, std::string_view meaning,
                Note note = {}) {
        std::optional<std::vector<double>> wide;
        one({key, KeyType::number, meaning, note, range, int(Vector::SizeAtCompileTime)}, wide);
        if (wide) std::copy(wide->begin(), wide->end(), value.emplace().begin());
    }
    /// One of the words.
    template <class Value>
    void choice(std::string_view key, Value& value,
                const std::vector<Word<std::type_identity_t<Value>>>& words, std::string_view meaning,
                Note note = {}) {
        Key declared{key, KeyType::choice, meaning, note};
        KeyValue word;
        for (const auto& known : words) {
            declared.words.emplace_back(known.name);
            if (known.value == value && word.index() == 0) word = std::string(known.name);
        }
        if (!read(declared, word)) return;
        for (const auto& known : words)
            if (std::get<std::string>(word) == known.name) value = known.value;
    }
    /// What parameters belong to: the value of a text key, or `otherwise` where it is not given.
    struct Owner {
        std::string_view key;
        std::string otherwise;
    };
    /// Numbers under names of their own, besides the keys declared so far: those of `known`, which a reader
    /// must have. Those that a file gives for another owner, which a file above it replaced, do not count. The last
    /// keys of a table.
    virtual void parameters(Parameters& values, const std::vector<ParameterRange>& known, Range any,
                            std::string_view meaning, const Owner& owner) = 0;

    // Tables. `take` is called with what was read and its place for complaints, never by a describer.

    template <class T>
    using Take = std::type_identity_t<std::function<void(Fields& at, T&)>>;

    template <class T>
    void table(
        std::string_view key, T& value, const TableKind<T>& kind, const Take<T>& take = [](Fields&, T&) {}) {
        enter({key, TableForm::merged, &kind},
              {[&](Fields& inner, const std::string&) { kind.keys(inner, value); },
               [&](Fields& at) { take(at, value); }});
    }
    template <class T>
    void table(
        std::string_view key, std::optional<T>& value, const TableKind<T>& kind,
        const Take<T>& take = [](Fields&, T&) {}) {
        enter({key, TableForm::optional, &kind},
              {[&](Fields& inner, const std::string&) { kind.keys(inner, value.emplace()); },
               [&](Fields& at) { take(at, *value); }});
    }
    /// An array of tables; each begins as a copy of `first` and is taken in turn.
    template <class T>
    void tables(std::string_view key, const T& first, const TableKind<T>& kind, std::string_view meaning,
                const Take<T>& take) {
        std::optional<T> value;
        enter({key, TableForm::array, &kind, meaning},
              {[&](Fields& inner, const std::string&) { kind.keys(inner, value.emplace(first)); },
               [&](Fields& at) { take(at, *value); }});
    }
    template <class T>
    void named_tables(std::string_view key, std::map<std::string, T>& values, const TableKind<T>& kind,
                      std::string_view meaning) {
        enter({key, TableForm::named, &kind, meaning},
              {[&](Fields& inner, const std::string& name) { kind.keys(inner, values[name]); }, {}});
    }
    /// A table with keys of a kind, which stand below its tables.
    template <class T>
    void partial_table(std::string_view key, const TableKind<T>& kind) {
        enter({key, TableForm::partial, &kind}, {[&](Fields& inner, const std::string&) {
                                                     T described;
                                                     kind.keys(inner, described);
                                                 },
                                                 {}});
    }

    /// A reader throws BadInput at the key's place unless `holds`; without a key, at the table's.
    virtual void require(bool holds, std::string_view key, const std::string& found,
                         const std::string& expected) const = 0;
    /// The file that gives a key its value; empty: none does (or a describer runs).
    [[nodiscard]] virtual std::string file_of(std::string_view key) const = 0;
    /// Whether a key is given in the layer of files that gives `other`, or above it.
    [[nodiscard]] virtual bool stands_over(std::string_view key, std::string_view other) const = 0;
    /// A vector that gives a direction is not zero.
    void require_direction(const Eigen::Vector3d& value, std::string_view key) const;

protected:
    struct Visit {
        std::function<void(Fields&, const std::string& name)> keys;
        std::function<void(Fields&)> take;
    };
    /// `value` holds the default; true: the file has the key, and `value` is what it says.
    virtual bool read(const Key& key, KeyValue& value) = 0;
    virtual void enter(const TableKey& key, const Visit& visit) = 0;

private:
    template <class Value>
    void one(const Key& key, Value& value) {
        KeyValue read_value = value;
        if (read(key, read_value)) value = std::get<Value>(std::move(read_value));
    }
    template <class Value>
    void one(const Key& key, std::optional<Value>& value) {
        KeyValue read_value;
        if (read(key, read_value)) value = std::get<Value>(std::move(read_value));
    }
    template <class Number>
    void one_number(const Key& key, Number& value) {
        std::vector<double> wide = {static_cast<double>(value)};
        one(key, wide);
        value = static_cast<Number>(wide.front());
    }
    template <class Number>
    void one_number(const Key& key, std::optional<Number>& value) {
        std::optional<std::vector<double>> wide;
        one(key, wide);
        if (wide) value = static_cast<Number>(wide->front());
    }
};

/// "a number from 0 to 1"
[[nodiscard]] std::string range_text(double low, double high);

}  // namespace app
