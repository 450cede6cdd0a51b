#include "files/toml_reader.h"

#include <fmt/format.h>
#include <toml++/toml.h>
#include <tracking/input.h>
#include <tracking/trace.h>

#include <algorithm>

#include "files/bad_input.h"
#include "files/option_values.h"

namespace app {
namespace fs = std::filesystem;

struct TomlFile::Document {
    toml::table root;
    std::shared_ptr<const Document> includer{};
};

namespace {

/// A file's text for a one-line message: long ones cut.
std::string printable(std::string_view text) {
    constexpr std::size_t kLongest = 60;
    const std::string result = tracking::printable(text.substr(0, kLongest));
    return text.size() > kLongest ? result + "..." : result;
}

std::string kind_of(const toml::node& node) {
    if (node.is_table()) return "a table";
    if (node.is_array()) return "an array";
    if (node.is_string()) return fmt::format("\"{}\"", printable(node.as_string()->get()));
    if (node.is_integer()) return fmt::format("{}", node.as_integer()->get());
    if (node.is_floating_point()) return fmt::format("{}", node.as_floating_point()->get());
    if (node.is_boolean()) return node.as_boolean()->get() ? "true" : "false";
    return "a date or time";
}

BadInput fault_at(const toml::source_region& place, const std::string& found, const std::string& expected) {
    return BadInput(fmt::format("{}:{}:{}: error: found {}, expected {}", place.path ? *place.path : "a file",
                                place.begin.line, place.begin.column, found, expected));
}

std::string checked_text(const toml::node& node) {
    const std::string& value = node.as_string()->get();
    if (std::any_of(value.begin(), value.end(), is_control))
        throw fault_at(node.source(), kind_of(node), "a text without line breaks and control characters");
    return value;
}

/// What a key's value should be.
std::string expected_of(const Key& key) {
    if (key.size > 0)
        return fmt::format("[{} numbers, each from {} to {}]", key.size, key.range.low, key.range.high);
    return fmt::format(fmt::runtime(text_of(key.type).expected), key.range.low, key.range.high);
}

using Layers = std::vector<const toml::table*>;

/// A stack of files; which includes which.
struct Files {
    Layers roots;
    std::vector<Layers> includers;  ///< of each: the files that include it, and those that include them

    [[nodiscard]] bool includes(std::size_t outer, std::size_t inner) const {
        return std::ranges::find(includers[inner], roots[outer]) != includers[inner].end();
    }
    /// Whether a file that includes this one leaves out its entries of that name.
    [[nodiscard]] bool removed(std::size_t file, const std::string& name) const {
        return std::ranges::any_of(includers[file], [&](const toml::table* includer) {
            const toml::array* names = (*includer)["remove"].as_array();
            return names && std::ranges::any_of(*names, [&](const toml::node& entry) {
                       return entry.value_or(std::string()) == name;
                   });
        });
    }
};

std::string name_of(const toml::table& entry) {
    return entry["name"].value_or(std::string());
}

/// Reads the keys of a stack of TOML tables (an instrument, then the defaults of its kind).
class TomlReader final : public Fields {
public:
    /// `where` names the table in messages; the first `own` layers are the table itself, the others its defaults. All
    /// must outlive the reader.
    TomlReader(Layers layers, std::string where, const Files& files, std::size_t own = 1)
        : layers_(std::move(layers)), where_(std::move(where)), files_(files), own_layers_(own) {}

