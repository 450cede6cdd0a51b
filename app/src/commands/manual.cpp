#include "commands/manual.h"

#include <fmt/format.h>

#include <memory>

#include "commands/command.h"

namespace app {
namespace {

void collect(const CLI::App& app, const std::string& words, std::vector<DeclaredCommand>& found) {
    const std::size_t at = found.size();
    found.push_back({words, app.get_description(), {}, {}});
    for (const CLI::Option* o : app.get_options())
        if (!o->get_group().empty() && o != app.get_help_ptr())
            found[at].options.push_back({o->get_name(), o->get_type_name(), o->get_description(),
                                         o->get_required(), o->get_expected_max() > 1});
    for (const CLI::App* sub :
         app.get_subcommands([](const CLI::App* s) { return !s->get_group().empty(); })) {
        found[at].commands.push_back(sub->get_name());
        collect(*sub, found[at].words_of(sub->get_name()), found);
    }
}

/// Text of the roff language: no character of it is an order.
std::string roff(std::string_view text) {
    std::string safe = text.starts_with('.') || text.starts_with('\'') ? "\\&" : "";
    for (const char c : text) {
        if (c == '\\')
            safe += "\\e";
        else if (c == '-')
            safe += "\\-";
        else
            safe += c == '\n' ? ' ' : c;
    }
    return safe;
}

std::string manual_option(const DeclaredOption& option) {
    std::string title = fmt::format("\\fB{}\\fR", roff(option.name));
    if (!option.placeholder.empty()) title += fmt::format(" \\fI{}\\fR", roff(option.placeholder));
    if (option.several) title += " ...";
    if (option.required) title += " (required)";
    return fmt::format(".TP\n{}\n{}\n", title, roff(option.help));
}

std::string manual_section(const DeclaredCommand& command) {
    std::string text = fmt::format(".SS musicworld {}\n{}\n", roff(command.words), roff(command.help));
    for (const DeclaredOption& option : command.options) text += manual_option(option);
    return text;
}

constexpr std::string_view kManualEnd = R"(.SH ENVIRONMENT
.TP
\fBMUSICWORLD_ASSETS\fR
The folder of kits, scenes and traces, in place of the installed one.
.SH OUTPUTS
They are made beside their place, saved to the disk and renamed. Only regular files are replaced: symbolic links are
followed, devices and pipes written to. Inputs are regular files; a trace may be a pipe.
.SH EXIT STATUS
0: done; 1: failed while running, or plots or a video could not be made (all else is then in place); 2: bad usage or
bad input, with one line on standard error.
)";

std::string shell_quoted(std::string_view text) {
    std::string safe = "'";
    for (const char c : text) safe += c == '\'' ? std::string("'\\''") : std::string(1, c);
    return safe + "'";
}

/// A line "pattern|pattern) commands ;;" for each way an option's value is completed; `choices` and `files`
/// make the shell's commands.
template <class Choices>
std::string value_cases(const std::vector<DeclaredCommand>& commands, const Choices& choices,
                        const std::string& files) {
    std::string text;
    for (const DeclaredCommand& command : commands)
        for (const DeclaredOption& option : command.options)
            if (!option.argument() && !option.placeholder.empty())
                text += fmt::format("        {}) {}; return ;;\n",
                                    shell_quoted(command.words + ":" + option.name),
                                    option.choices().empty() ? files : choices(option.choices()));
    return text;
}

/// The lines that follow the words typed to the command that they name, in `at`.
std::string path_cases(const std::vector<DeclaredCommand>& commands) {
    std::string text;
    for (const DeclaredCommand& command : commands)
        for (const std::string& below : command.commands)
            text += fmt::format("            {}) at={} ;;\n", shell_quoted(command.words + ":" + below),
                                shell_quoted(command.words_of(below)));
    return text;
}

}  // namespace

std::vector<std::string> DeclaredOption::choices() const {
    if (placeholder.find('|') == std::string::npos) return {};
    return split(placeholder, '|');
}

std::vector<DeclaredCommand> declared_commands(const CLI::App& program) {
    std::vector<DeclaredCommand> found;
    collect(program, "", found);
    return found;
}

