#include "files/toml_reader.h"

#include <fmt/format.h>
#include <toml++/toml.h>

#include <algorithm>
#include <fstream>

#include "files/bad_input.h"
#include "files/option_values.h"

namespace app {
namespace fs = std::filesystem;

struct TomlFile::Document {
    toml::table root;
};

namespace {

bool is_control(char c) {
    return static_cast<unsigned char>(c) < 0x20 || c == 0x7f;
}

/// A file's text for a one-line message: control characters as '?', long ones cut.
std::string printable(std::string_view text) {
    constexpr std::size_t kLongest = 60;
    std::string result(text.substr(0, kLongest));
    std::replace_if(result.begin(), result.end(), is_control, '?');
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

[[noreturn]] void fail_at(const toml::source_region& place, const std::string& found,
                          const std::string& expected) {
    throw BadInput(fmt::format("{}:{}:{}: error: found {}, expected {}", place.path ? *place.path : "a file",
                               place.begin.line, place.begin.column, found, expected));
}

std::string checked_text(const toml::node& node) {
    const std::string& value = node.as_string()->get();
    if (std::any_of(value.begin(), value.end(), is_control))
        fail_at(node.source(), kind_of(node), "a text without line breaks and control characters");
    return value;
}

/// What a key's value should be.
std::string expected_of(const Key& key) {
    if (key.size > 0)
        return fmt::format("[{} numbers, each from {} to {}]", key.size, key.range.low, key.range.high);
    switch (key.type) {
        case KeyType::flag:
            return "true or false";
        case KeyType::number:
            return range_text(key.range.low, key.range.high);
        case KeyType::fraction:
            return range_text(key.range.low, key.range.high) + " or a fraction such as \"1/60\"";
        case KeyType::whole:
            return fmt::format("a whole number from {} to {}", key.range.low, key.range.high);
        case KeyType::texts:
        case KeyType::text_or_texts:
            return "an array of texts";
        case KeyType::columns:
            return "a table";
        default:
            return "a text in quotes";
    }
}

using Layers = std::vector<const toml::table*>;

/// Reads the keys of a stack of TOML tables (an instrument, then the defaults of its kind).
class TomlReader final : public Fields {
public:
    /// `where` names the table in messages; `root` is the file's stack. All must outlive the reader.
    TomlReader(Layers layers, std::string where, const Layers& root)
        : layers_(std::move(layers)), where_(std::move(where)), root_(root) {}

    void parameters(Parameters& values, const std::vector<ParameterRange>& known, Range any,
                    std::string_view meaning) override;
    void require(bool holds, std::string_view key, const std::string& found,
                 const std::string& expected) const override;
    /// Refuses keys that were not declared.
    void done() const;

protected:
    bool read(const Key& key, KeyValue& value) override;
    void enter(const TableKey& key, const Visit& visit) override;

private:
    [[nodiscard]] const toml::node* get(std::string_view key) const;
    [[noreturn]] void fail(std::string_view key, const std::string& found, const std::string& expected) const;
    [[noreturn]] void refuse(const Key& key, const toml::node& node) const;

    [[nodiscard]] KeyValue value_of(const Key& key, const toml::node& node) const;
    [[nodiscard]] std::string choice(const Key& key, const toml::node& node) const;
    [[nodiscard]] double number(const Key& key, const toml::node& node) const;
    [[nodiscard]] std::vector<double> numbers(const Key& key, const toml::node& node) const;
    [[nodiscard]] Texts texts(const Key& key, const toml::node& node) const;
    [[nodiscard]] std::map<std::string, std::string> columns_of(const toml::table& table,
                                                                const std::string& prefix) const;

    [[nodiscard]] Layers merged(std::string_view key) const;
    [[nodiscard]] Layers entries(const TableKey& key) const;
    [[nodiscard]] Layers with_defaults(Layers layers, const TableText& table) const;
    [[nodiscard]] std::string place_of(const Layers& layers, const TableKey& key) const;
    void visit_table(Layers layers, const TableKey& key, const std::string& name, const Visit& visit) const;

    Layers layers_;
    std::string where_;
    const Layers& root_;
    std::vector<std::string> known_, own_;
};

const toml::node* TomlReader::get(std::string_view key) const {
    for (const toml::table* layer : layers_)
        if (const toml::node* node = layer->get(key)) return node;
    return nullptr;
}

void TomlReader::fail(std::string_view key, const std::string& found, const std::string& expected) const {
    const toml::node* node = key.empty() ? nullptr : get(key);
    const toml::source_region none{};
    const toml::source_region& place =
        node ? node->source() : (layers_.empty() ? none : layers_.front()->source());
    fail_at(place, key.empty() ? found : fmt::format("{} in {}", found, where_), expected);
}

void TomlReader::refuse(const Key& key, const toml::node& node) const {
    fail(key.name, fmt::format("{} = {}", key.name, kind_of(node)), expected_of(key));
}

void TomlReader::require(bool holds, std::string_view key, const std::string& found,
                         const std::string& expected) const {
    if (!holds) fail(key, found, expected);
}

bool TomlReader::read(const Key& key, KeyValue& value) {
    known_.emplace_back(key.name);
    const bool own = key.note.need == Need::here;
    if (own) own_.emplace_back(key.name);
    const toml::node* node = own ? layers_.front()->get(key.name) : get(key.name);
    if (!node) {
        const bool text = key.type == KeyType::text || key.type == KeyType::choice;
        if (key.note.need != Need::no)
            fail("", fmt::format("no key \"{}\" in {}", key.name, where_),
                 text ? fmt::format("{} = \"text\"", key.name) : expected_of(key));
        return false;
    }
    value = value_of(key, *node);
    if (own && std::get<std::string>(value).empty())
        fail(key.name, fmt::format("{} = \"\"", key.name), fmt::format("a {}", key.name));
    return true;
}

KeyValue TomlReader::value_of(const Key& key, const toml::node& node) const {
    if (key.size > 0) return numbers(key, node);
    switch (key.type) {
        case KeyType::text:
            if (!node.is_string()) refuse(key, node);
            return checked_text(node);
        case KeyType::choice:
            return choice(key, node);
        case KeyType::flag:
            if (!node.is_boolean()) refuse(key, node);
            return node.as_boolean()->get();
        case KeyType::texts:
            return texts(key, node);
        case KeyType::text_or_texts:
            return node.is_string() ? Texts{checked_text(node)} : texts(key, node);
        case KeyType::columns:
            if (!node.is_table()) refuse(key, node);
            return columns_of(*node.as_table(), "");
        default:
            return std::vector{number(key, node)};
    }
}

std::string TomlReader::choice(const Key& key, const toml::node& node) const {
    if (!node.is_string()) refuse(key, node);
    const std::string word = checked_text(node);
    if (std::find(key.words.begin(), key.words.end(), word) == key.words.end())
        fail(key.name, fmt::format("{} = \"{}\"", key.name, printable(word)),
             fmt::format("one of {}", fmt::join(key.words, ", ")));
    return word;
}

double TomlReader::number(const Key& key, const toml::node& node) const {
    std::optional<double> value;
    if (node.is_number() && (key.type != KeyType::whole || node.is_integer())) value = node.value<double>();
    if (key.type == KeyType::fraction && node.is_string()) value = as::number().read(checked_text(node));
    if (value && *value >= key.range.low && *value <= key.range.high) return *value;
    if (key.type == KeyType::fraction && !node.is_string())
        fail(key.name, fmt::format("{} = {}", key.name, kind_of(node)),
             range_text(key.range.low, key.range.high));
    refuse(key, node);
}

std::vector<double> TomlReader::numbers(const Key& key, const toml::node& node) const {
    const toml::array* array = node.as_array();
    if (!array) refuse(key, node);
    if (array->size() != static_cast<std::size_t>(key.size))
        fail(key.name, fmt::format("{} with {} entries", key.name, array->size()), expected_of(key));
    std::vector<double> values;
    for (const toml::node& entry : *array) {
        const std::optional<double> value = entry.is_number() ? entry.value<double>() : std::nullopt;
        if (!value || !(*value >= key.range.low && *value <= key.range.high))
            fail_at(entry.source(),
                    fmt::format("{}[{}] = {} in {}", key.name, values.size(), kind_of(entry), where_),
                    expected_of(key));
        values.push_back(*value);
    }
    return values;
}

Fields::Texts TomlReader::texts(const Key& key, const toml::node& node) const {
    const toml::array* array = node.as_array();
    if (!array) refuse(key, node);
    Texts result;
    for (const toml::node& entry : *array) {
        if (!entry.is_string())
            fail_at(entry.source(), fmt::format("{} in {}", kind_of(entry), where_), "a text in quotes");
        result.push_back(checked_text(entry));
    }
    return result;
}

std::map<std::string, std::string> TomlReader::columns_of(const toml::table& table,
                                                          const std::string& prefix) const {
    std::map<std::string, std::string> columns;
    for (const auto& [key, node] : table) {
        const std::string role = prefix + std::string(key.str());
        if (node.is_table() && prefix.empty())
            columns.merge(columns_of(*node.as_table(), role + "."));
        else if (node.is_string())
            columns[role] = node.as_string()->get();
        else
            fail_at(node.source(), fmt::format("no text for column \"{}\"", printable(role)),
                    "a column's name in quotes, #N or +N");
    }
    return columns;
}

void TomlReader::parameters(Parameters& values, const std::vector<ParameterRange>& known, Range any,
                            std::string_view meaning) {
    for (const ParameterRange& p : known) {
        KeyValue value;
        const Range range{std::max(p.low, any.low), std::min(p.high, any.high)};
        if (read({p.name, KeyType::number, meaning, {}, range}, value))
            values.emplace_back(p.name, std::get<std::vector<double>>(value).front());
    }
}

/// The tables at a key, through all layers.
Layers TomlReader::merged(std::string_view key) const {
    Layers inner;
    for (const toml::table* layer : layers_)
        if (const toml::node* at = layer->get(key)) {
            if (!at->is_table())
                fail_at(at->source(), fmt::format("{} = {} in {}", key, kind_of(*at), where_), "a table");
            inner.push_back(at->as_table());
        }
    return inner;
}

/// The tables of the array at a key: of the first layer that has it, or of all.
Layers TomlReader::entries(const TableKey& key) const {
    Layers result;
    for (const toml::table* layer : layers_) {
        const toml::node* node = layer->get(key.name);
        if (!node) continue;
        const toml::array* array = node->as_array();
        if (!array)
            fail_at(node->source(), fmt::format("{} = {} in {}", key.name, kind_of(*node), where_),
                    "an array of tables");
        for (const toml::node& entry : *array) {
            if (!entry.is_table())
                fail_at(entry.source(), fmt::format("{} in {}", kind_of(entry), where_), "a table");
            result.push_back(entry.as_table());
        }
        if (key.table->below == Below::nothing) break;
    }
    return result;
}

Layers TomlReader::with_defaults(Layers layers, const TableText& table) const {
    if (table.below == Below::nothing) return layers;
    const std::string kind = (*layers.front())["kind"].value_or(std::string());
    for (const toml::table* file : root_) {
        const toml::table* defaults = (*file)["defaults"].as_table();
        if (defaults && table.below == Below::defaults_of_kind) defaults = (*defaults)[kind].as_table();
        if (defaults) layers.push_back(defaults);
    }
    return layers;
}

std::string TomlReader::place_of(const Layers& layers, const TableKey& key) const {
    const std::string name =
        key.table->below == Below::nothing ? "" : (*layers.front())["name"].value_or(std::string());
    return name.empty() ? fmt::format("{}, {}", where_, key.name)
                        : fmt::format("{} \"{}\"", key.table->name, printable(name));
}

void TomlReader::visit_table(Layers layers, const TableKey& key, const std::string& name,
                             const Visit& visit) const {
    const std::string place =
        layers.empty() ? fmt::format("{}, {}", where_, key.name) : place_of(layers, key);
    TomlReader inner(with_defaults(std::move(layers), *key.table), place, root_);
    visit.keys(inner, name);
    inner.done();
    if (visit.take) visit.take(inner, name);
}

void TomlReader::enter(const TableKey& key, const Visit& visit) {
    known_.emplace_back(key.name);
    if (key.form == TableForm::array) {
        for (const toml::table* entry : entries(key)) visit_table({entry}, key, {}, visit);
        return;
    }
    const Layers inner = merged(key.name);
    if (key.form == TableForm::merged || (key.form == TableForm::optional && !inner.empty()))
        visit_table(inner, key, {}, visit);
    if (key.form != TableForm::named) return;
    const TomlReader all(inner, fmt::format("{}, {}", where_, key.name), root_);
    for (const toml::table* table : inner)
        for (const auto& [name, node] : *table)
            all.visit_table(all.merged(name.str()), {name.str(), TableForm::merged, key.table},
                            std::string(name.str()), visit);
}

void TomlReader::done() const {
    const auto among = [](const std::vector<std::string>& keys, std::string_view key) {
        return std::find(keys.begin(), keys.end(), key) != keys.end();
    };
    for (const toml::table* layer : layers_)
        for (const auto& [key, node] : *layer)
            if (!among(known_, key.str()) || (layer != layers_.front() && among(own_, key.str())))
                fail_at(key.source(), fmt::format("unknown key \"{}\" in {}", printable(key.str()), where_),
                        fmt::format("only {}", fmt::join(known_, ", ")));
}

[[noreturn]] void refuse_syntax(const toml::parse_error& wrong, const std::string& file) {
    std::string what(wrong.description());
    std::replace(what.begin(), what.end(), '\n', ' ');
    throw BadInput(fmt::format("{}:{}:{}: error: found a syntax error ({}), expected TOML", file,
                               wrong.source().begin.line, wrong.source().begin.column, what));
}

}  // namespace

TomlFile::TomlFile(const fs::path& file, const TomlKind& kind) {
    std::error_code error;
    if (fs::is_directory(file, error))
        throw BadInput(
            fmt::format("{}: error: found a directory, expected {} (a TOML file)", file.string(), kind.name));
    std::ifstream in(file);
    if (!in.good())
        throw BadInput(fmt::format("{}: error: found no readable file, expected {} (TOML); {}", file.string(),
                                   kind.name, kind.help));
    try {
        document_ = std::make_unique<Document>(toml::parse(in, file.string()));
    } catch (const toml::parse_error& wrong) {
        refuse_syntax(wrong, file.string());
    }
}

TomlFile::TomlFile(std::string_view text, const std::string& name) {
    try {
        document_ = std::make_unique<Document>(toml::parse(text, name));
    } catch (const toml::parse_error& wrong) {
        refuse_syntax(wrong, name);
    }
}

TomlFile::TomlFile(TomlFile&&) noexcept = default;
TomlFile& TomlFile::operator=(TomlFile&&) noexcept = default;
TomlFile::~TomlFile() = default;

void read_toml(const std::vector<TomlFile>& layers, const std::string& where,
               const std::function<void(Fields&)>& keys, bool all) {
    Layers roots;
    for (const TomlFile& layer : layers) roots.push_back(&layer.document_->root);
    TomlReader reader(roots, where, roots);
    keys(reader);
    if (all) reader.done();
}

}  // namespace app
