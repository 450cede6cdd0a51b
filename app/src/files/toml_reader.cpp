#include "files/toml_reader.h"

#include <fmt/format.h>

#include <algorithm>

#include "files/bad_input.h"
#include "files/option_values.h"

namespace app {
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

std::string checked_text(const toml::node& node) {
    const std::string& value = node.as_string()->get();
    if (std::any_of(value.begin(), value.end(), is_control))
        fail_at(node.source(), kind_of(node), "a text without line breaks and control characters");
    return value;
}

std::string range_text(double low, double high) {
    return fmt::format("a number from {} to {}", low, high);
}

}  // namespace

void fail_at(const toml::source_region& place, const std::string& found, const std::string& expected) {
    const std::string file = place.path ? *place.path : "kit";
    throw BadInput(fmt::format("{}:{}:{}: error: found {}, expected {}", file, place.begin.line,
                               place.begin.column, found, expected));
}

TomlReader::TomlReader(std::vector<const toml::table*> layers, std::string where)
    : layers_(std::move(layers)), where_(std::move(where)) {}

const toml::node* TomlReader::get(std::string_view key) const {
    for (const toml::table* layer : layers_)
        if (const toml::node* node = layer->get(key)) return node;
    return nullptr;
}

const toml::node* TomlReader::find(std::string_view key) {
    read_.emplace_back(key);
    return get(key);
}

void TomlReader::fail(std::string_view key, const std::string& found, const std::string& expected) const {
    const toml::node* node = get(key);
    const toml::source_region none{};
    const toml::source_region& place =
        node ? node->source() : (layers_.empty() ? none : layers_.front()->source());
    fail_at(place, fmt::format("{} in {}", found, where_), expected);
}

void TomlReader::missing(std::string_view key, const std::string& expected) const {
    fail(key, fmt::format("no key \"{}\"", key), expected);
}

std::string TomlReader::text(std::string_view key, std::optional<std::string> fallback) {
    const toml::node* node = find(key);
    if (!node) {
        if (fallback) return *fallback;
        missing(key, fmt::format("{} = \"text\"", key));
    }
    if (!node->is_string()) fail(key, fmt::format("{} = {}", key, kind_of(*node)), "a text in quotes");
    return checked_text(*node);
}

std::string TomlReader::choice(std::string_view key, std::initializer_list<std::string_view> allowed,
                               std::optional<std::string> fallback) {
    std::string value = text(key, std::move(fallback));
    if (std::find(allowed.begin(), allowed.end(), value) == allowed.end())
        fail(key, fmt::format("{} = \"{}\"", key, value), fmt::format("one of {}", fmt::join(allowed, ", ")));
    return value;
}

double TomlReader::number(std::string_view key, double low, double high, std::optional<double> fallback) {
    const toml::node* node = find(key);
    if (!node) {
        if (fallback) return *fallback;
        missing(key, range_text(low, high));
    }
    const std::optional<double> value = node->is_number() ? node->value<double>() : std::nullopt;
    if (!value || !(*value >= low && *value <= high))
        fail(key, fmt::format("{} = {}", key, kind_of(*node)), range_text(low, high));
    return *value;
}

double TomlReader::fraction(std::string_view key, double low, double high, std::optional<double> fallback) {
    const toml::node* node = get(key);
    if (!node || !node->is_string()) return number(key, low, high, fallback);
    read_.emplace_back(key);
    std::optional<double> value;
    try {
        value = as::number().parse(checked_text(*node), std::string(key));
    } catch (const BadInput&) {  // said below, with its place
    }
    if (!value || !(*value >= low && *value <= high))
        fail(key, fmt::format("{} = {}", key, kind_of(*node)),
             range_text(low, high) + " or a fraction such as \"1/60\"");
    return *value;
}

int TomlReader::integer(std::string_view key, int low, int high, std::optional<int> fallback) {
    const toml::node* node = find(key);
    if (!node) {
        if (fallback) return *fallback;
        missing(key, fmt::format("a whole number from {} to {}", low, high));
    }
    if (!node->is_integer() || node->as_integer()->get() < low || node->as_integer()->get() > high)
        fail(key, fmt::format("{} = {}", key, kind_of(*node)),
             fmt::format("a whole number from {} to {}", low, high));
    return static_cast<int>(node->as_integer()->get());
}

