#pragma once
#include <string>
#include <vector>

namespace CLI {
class App;
}

namespace app {

class Command;

/// What the program's help knows of an option.
struct DeclaredOption {
    std::string name;         ///< "--fps", or "TRACE" of an argument
    std::string placeholder;  ///< of its value; empty: a switch, or an argument
    std::string help;         ///< with range and default
    bool required = false, several = false;

    [[nodiscard]] bool argument() const { return !name.starts_with('-'); }
    /// Of a placeholder such as "on|off".
    [[nodiscard]] std::vector<std::string> choices() const;
};

/// A command by the words that follow the program's name: "", "play", "kit fit".
struct DeclaredCommand {
    std::string words, help;
    std::vector<std::string> commands;  ///< below it
    std::vector<DeclaredOption> options;

    /// Of a command below.
    [[nodiscard]] std::string words_of(const std::string& name) const {
        return words.empty() ? name : words + " " + name;
    }
};

/// The program's commands, itself first, but those that are hidden.
[[nodiscard]] std::vector<DeclaredCommand> declared_commands(const CLI::App& program);

/// The manual page musicworld(1), in roff.
[[nodiscard]] std::string format_manual(const std::vector<DeclaredCommand>& commands);
/// Scripts that complete commands, options and choices.
[[nodiscard]] std::string format_bash_completion(const std::vector<DeclaredCommand>& commands);
[[nodiscard]] std::string format_zsh_completion(const std::vector<DeclaredCommand>& commands);

/// Adds to the program the hidden commands `manual` and `completion bash|zsh`, which print these.
void add_manual_commands(Command& program, const CLI::App& tree);

}  // namespace app