    void parameters(Parameters& values, const std::vector<ParameterRange>& known, Range any,
                    std::string_view meaning, const Owner& owner) override {
        std::vector<std::string> owners;  // by layer: as its file, and those below it, have it
        for (std::size_t i = 0; i < layers_.size(); ++i) {
            const toml::node* node = nullptr;
            for (std::size_t below = i; !node && below < layers_.size(); ++below)
                node = layers_[below]->get(owner.key);
            owners.push_back(node ? node->value_or(owner.otherwise) : owner.otherwise);
        }
        for (std::size_t i = layers_.size(); i-- > 1;) {
            if (owners[i] == owners.front()) continue;
            others_.push_back(layers_[i]);
            layers_.erase(layers_.begin() + static_cast<std::ptrdiff_t>(i));
            if (i < own_layers_) --own_layers_;
        }
        for (const ParameterRange& p : known) {
            KeyValue value;
            const Range range{std::max(p.low, any.low), std::min(p.high, any.high)};
            if (read({p.name, KeyType::number, meaning, {}, range}, value))
                values.emplace_back(p.name, std::get<std::vector<double>>(value).front());
        }
    }
    void require(bool holds, std::string_view key, const std::string& found,
                 const std::string& expected) const override {
        if (!holds && !missing_) throw fault(key, found, expected);
    }
    [[nodiscard]] std::string file_of(std::string_view key) const override {
        const toml::node* node = get(key);
        return node && node->source().path ? *node->source().path : "";
    }
    [[nodiscard]] bool stands_over(std::string_view key, std::string_view other) const override {
        for (const toml::table* layer : layers_)
            if (layer->contains(key))
                return std::ranges::any_of(layers_,
                                           [&](const toml::table* at) { return at->contains(other); });
            else if (layer->contains(other))
                return false;
        return false;
    }
    /// Refuses keys that were not declared, if it has `all`, then what is missing: it may be misspelt.
    void done(bool all = true) const {
        const auto among = [](const std::vector<std::string>& keys, std::string_view key) {
            return std::ranges::find(keys, key) != keys.end();
        };
        for (std::size_t i = 0; all && i < layers_.size(); ++i)
            for (const auto& [key, node] : *layers_[i])
                if (!among(known_, key.str()) || (i >= own_layers_ && among(own_, key.str())))
                    throw fault_at(key.source(),
                                   fmt::format("unknown key \"{}\" in {}", printable(key.str()), where_),
                                   fmt::format("only {}{}", fmt::join(known_, ", "),
                                               nearest_hint(std::string(key.str()), known_)));
        for (const toml::table* layer : others_)
            for (const auto& [key, node] : *layer)
                if (all && !node.is_number() && !among(known_, key.str()))
                    throw fault_at(key.source(),
                                   fmt::format("unknown key \"{}\" in {}", printable(key.str()), where_),
                                   fmt::format("only {}{}", fmt::join(known_, ", "),
                                               nearest_hint(std::string(key.str()), known_)));
        if (missing_) throw BadInput(*missing_);
    }

protected:
    bool read(const Key& key, KeyValue& value) override {
        known_.emplace_back(key.name);
        const bool own = is_own(key.note.need);
        if (own) own_.emplace_back(key.name);
        const toml::node* node = get(key.name, own ? own_layers_ : layers_.size());
        if (!node && key.note.need == Need::no) return false;
        if (!node && !missing_)
            missing_ = fault("", fmt::format("no key \"{}\" in {}", key.name, where_),
                             key.type == KeyType::text || key.type == KeyType::choice
                                 ? fmt::format("{} = \"text\"", key.name)
                                 : expected_of(key));
        if (!node) return false;
        value = value_of(key, *node);
        if (own && std::get<std::string>(value).empty())
            throw fault(key.name, fmt::format("{} = \"\"", key.name), fmt::format("a {}", key.name));
        return true;
    }
    void enter(const TableKey& key, const Visit& visit) override {
        known_.emplace_back(key.name);
        if (missing_) return;
        if (key.form == TableForm::array) {
            for (Layers& entry : entries(key)) visit_table(std::move(entry), key, {}, visit);
            return;
        }
        const Layers inner = merged(key.name, key.table->example);
        if (key.form == TableForm::merged || (key.form == TableForm::optional && !inner.empty()))
            visit_table(inner, key, {}, visit);
        if (key.form != TableForm::named) return;
        const TomlReader all(inner, fmt::format("{}, {}", where_, key.name), files_);
        for (const toml::table* table : inner)
            for (const auto& [name, node] : *table)
                all.visit_table(all.merged(name.str()), {name.str(), TableForm::merged, key.table},
                                std::string(name.str()), visit);
    }

private:
    [[nodiscard]] const toml::node* get(std::string_view key, std::size_t layers) const {
        for (std::size_t i = 0; i < std::min(layers, layers_.size()); ++i)
            if (const toml::node* node = layers_[i]->get(key)) return node;
        return nullptr;
    }
    [[nodiscard]] const toml::node* get(std::string_view key) const { return get(key, layers_.size()); }
    [[nodiscard]] BadInput fault(std::string_view key, const std::string& found,
                                 const std::string& expected) const {
        const toml::node* node = key.empty() ? nullptr : get(key);
        if (!node && !layers_.empty()) node = layers_.front();
        return fault_at(node ? node->source() : toml::source_region{},
                        key.empty() ? found : fmt::format("{} in {}", found, where_), expected);
    }
    [[noreturn]] void refuse(const Key& key, const toml::node& node) const {
        throw fault(key.name, fmt::format("{} = {}", key.name, kind_of(node)), expected_of(key));
    }

