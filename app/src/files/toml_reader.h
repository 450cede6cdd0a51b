#pragma once
#include <toml++/toml.h>

#include <Eigen/Core>
#include <initializer_list>
#include <optional>
#include <string>
#include <vector>

namespace app {

/// Reads the keys of a stack of TOML tables (the first that has a key gives its value: an instrument, then
/// the defaults of its kind) and holds them to what is known: every value is checked where it is read, and
/// done() refuses keys that nobody asked for. All failures are BadInput with FILE:LINE:COLUMN. The tables
/// must outlive the reader.
class TomlReader {
public:
    /// `where` names the table in messages, e.g. "[[instrument]] snare".
    TomlReader(std::vector<const toml::table*> layers, std::string where);

    [[nodiscard]] bool has(std::string_view key) const { return get(key) != nullptr; }
    [[nodiscard]] bool is_array(std::string_view key) const { return has(key) && get(key)->is_array(); }
    [[nodiscard]] std::string text(std::string_view key, std::optional<std::string> fallback = {});
    [[nodiscard]] std::string choice(std::string_view key, std::initializer_list<std::string_view> allowed,
                                     std::optional<std::string> fallback = {});
    [[nodiscard]] double number(std::string_view key, double low, double high,
                                std::optional<double> fallback = {});
    /// A number, or a text with a fraction: "1/60".
    [[nodiscard]] double fraction(std::string_view key, double low, double high,
                                  std::optional<double> fallback = {});
    [[nodiscard]] int integer(std::string_view key, int low, int high, std::optional<int> fallback = {});
    [[nodiscard]] bool flag(std::string_view key, std::optional<bool> fallback = {});
    /// `size` numbers, each in [low, high].
    [[nodiscard]] Eigen::VectorXd numbers(std::string_view key, int size, double low, double high,
                                          std::optional<Eigen::VectorXd> fallback = {});
    [[nodiscard]] Eigen::Vector3d vector(std::string_view key, double low, double high,
                                         std::optional<Eigen::Vector3d> fallback = {});
    /// The table at a key, through all layers; an empty one where it is missing.
    [[nodiscard]] TomlReader table(std::string_view key);
    [[nodiscard]] std::vector<TomlReader> tables(std::string_view key);
    [[nodiscard]] std::vector<std::string> texts(std::string_view key);

    /// Refuses keys that were not read.
    void done() const;
    /// Throws BadInput at a key's place (at the table's when it is absent).
    [[noreturn]] void fail(std::string_view key, const std::string& found, const std::string& expected) const;

private:
    [[nodiscard]] const toml::node* get(std::string_view key) const;
    const toml::node* find(std::string_view key);
    [[noreturn]] void missing(std::string_view key, const std::string& expected) const;

    std::vector<const toml::table*> layers_;
    std::string where_;
    std::vector<std::string> read_;
};

/// "FILE:LINE:COLUMN: error: found F, expected E" as BadInput.
[[noreturn]] void fail_at(const toml::source_region& place, const std::string& found,
                          const std::string& expected);

}  // namespace app
