#pragma once
#include <CLI/CLI.hpp>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "files/option_values.h"

namespace app {

/// What a command ends with in place of 0, where it has printed the reason itself.
struct ExitStatus {
    int status;
};

/// A command of the program, on top of CLI11. Each option is declared once: name, variable, format with range
/// and unit, help; the help text then also states range and default (the variable's value at that time). The
/// texts are read into the variables when the command runs, in the order of declaration: a value that cannot
/// be is refused as BadInput "error: found --fps 0, expected ..." after all misspelt names and missing options.
/// The variables must live until then; runs() keeps them by what its function holds.
class Command {
public:
    /// The program itself, or one of its commands.
    explicit Command(CLI::App& app);

    /// The same command; what is declared through it stands under a heading of its own in the help.
    [[nodiscard]] Command under(const std::string& heading) const;
    /// A command below this one, of which one is then required.
    [[nodiscard]] Command command(const std::string& name, const std::string& help);
    /// CLI11's own: group("") hides a command from the help.
    [[nodiscard]] CLI::App* operator->() const { return app_; }

    /// What it does once its options are read.
    void runs(std::function<void()> run);
    /// Is called after the options declared so far are read: for what they cannot be together. Throws BadInput.
    void checks(std::function<void()> check);

    /// An option `--name` or an argument `NAME` of one word; `take` gets its value.
    template <class Value>
    CLI::Option* option(const std::string& name, const ValueFormat<Value>& format, const std::string& help,
                        std::function<void(Value)> take, const std::string& otherwise = "") {
        return declare(name, {format.placeholder, format.range, otherwise, false}, help,
                       [name, format, take = std::move(take)](const std::vector<std::string>& words) {
                           take(format.parse(words.front(), name));
                       });
    }
    /// The same into a variable, or an std::optional, of a type that the value converts to.
    template <class Value, class Target>
    CLI::Option* option(const std::string& name, Target& target, const ValueFormat<Value>& format,
                        const std::string& help) {
        return option<Value>(
            name, format, help, [&target](Value value) { target = static_cast<Target>(std::move(value)); },
            shown(target, format));
    }
    template <class Value, class Target>
    CLI::Option* required(const std::string& name, Target& target, const ValueFormat<Value>& format,
                          const std::string& help) {
        return option(name, target, format, help)->required();
    }
    /// One word or more, each a value.
    template <class Value, class Target>
    CLI::Option* options(const std::string& name, std::vector<Target>& targets,
                         const ValueFormat<Value>& format, const std::string& help) {
        return declare(name, {format.placeholder, format.range, "", true}, help,
                       [name, format, &targets](const std::vector<std::string>& words) {
                           targets.clear();
                           for (const std::string& word : words)
                               targets.push_back(Target(format.parse(word, name)));
                       });
    }
    /// A switch that sets `target` to `value`.
    CLI::Option* flag(const std::string& name, bool& target, const std::string& help, bool value = true);

    /// The words that were given, so that they mean the same again: arguments, then options in the order of their
    /// declaration, but those of these names.
    [[nodiscard]] std::vector<std::string> given_but(const std::vector<std::string>& names) const;

private:
    struct Declared {
        std::string placeholder, range, otherwise;
        bool several;
    };
    using Read = std::function<void(const std::vector<std::string>&)>;
    CLI::Option* declare(const std::string& name, const Declared& declared, const std::string& help,
                         Read read);

    template <class Target, class Value>
    static std::string shown(const std::optional<Target>& target, const ValueFormat<Value>& format) {
        return target ? shown(*target, format) : "";
    }
    template <class Target, class Value>
    static std::string shown(const Target& target, const ValueFormat<Value>& format) {
        if constexpr (std::is_convertible_v<Target, std::string>)
            return target;
        else
            return format.write ? format.write(Value(target)) : "";
    }

    CLI::App* app_;
    std::string heading_ = "Options";
    std::shared_ptr<std::vector<std::function<void()>>> reads_;  // in the order of declaration
};

}  // namespace app