    [[nodiscard]] KeyValue value_of(const Key& key, const toml::node& node) const {
        const bool text = key.type == KeyType::text || key.type == KeyType::choice;
        if ((text && !node.is_string()) || (key.type == KeyType::flag && !node.is_boolean()) ||
            (key.type == KeyType::columns && !node.is_table()))
            refuse(key, node);
        if (key.size > 0) return numbers(key, node);
        switch (key.type) {
            case KeyType::text:
            case KeyType::choice:
                return checked_word(key, checked_text(node));
            case KeyType::flag:
                return node.as_boolean()->get();
            case KeyType::texts:
            case KeyType::text_or_texts:
                return texts(key, node);
            case KeyType::columns:
                return columns_of(*node.as_table(), "");
            default:
                return std::vector{number(key, node)};
        }
    }
    /// One of the words, if they are given.
    [[nodiscard]] std::string checked_word(const Key& key, const std::string& word) const {
        if (!key.words.empty() && std::ranges::find(key.words, word) == key.words.end())
            throw fault(key.name, fmt::format("{} = \"{}\"", key.name, printable(word)),
                        fmt::format("one of {}", fmt::join(key.words, ", ")));
        return word;
    }
    [[nodiscard]] const toml::array& array_of(const Key& key, const toml::node& node) const {
        if (!node.is_array()) refuse(key, node);
        return *node.as_array();
    }
    [[nodiscard]] double number(const Key& key, const toml::node& node) const {
        std::optional<double> value;
        if (node.is_number() && (key.type != KeyType::whole || node.is_integer()))
            value = node.value<double>();
        if (key.type == KeyType::fraction && node.is_string()) value = as::number().read(checked_text(node));
        if (value && *value >= key.range.low && *value <= key.range.high) return *value;
        if (key.type == KeyType::fraction && !node.is_string())
            throw fault(key.name, fmt::format("{} = {}", key.name, kind_of(node)),
                        range_text(key.range.low, key.range.high));
        refuse(key, node);
    }
    [[nodiscard]] std::vector<double> numbers(const Key& key, const toml::node& node) const {
        const toml::array& array = array_of(key, node);
        if (array.size() != static_cast<std::size_t>(key.size))
            throw fault(key.name, fmt::format("{} with {} entries", key.name, array.size()),
                        expected_of(key));
        std::vector<double> values;
        for (const toml::node& entry : array) {
            const std::optional<double> value = entry.is_number() ? entry.value<double>() : std::nullopt;
            if (!value || !(*value >= key.range.low && *value <= key.range.high))
                throw fault_at(
                    entry.source(),
                    fmt::format("{}[{}] = {} in {}", key.name, values.size(), kind_of(entry), where_),
                    expected_of(key));
            values.push_back(*value);
        }
        return values;
    }
    [[nodiscard]] Texts texts(const Key& key, const toml::node& node) const {
        if (key.type == KeyType::text_or_texts && node.is_string()) return {checked_text(node)};
        Texts result;
        for (const toml::node& entry : array_of(key, node)) {
            if (!entry.is_string())
                throw fault_at(entry.source(), fmt::format("{} in {}", kind_of(entry), where_),
                               "a text in quotes");
            result.push_back(checked_text(entry));
        }
        return result;
    }
    [[nodiscard]] std::map<std::string, std::string> columns_of(const toml::table& table,
                                                                const std::string& prefix) const {
        std::map<std::string, std::string> columns;
        for (const auto& [key, node] : table) {
            const std::string role = prefix + std::string(key.str());
            if (node.is_table() && prefix.empty())
                columns.merge(columns_of(*node.as_table(), role + "."));
            else if (node.is_string())
                columns[role] = node.as_string()->get();
            else
                throw fault_at(node.source(), fmt::format("no text for column \"{}\"", printable(role)),
                               "a column's name in quotes, #N or +N");
        }
        return columns;
    }

