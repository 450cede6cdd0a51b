#pragma once
#include <functional>
#include <nlohmann/json.hpp>
#include <string>

namespace app {

using nlohmann::json;

/// Follows a $ref into the schema's definitions.
const json& resolved(const json& root, const json& node);

/// A value with every key of an object's schema at its example, or else at its default.
json example_of(const json& root, const json& node_or_ref);

/// A file's text as TOML.
std::string toml_text(const json& file);

/// A format's schema, a file that names (almost) all of its keys, and the reader.
struct FormatCase {
    json schema, full;
    std::function<std::string(const json& file)> refusal;  ///< empty: it is read
    /// Takes away what hides the value at a place from the reader, e.g. a body's own value before the defaults'.
    std::function<void(json& file, const json::json_pointer& place)> uncover;
};

// The schema and the reader know the same. Each is a test of its own for kits, scenes and maps; they return how
// many keys or tables they tried.

int expect_every_key_is_described(const FormatCase& format);
/// In every table a further key is refused, with a list of exactly the schema's keys (but for `own`, which
/// tables that have defaults may name and the defaults may not).
int expect_unknown_keys_are_refused(const FormatCase& format, const std::vector<std::string>& own);
/// At the limits of every range the reader complains of no range, just beyond them it names them.
int expect_ranges_are_the_readers(const FormatCase& format);
/// Every word of a choice is taken, no other; a value of another type is refused where it stands.
int expect_types_are_the_readers(const FormatCase& format);
/// Without a key that the schema requires the file is refused for it; without any other it is read, but for
/// `needed` ones.
int expect_required_keys_are_the_readers(const FormatCase& format, const std::vector<std::string>& needed);

}  // namespace app
