#include "files/format_description.h"

#include <fmt/format.h>

#include <algorithm>

namespace app {
namespace {

/// Notes what is declared; reads nothing.
class Describer final : public Fields {
public:
    Describer(FormatDescription& format, std::size_t table) : format_(format), table_(table) {}

    void parameters(Parameters&, const std::vector<ParameterRange>&, Range any, std::string_view meaning,
                    const Owner&) override {
        format_.tables[table_].parameters = meaning;
        format_.tables[table_].parameter_range = any;
    }
    void require(bool, std::string_view, const std::string&, const std::string&) const override {}
    [[nodiscard]] std::string file_of(std::string_view) const override { return {}; }
    [[nodiscard]] bool stands_over(std::string_view, std::string_view) const override { return false; }

protected:
    bool read(const Key& key, KeyValue& value) override {
        const bool fixed = key.note.need == Need::no && !*key.note.otherwise;
        add({key, fixed ? value : KeyValue()});
        return false;
    }
    void enter(const TableKey& key, const Visit& visit) override {
        const bool partial = key.form == TableForm::partial;
        const std::string kind = key.table->name, name = partial ? kind + "-defaults" : kind;
        const std::string_view meaning = key.meaning.empty() ? key.table->meaning : key.meaning;
        add({{key.name, KeyType::text, meaning, {}}, {}, name, key.form});
        const auto same = [&](const DescribedTable& table) { return table.name == name; };
        if (std::any_of(format_.tables.begin(), format_.tables.end(), same)) return;
        format_.tables.push_back({name, key.table->meaning, key.table->below != Below::nothing});
        if (partial) format_.tables.back().below = kind;
        Describer inner(format_, format_.tables.size() - 1);
        visit.keys(inner, "NAME");
    }

private:
    void add(DescribedKey key) {
        std::vector<DescribedKey>& keys = format_.tables[table_].keys;
        if (!format_.tables[table_].below.empty() && is_own(key.key.note.need)) return;
        keys.push_back(std::move(key));
    }

