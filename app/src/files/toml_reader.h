#pragma once
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "files/fields.h"

namespace app {

/// A TOML document in memory, with the places of its keys.
class TomlFile {
public:
    /// `kind` is what it should be, "a kit". Throws BadInput: no file, a folder, a syntax error (with its place).
    /// `includer` is the file that includes it: its entries of an array with names change those of this file that have
    /// the same name, and its array of texts `remove` leaves some out.
    TomlFile(const char* kind, const std::filesystem::path& file, const TomlFile* includer = nullptr);
    /// `name` stands for the file in messages.
    TomlFile(std::string_view text, const std::string& name, const TomlFile* includer = nullptr);

private:
    friend void read_toml(const std::vector<TomlFile>& layers, const std::string& where,
                          const std::function<void(Fields&)>& keys, bool all);
    struct Document;
    std::shared_ptr<const Document> document_;  // of this and its copies
};

/// Runs a declaration of keys on a stack of files: the first that has a key gives its value, tables are merged
/// key by key. Every value is checked where it is read, and keys that were not declared are refused, unless
/// `all` is false. `where` names the file in messages, e.g. "the kit". All failures are BadInput with
/// FILE:LINE:COLUMN: error: found F, expected E.
void read_toml(const std::vector<TomlFile>& layers, const std::string& where,
               const std::function<void(Fields&)>& keys, bool all = true);

}  // namespace app
