#pragma once
#include <string>
#include <vector>

#include "files/fields.h"

namespace app {

/// A declared key: a value, or a table of another description.
struct DescribedKey {
    Key key;
    KeyValue fallback;
    std::string table = {};  ///< name of the table's description; empty: a value
    TableForm form = TableForm::merged;
};

struct DescribedTable {
    std::string name, meaning;
    bool has_defaults = false;  ///< keys that are needed may come from the defaults
    std::string below = {};     ///< the kind below whose tables this one stands; empty: none
    std::vector<DescribedKey> keys = {};
    std::string parameters = {};  ///< meaning of free numbers under names of their own; empty: none
    Range parameter_range = {};
};

/// What a file of a format may hold. The first table is the file itself, the others follow as they are named.
struct FormatDescription {
    std::vector<DescribedTable> tables;
};

/// Runs a declaration of keys with their defaults in `value`.
[[nodiscard]] FormatDescription describe_format(const TableText& file,
                                                const std::function<void(Fields&)>& keys);
template <class T>
[[nodiscard]] FormatDescription describe_format(const TableKind<T>& file, T value = {}) {
    return describe_format(file, [&](Fields& keys) { file.keys(keys, value); });
}

/// JSON Schema (draft 7) of a format; numbers of one key on one line.
[[nodiscard]] std::string json_schema(const FormatDescription& format);

/// Reference page of a format (Markdown): a table of keys for each kind of table. `remade_by` is the command
/// that writes it.
[[nodiscard]] std::string reference_page(const FormatDescription& format, const std::string& remade_by);

}  // namespace app
