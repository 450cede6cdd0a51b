#include "commands/manual.h"

#include <gtest/gtest.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <set>
#include <sstream>

#include "command_line.h"
#include "temporary_folder.h"

namespace app {
namespace {

/// The declared commands of musicworld.
std::vector<DeclaredCommand> musicworld() {
    CLI::App tree("MusicWorld", "musicworld");
    add_commands(tree);
    return declared_commands(tree);
}

/// Every command and option that CLI11 itself knows, but hidden ones: "play --fps", "trace info TRACE".
void known(const CLI::App& app, const std::string& words, std::set<std::string>& names) {
    for (const CLI::Option* option : app.get_options())
        if (!option->get_group().empty() && option != app.get_help_ptr())
            names.insert(words + " " + option->get_name());
    for (const CLI::App* sub : app.get_subcommands(nullptr)) {
        if (sub->get_group().empty()) continue;
        const std::string below = words.empty() ? sub->get_name() : words + " " + sub->get_name();
        names.insert(below);
        known(*sub, below, names);
    }
}

std::string without(std::string text, const std::string& part) {
    for (std::size_t at; (at = text.find(part)) != std::string::npos;) text.erase(at, part.size());
    return text;
}

TEST(Manual, HasEveryCommandAndOption) {
    CLI::App tree("MusicWorld", "musicworld");
    add_commands(tree);
    std::set<std::string> names, found;
    known(tree, "", names);
    ASSERT_TRUE(names.contains("play --fps") && names.contains("trace convert --noise"));
    std::istringstream lines(format_manual(musicworld()));
    std::string section, line;
    bool title = false;
    while (std::getline(lines, line)) {
        line = without(line, "\\");
        if (line.starts_with(".SS musicworld ")) found.insert(section = line.substr(15));
        if (title) found.insert(section + " " + line.substr(2, line.find("fR") - 2));
        title = line == ".TP";
    }
    for (const std::string& name : names) EXPECT_TRUE(found.contains(name)) << name;
}

TEST(Manual, IsRoffWhoseLinesAreOrdersItKnowsOrPlainText) {
    const std::set<std::string> orders = {".SH", ".SS", ".TP", ".B", ".I"};
    std::istringstream lines(format_manual(musicworld()));
    std::string line;
    std::getline(lines, line);
    EXPECT_TRUE(line.starts_with(".TH MUSICWORLD 1 ")) << line;
    while (std::getline(lines, line)) {
        const bool order = line.starts_with('.');
        EXPECT_TRUE(!order || orders.contains(line.substr(0, line.find(' ')))) << line;
        EXPECT_FALSE(line.starts_with('\'')) << line;
        for (std::size_t at = 0; (at = line.find('\\', at)) != std::string::npos; at += 2)
            EXPECT_NE(std::string("-e&f").find(line.at(at + 1)), std::string::npos) << line;
    }
    if (std::system("command -v groff > /dev/null") != 0) return;  // it would say more
    const TemporaryFolder folder;
    folder.write("musicworld.1", format_manual(musicworld()));
    const std::string check = "groff -man -ww -Tascii " + (folder.path() / "musicworld.1").string() +
                              " 2>&1 >/dev/null | grep -q .";
    EXPECT_NE(std::system(check.c_str()), 0) << "groff warns";
}

/// What the script for bash proposes for these words, the last one being typed.
std::string completed(const TemporaryFolder& folder, const std::string& words) {
    const std::string command = "bash -c '. " + (folder.path() / "completion").string() +
                                "; COMP_WORDS=(musicworld " + words +
                                "); COMP_CWORD=$((${#COMP_WORDS[@]}-1)); _musicworld; echo ${COMPREPLY[@]}'";
    std::FILE* pipe = ::popen(command.c_str(), "r");
    std::string text;
    for (int c; (c = std::fgetc(pipe)) != EOF;) text += static_cast<char>(c);
    ::pclose(pipe);
    return text;
}

TEST(Completion, OfBashProposesEveryCommandOptionAndChoice) {
    const TemporaryFolder folder;
    folder.write("completion", format_bash_completion(musicworld()));
    for (const DeclaredCommand& command : musicworld()) {
        const std::string proposed = " " + without(completed(folder, command.words + " \"\""), "\n") + " ";
        for (const std::string& below : command.commands)
            EXPECT_NE(proposed.find(" " + below + " "), std::string::npos) << command.words << ": " << below;
        for (const DeclaredOption& option : command.options)
            EXPECT_TRUE(option.argument() || proposed.find(" " + option.name + " ") != std::string::npos)
                << command.words << ": " << option.name;
    }
    EXPECT_EQ(completed(folder, "play roll --lead a"), "auto\n");
    EXPECT_EQ(completed(folder, "kit fi"), "fit\n");
    EXPECT_EQ(completed(folder, "play --kit \"\""), "\n");  // files, by the shell
}

TEST(Completion, OfZshHasEveryCommandAndOptionWithItsHelp) {
    const std::string script = format_zsh_completion(musicworld());
    EXPECT_TRUE(script.starts_with("#compdef musicworld\n"));
    for (const DeclaredCommand& command : musicworld()) {
        const std::size_t begin = script.find("        '" + command.words + "') entries=(");
        ASSERT_NE(begin, std::string::npos) << command.words;
        const std::string entries = script.substr(begin, script.find(" ;;", begin) - begin);
        for (const std::string& below : command.commands)
            EXPECT_NE(entries.find("'" + below + ":"), std::string::npos) << below;
        for (const DeclaredOption& option : command.options)
            EXPECT_TRUE(option.argument() || entries.find("'" + option.name + ":") != std::string::npos)
                << option.name;
    }
    EXPECT_NE(script.find("'play:--lead') compadd -- fixed auto; return ;;"), std::string::npos);
}

}  // namespace
}  // namespace app
