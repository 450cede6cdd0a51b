#include "files/fields.h"

#include <fmt/format.h>

namespace app {

void Fields::text(std::string_view key, std::string& value, std::string_view meaning, Note note) {
    KeyValue read_value = value;
    if (read({key, KeyType::text, meaning, note}, read_value)) value = std::get<std::string>(read_value);
}

void Fields::text(std::string_view key, std::optional<std::string>& value, std::string_view meaning,
                  Note note) {
    KeyValue read_value;
    if (read({key, KeyType::text, meaning, note}, read_value)) value = std::get<std::string>(read_value);
}

void Fields::texts(std::string_view key, Texts& value, std::string_view meaning, Note note) {
    KeyValue read_value = value;
    if (read({key, KeyType::texts, meaning, note}, read_value)) value = std::get<Texts>(read_value);
}

void Fields::text_or_texts(std::string_view key, Texts& value, std::string_view meaning, Note note) {
    KeyValue read_value = value;
    if (read({key, KeyType::text_or_texts, meaning, note}, read_value)) value = std::get<Texts>(read_value);
}

void Fields::columns(std::string_view key, std::map<std::string, std::string>& value,
                     std::string_view meaning, Note note) {
    KeyValue read_value = value;
    if (read({key, KeyType::columns, meaning, note}, read_value))
        value = std::get<std::map<std::string, std::string>>(read_value);
}

void Fields::flag(std::string_view key, bool& value, std::string_view meaning, Note note) {
    KeyValue read_value = value;
    if (read({key, KeyType::flag, meaning, note}, read_value)) value = std::get<bool>(read_value);
}

bool Fields::numbers(const Key& key, Eigen::VectorXd& values, bool with_default) {
    KeyValue read_value;
    if (with_default) read_value = std::vector<double>(values.begin(), values.end());
    if (!read(key, read_value)) return false;
    const auto& given = std::get<std::vector<double>>(read_value);
    for (Eigen::Index i = 0; i < values.size(); ++i) values[i] = given[std::size_t(i)];
    return true;
}

bool Fields::one_of(const Key& key, std::size_t& chosen) {
    KeyValue read_value;
    if (chosen < key.words.size()) read_value = std::string(key.words[chosen]);
    if (!read(key, read_value)) return false;
    const auto& word = std::get<std::string>(read_value);
    for (chosen = 0; key.words[chosen] != word;) ++chosen;
    return true;
}

void Fields::require_direction(const Eigen::Vector3d& value, std::string_view key) const {
    require(value.norm() >= 1e-6, key, fmt::format("{} = [0, 0, 0]", key), "a direction");
}

std::string range_text(double low, double high) {
    return fmt::format("a number from {} to {}", low, high);
}

}  // namespace app