    [[nodiscard]] const toml::table* table_in(const toml::node& node, const std::string& at,
                                              std::string_view such_as = {}) const {
        if (!node.is_table())
            throw fault_at(node.source(), fmt::format("{}{} in {}", at, kind_of(node), where_),
                           fmt::format("a table{}{}", such_as.empty() ? "" : " such as ", such_as));
        return node.as_table();
    }
    /// The tables at a key, through all layers.
    [[nodiscard]] Layers merged(std::string_view key, std::string_view such_as = {}) const {
        Layers inner;
        for (const toml::table* layer : layers_)
            if (const toml::node* at = layer->get(key)) {
                inner.push_back(table_in(*at, fmt::format("{} = ", key), such_as));
            }
        return inner;
    }
    /// The tables of the array at a key: of the first layer that has it, or of all. Above those of included files lie
    /// those of the files that include them and have the same name.
    [[nodiscard]] std::vector<Layers> entries(const TableKey& key) const {
        struct Entry {
            std::string name;
            std::vector<std::size_t> files;
        };
        std::vector<Layers> result;
        std::vector<Entry> found;
        for (std::size_t file = 0; file < layers_.size(); ++file) {
            const toml::node* node = layers_[file]->get(key.name);
            if (!node) continue;
            const bool alone = key.table->below == Below::nothing;
            for (const toml::node& at : array_at(key, *node)) {
                const toml::table* table = table_in(at, "");
                const std::string name = alone ? "" : name_of(*table);
                if (!alone && files_.removed(file, name)) continue;
                const auto changes = [&](const Entry& entry) {
                    return !name.empty() && entry.name == name &&
                           std::ranges::all_of(
                               entry.files, [&](std::size_t outer) { return files_.includes(outer, file); });
                };
                const auto changing = std::ranges::find_if(found, changes);
                if (changing == found.end()) {
                    found.push_back({name, {file}});
                    result.push_back({table});
                } else {
                    changing->files.push_back(file);
                    result[static_cast<std::size_t>(changing - found.begin())].push_back(table);
                }
            }
            if (alone) return result;
        }
        if (key.table->below != Below::nothing) check_removals(key);
        return result;
    }
    [[nodiscard]] const toml::array& array_at(const TableKey& key, const toml::node& node) const {
        if (!node.is_array())
            throw fault_at(node.source(), fmt::format("{} = {} in {}", key.name, kind_of(node), where_),
                           "an array of tables");
        return *node.as_array();
    }
    /// Whatever a file leaves out is in a file that it includes.
    void check_removals(const TableKey& key) const {
        for (std::size_t outer = 0; outer < layers_.size(); ++outer) {
            const toml::array* names = (*layers_[outer])["remove"].as_array();
            if (!names || layers_.size() != files_.roots.size()) continue;
            std::vector<std::string> there;
            for (std::size_t file = 0; file < layers_.size(); ++file) {
                const toml::array* inner = (*layers_[file])[key.name].as_array();
                if (!inner || !files_.includes(outer, file)) continue;
                for (const toml::node& entry : *inner)
                    if (entry.is_table()) there.push_back(name_of(*entry.as_table()));
            }
            for (const toml::node& name : *names)
                if (std::ranges::find(there, name.value_or(std::string())) == there.end())
                    throw fault_at(name.source(), fmt::format("{} in remove", kind_of(name)),
                                   fmt::format("the name of an included {}{}", key.table->name,
                                               nearest_hint(name.value_or(std::string()), there)));
        }
    }
    /// Visits the tables `layers` at a key, which have the file's defaults of their kind below them.
    void visit_table(Layers layers, const TableKey& key, const std::string& name, const Visit& visit) const {
        std::string place = fmt::format("{}, {}", where_, key.name);
        const std::size_t own = key.table->below == Below::nothing ? 1 : layers.size();
        if (key.table->below != Below::nothing) {
            const auto text = [&](const char* inner) {
                for (std::size_t i = 0; i < own; ++i)
                    if (const toml::node* node = layers[i]->get(inner)) return node->value_or(std::string());
                return std::string();
            };
            const std::string kind = text("kind"), called = text("name");
            if (!called.empty()) place = fmt::format("{} \"{}\"", key.table->name, printable(called));
            for (const toml::table* file : files_.roots) {
                const toml::table* defaults = (*file)["defaults"].as_table();
                if (defaults && key.table->below == Below::defaults_of_kind)
                    defaults = (*defaults)[kind].as_table();
                if (defaults) layers.push_back(defaults);
            }
        }
        TomlReader inner(std::move(layers), place, files_, own);
        visit.keys(inner, name);
        inner.done();
        if (visit.take) visit.take(inner);
    }