    FormatDescription& format_;
    std::size_t table_;
};

std::string json_text(std::string_view text) {
    std::string result = "\"";
    for (const char c : text) {
        if (c == '"' || c == '\\') result += '\\';
        result += c;
    }
    return result + '"';
}

std::string json_list(const auto& values, const auto& json_of) {
    std::string list;
    for (const auto& value : values) list += (list.empty() ? "" : ", ") + json_of(value);
    return "[" + list + "]";
}

/// The shortest text that reads back to the number, as single precision where that is enough: defaults of
/// drawing are floats.
std::string number_text(double value) {
    const auto narrow = static_cast<float>(value);
    return static_cast<double>(narrow) == value ? fmt::format("{}", narrow) : fmt::format("{}", value);
}

/// Empty: none.
std::string value_text(const Key& key, const KeyValue& value) {
    if (const auto* text = std::get_if<std::string>(&value)) return json_text(*text);
    if (const auto* flag = std::get_if<bool>(&value)) return *flag ? "true" : "false";
    if (const auto* numbers = std::get_if<std::vector<double>>(&value))
        return key.size > 0 ? json_list(*numbers, number_text) : number_text(numbers->front());
    if (const auto* texts = std::get_if<Fields::Texts>(&value))
        return texts->empty() ? "" : json_list(*texts, json_text);
    return "";
}

/// Whether a table lacks something without the key.
bool is_required(const DescribedTable& table, const DescribedKey& key) {
    const Need need = key.key.note.need;
    return need == Need::here || (need == Need::given && !table.has_defaults);
}

// JSON Schema

std::string range_schema(KeyType type, const Range& range, const std::string& text = {}) {
    return fmt::format(fmt::runtime(text_of(type).schema), range.low, range.high, text);
}

std::string type_schema(const Key& key) {
    if (key.size > 0)
        return fmt::format("\"type\": \"array\", \"items\": {{{}}}, \"minItems\": {}, \"maxItems\": {}",
                           range_schema(KeyType::number, key.range), key.size, key.size);
    if (key.type == KeyType::choice)
        return "\"type\": \"string\", \"enum\": " + json_list(key.words, json_text);
    return range_schema(key.type, key.range,
                        std::string(R"("type": "string", "pattern": "^[^\\u0000-\\u001f\\u007f]*$")") +
                            (is_own(key.note.need) ? ", \"minLength\": 1" : ""));
}

std::string reference_to(const std::string& table) {
    return fmt::format("{{\"$ref\": {}}}", json_text("#/definitions/" + table));
}

std::string property_schema(const DescribedKey& described) {
    const Key& key = described.key;
    const std::string table = described.table.empty() ? "" : reference_to(described.table);
    if (described.form == TableForm::array)
        return fmt::format("{{\"description\": {}, \"type\": \"array\", \"items\": {}}}",
                           json_text(key.meaning), table);
    if (described.form == TableForm::named)
        return fmt::format("{{\"description\": {}, \"type\": \"object\", \"additionalProperties\": {}}}",
                           json_text(key.meaning), table);
    if (!table.empty()) return table;
    std::string meaning(key.meaning);
    if (*key.range.unit) meaning += fmt::format(" Unit: {}.", key.range.unit);
    if (*key.note.otherwise) meaning += fmt::format(" Default: {}.", key.note.otherwise);
    std::string text = fmt::format("{{\"description\": {}, {}", json_text(meaning), type_schema(key));
    if (const std::string fallback = value_text(key, described.fallback); !fallback.empty())
        text += fmt::format(", \"default\": {}", fallback);
    if (*key.note.example) text += fmt::format(", \"examples\": [{}]", key.note.example);
    return text + "}";
}

/// The members of a table's schema, without the braces.
std::string table_schema(const DescribedTable& table, const std::string& margin) {
    std::string properties;
    std::vector<std::string_view> required;
    for (const DescribedKey& key : table.keys) {
        properties += fmt::format("{}\n{}  {}: {}", properties.empty() ? "" : ",", margin,
                                  json_text(key.key.name), property_schema(key));
        if (is_required(table, key)) required.push_back(key.key.name);
    }
    std::string text =
        fmt::format("{0}\"description\": {1},\n{0}\"type\": \"object\",\n", margin, json_text(table.meaning));
    text += fmt::format("{0}\"properties\": {{{1}\n{0}}},\n", margin, properties);
    if (!required.empty())
        text += fmt::format("{}\"required\": {},\n", margin, json_list(required, json_text));
    return text + fmt::format("{}\"additionalProperties\": {}", margin,
                              table.parameters.empty()
                                  ? "false"
                                  : fmt::format("{{\"description\": {}, {}}}", json_text(table.parameters),
                                                range_schema(KeyType::number, table.parameter_range)));
}

// Reference page

std::string type_text(const DescribedKey& described) {
    const Key& key = described.key;
    if (!described.table.empty()) {
        const char* form = described.form == TableForm::array   ? "array of tables"
                           : described.form == TableForm::named ? "tables by name:"
                                                                : "table";
        return fmt::format("{0} [{1}](#{1})", form, described.table);
    }
    if (key.size > 0) return fmt::format("{} numbers", key.size);
    if (key.type == KeyType::choice)
        return fmt::format("`{}`", fmt::join(key.words, "`, `")).substr(key.words.front().empty() ? 4 : 0);
    return text_of(key.type).page;
}

std::string default_text(const DescribedTable& table, const DescribedKey& described) {
    if (is_required(table, described)) return "required";
    if (described.key.note.need == Need::given) return "required, here or in the defaults";
    if (described.key.note.need == Need::own) return "required, here or in the included instrument";
    if (*described.key.note.otherwise) return described.key.note.otherwise;
    const std::string value = value_text(described.key, described.fallback);
    return value.empty() || value == "\"\"" ? "" : fmt::format("`{}`", value);
}

/// A cell of a table: '|' would end it.
std::string cell(std::string_view text) {
    std::string result;
    for (const char c : text) result += c == '|' ? std::string("\\|") : std::string(1, c);
    return result;
}

std::string key_row(const DescribedTable& table, const DescribedKey& described) {
    const Key& key = described.key;
    const bool ranged = key.range.low < key.range.high;
    std::string meaning = cell(key.meaning);
    if (*key.note.example) meaning += fmt::format(" Example: `{}`.", cell(key.note.example));
    return fmt::format("| `{}` | {} | {} | {} | {} | {} |\n", key.name, type_text(described), key.range.unit,
                       ranged ? fmt::format("{} to {}", key.range.low, key.range.high) : "",
                       default_text(table, described), meaning);
}

}  // namespace

FormatDescription describe_format(const TableText& file, const std::function<void(Fields&)>& keys) {
    FormatDescription format;
    format.tables.push_back({file.name, file.meaning});
    Describer describer(format, 0);
    keys(describer);
    return format;
}

std::string json_schema(const FormatDescription& format) {
    const DescribedTable& file = format.tables.front();
    std::string text = fmt::format(
        "{{\n  \"$schema\": \"http://json-schema.org/draft-07/schema#\",\n"
        "  \"$id\": \"{0}.schema.json\",\n  \"title\": \"MusicWorld {0}\",\n{1},\n  \"definitions\": {{",
        file.name, table_schema(file, "  "));
    for (std::size_t i = 1; i < format.tables.size(); ++i)
        text += fmt::format("{}\n    {}: {{\n{}\n    }}", i > 1 ? "," : "", json_text(format.tables[i].name),
                            table_schema(format.tables[i], "      "));
    return text + "\n  }\n}\n";
}

std::string reference_page(const FormatDescription& format, const std::string& remade_by) {
    std::string page;
    for (const DescribedTable& table : format.tables) {
        const bool file = page.empty();
        page +=
            file ? fmt::format(
                       "# Reference: {} files\n\n{}\n\nThis page is made by `{}` from the same declaration "
                       "that the reader runs.\n",
                       table.name, table.meaning, remade_by)
                 : fmt::format("\n## {}\n\n{}\n", table.name, table.meaning);
        if (!table.below.empty()) {
            page += fmt::format(
                "\nKeys for every [{0}](#{0}) that does not give them itself: all but those that are "
                "required there. Tables are merged key by key.\n",
                table.below);
            continue;
        }
        page += "\n| Key | Type | Unit | Range | Default | Meaning |\n|---|---|---|---|---|---|\n";
        for (const DescribedKey& key : table.keys) page += key_row(table, key);
        if (!table.parameters.empty())
            page += fmt::format("| any other | number | | | | {} |\n", cell(table.parameters));
    }
    return page;
}

}  // namespace app