std::string format_manual(const std::vector<DeclaredCommand>& commands) {
    std::string text = fmt::format(
        ".TH MUSICWORLD 1 \"\" \"MusicWorld {}\" \"User Commands\"\n.SH NAME\nmusicworld \\- {}\n.SH "
        "SYNOPSIS\n"
        ".B musicworld\n.I COMMAND\n[options]\n.SH DESCRIPTION\nEach command tells its options with "
        "\\fB\\-\\-help\\fR. "
        "Numbers may be written as fractions: 1/15.\n",
        MUSICWORLD_VERSION, roff(commands.front().help.substr(commands.front().help.find(' ') + 1)));
    for (const DeclaredOption& option : commands.front().options) text += manual_option(option);
    text += ".SH COMMANDS\n";
    for (std::size_t i = 1; i < commands.size(); ++i) text += manual_section(commands[i]);
    return text.append(kManualEnd);
}

std::string format_bash_completion(const std::vector<DeclaredCommand>& commands) {
    const auto reply = [](const std::vector<std::string>& words) {
        return fmt::format("COMPREPLY=($(compgen -W {} -- \"$typed\"))",
                           shell_quoted(fmt::format("{}", fmt::join(words, " "))));
    };
    std::string text = fmt::format(R"(# Completion of musicworld for bash.
_musicworld() {{
    local at='' typed="${{COMP_WORDS[COMP_CWORD]}}" word
    COMPREPLY=()
    for word in "${{COMP_WORDS[@]:1:COMP_CWORD-1}}"; do
        case "$at:$word" in
{}        esac
    done
    case "$at:${{COMP_WORDS[COMP_CWORD-1]}}" in
{}    esac
    case "$at" in
)",
                                   path_cases(commands), value_cases(commands, reply, ":"));
    for (const DeclaredCommand& command : commands) {
        std::vector<std::string> words = command.commands;
        for (const DeclaredOption& option : command.options)
            if (!option.argument()) words.push_back(option.name);
        words.emplace_back("--help");
        text += fmt::format("        {}) {} ;;\n", shell_quoted(command.words), reply(words));
    }
    return text + "    esac\n}\ncomplete -o default -F _musicworld musicworld\n";
}

std::string format_zsh_completion(const std::vector<DeclaredCommand>& commands) {
    const auto add = [](const std::vector<std::string>& words) {
        return fmt::format("compadd -- {}", fmt::join(words, " "));
    };
    std::string text = fmt::format(R"(#compdef musicworld
_musicworld() {{
    local at='' word
    local -a entries
    for word in "${{(@)words[2,CURRENT-1]}}"; do
        case "$at:$word" in
{}        esac
    done
    case "$at:${{words[CURRENT-1]}}" in
{}    esac
    case "$at" in
)",
                                   path_cases(commands), value_cases(commands, add, "_files"));
    const auto entry = [](const std::string& name, const std::string& help) {
        return fmt::format("            {}\n", shell_quoted(name + ":" + help));
    };
    for (const DeclaredCommand& command : commands) {
        text += fmt::format("        {}) entries=(\n", shell_quoted(command.words));
        for (const DeclaredCommand& below : commands)
            for (const std::string& name : command.commands)
                if (below.words == command.words_of(name)) text += entry(name, below.help);
        for (const DeclaredOption& option : command.options)
            if (!option.argument()) text += entry(option.name, option.help);
        text += entry("--help", "Print the help") + "        ) ;;\n";
    }
    return text + "    esac\n    _describe musicworld entries\n    _files\n}\n_musicworld \"$@\"\n";
}

void add_manual_commands(Command& program, const CLI::App& tree) {
    Command manual = program.command("manual", "Print the manual page");
    manual->group("");
    manual.runs([&tree] { fmt::print("{}", format_manual(declared_commands(tree))); });
    Command completion = program.command("completion", "Print the completion of a shell");
    completion->group("");
    auto bash = std::make_shared<bool>(true);
    completion.required("SHELL", *bash, as::choice<bool>({{"bash", true}, {"zsh", false}}), "bash or zsh");
    completion.runs([bash, &tree] {
        const std::vector<DeclaredCommand> commands = declared_commands(tree);
        fmt::print("{}", *bash ? format_bash_completion(commands) : format_zsh_completion(commands));
    });
}

}  // namespace app