    Layers layers_, others_;  ///< others: with parameters of another owner
    std::string where_;
    const Files& files_;
    std::size_t own_layers_;
    std::optional<BadInput> missing_;
    std::vector<std::string> known_, own_;
};

std::string text_of_file(const char* kind, const fs::path& file) {
    try {
        return tracking::read_bytes(file.string(), fmt::format("{} (TOML)", kind));
    } catch (const tracking::TraceError& wrong) {
        throw BadInput(wrong.what());
    }
}

/// Calls parse(); a syntax error in `file` becomes BadInput.
toml::table parsed(const std::string& file, const auto& parse) {
    try {
        return parse();
    } catch (const toml::parse_error& wrong) {
        throw BadInput(fmt::format("{}:{}:{}: error: found a syntax error ({}), expected TOML", file,
                                   wrong.source().begin.line, wrong.source().begin.column,
                                   wrong.description()));
    }
}

/// Where the string that opens at `at` ends: behind its last quote, or at the end of the text.
std::size_t end_of_string(std::string_view text, std::size_t at) {
    const char quote = text[at];
    const std::string_view three = text.substr(at, 3);
    const bool many_lines = three == "\"\"\"" || three == "'''";
    const std::string_view end = many_lines ? three : three.substr(0, 1);
    for (at += end.size(); at < text.size(); ++at) {
        if (text.substr(at).starts_with(end)) return at + end.size();
        if (text[at] == '\n' && !many_lines) return at;  // an error, which the parser tells
        if (text[at] == '\\' && quote == '"') ++at;
    }
    return text.size();
}

/// Every part of a dotted key is a table within the one before, which takes room on the stack when they are
/// destroyed. Throws BadInput for keys and headers of more parts than any of ours has.
void check_depth(std::string_view text, const std::string& file) {
    constexpr int kMostParts = 16;
    int parts = 1;
    std::size_t line = 1, line_begin = 0;
    for (std::size_t at = 0; at < text.size();) {
        const char c = text[at];
        if (c == '\n') ++line, line_begin = at + 1;
        if (c == '"' || c == '\'') {
            const std::size_t end = end_of_string(text, at);
            for (; at < end; ++at)
                if (text[at] == '\n') ++line, line_begin = at + 1;
            continue;
        }
        if (c == '#') {
            at = std::min(text.find('\n', at), text.size());
            continue;
        }
        if (std::string_view("=,[]{}\n").find(c) != std::string_view::npos) parts = 1;
        if (c == '.' && ++parts > kMostParts)
            throw BadInput(
                fmt::format("{}:{}:{}: error: found a key of more than {} parts, expected at most "
                            "that many",
                            file, line, at - line_begin + 1, kMostParts));
        ++at;
    }
}

}  // namespace

TomlFile::TomlFile(const char* kind, const fs::path& file, const TomlFile* includer)
    : TomlFile(text_of_file(kind, file), file.string(), includer) {}

TomlFile::TomlFile(std::string_view text, const std::string& name, const TomlFile* includer) {
    check_depth(text, name);
    const auto parse = [&] { return toml::parse(text, name); };
    document_ = std::make_shared<const Document>(
        Document{parsed(name, parse), includer ? includer->document_ : nullptr});
}

void read_toml(const std::vector<TomlFile>& layers, const std::string& where,
               const std::function<void(Fields&)>& keys, bool all) {
    Files files;
    for (const TomlFile& layer : layers) {
        files.roots.push_back(&layer.document_->root);
        Layers& includers = files.includers.emplace_back();
        for (const auto* at = layer.document_->includer.get(); at; at = at->includer.get())
            includers.push_back(&at->root);
    }
    TomlReader reader(files.roots, where, files);
    keys(reader);
    reader.done(all);
}

}  // namespace app