bool TomlReader::flag(std::string_view key, std::optional<bool> fallback) {
    const toml::node* node = find(key);
    if (!node) {
        if (fallback) return *fallback;
        missing(key, "true or false");
    }
    if (!node->is_boolean()) fail(key, fmt::format("{} = {}", key, kind_of(*node)), "true or false");
    return node->as_boolean()->get();
}

Eigen::VectorXd TomlReader::numbers(std::string_view key, int size, double low, double high,
                                    std::optional<Eigen::VectorXd> fallback) {
    const std::string expected = fmt::format("[{} numbers, each from {} to {}]", size, low, high);
    const toml::node* node = find(key);
    if (!node) {
        if (fallback) return *fallback;
        missing(key, expected);
    }
    const toml::array* array = node->as_array();
    if (!array || array->size() != static_cast<std::size_t>(size))
        fail(key,
             array ? fmt::format("{} with {} entries", key, array->size())
                   : fmt::format("{} = {}", key, kind_of(*node)),
             expected);
    Eigen::VectorXd values(size);
    for (int i = 0; i < size; ++i) {
        const toml::node& entry = *array->get(static_cast<std::size_t>(i));
        const std::optional<double> value = entry.is_number() ? entry.value<double>() : std::nullopt;
        if (!value || !(*value >= low && *value <= high))
            fail_at(entry.source(), fmt::format("{}[{}] = {} in {}", key, i, kind_of(entry), where_),
                    expected);
        values[i] = *value;
    }
    return values;
}

Eigen::Vector3d TomlReader::vector(std::string_view key, double low, double high,
                                   std::optional<Eigen::Vector3d> fallback) {
    std::optional<Eigen::VectorXd> wide;
    if (fallback) wide = Eigen::VectorXd(*fallback);
    return numbers(key, 3, low, high, wide);
}

TomlReader TomlReader::table(std::string_view key) {
    (void)find(key);
    std::vector<const toml::table*> inner;
    for (const toml::table* layer : layers_)
        if (const toml::node* at = layer->get(key)) {
            if (!at->is_table())
                fail_at(at->source(), fmt::format("{} = {} in {}", key, kind_of(*at), where_), "a table");
            inner.push_back(at->as_table());
        }
    return {std::move(inner), fmt::format("{}, {}", where_, key)};
}

std::vector<TomlReader> TomlReader::tables(std::string_view key) {
    std::vector<TomlReader> result;
    const toml::node* node = find(key);
    if (!node) return result;
    const toml::array* array = node->as_array();
    if (!array) fail(key, fmt::format("{} = {}", key, kind_of(*node)), "an array of tables");
    for (const toml::node& entry : *array) {
        if (!entry.is_table())
            fail_at(entry.source(), fmt::format("{} in {}", kind_of(entry), where_), "a table");
        result.push_back(TomlReader({entry.as_table()}, fmt::format("{}, {}", where_, key)));
    }
    return result;
}

std::vector<std::string> TomlReader::texts(std::string_view key) {
    std::vector<std::string> result;
    const toml::node* node = find(key);
    if (!node) return result;
    const toml::array* array = node->as_array();
    if (!array) fail(key, fmt::format("{} = {}", key, kind_of(*node)), "an array of texts");
    for (const toml::node& entry : *array) {
        if (!entry.is_string())
            fail_at(entry.source(), fmt::format("{} in {}", kind_of(entry), where_), "a text in quotes");
        result.push_back(checked_text(entry));
    }
    return result;
}

void TomlReader::done() const {
    for (const toml::table* layer : layers_)
        for (const auto& [key, node] : *layer)
            if (std::find(read_.begin(), read_.end(), key.str()) == read_.end())
                fail_at(key.source(), fmt::format("unknown key \"{}\" in {}", printable(key.str()), where_),
                        fmt::format("only {}", fmt::join(read_, ", ")));
}

}  // namespace app
