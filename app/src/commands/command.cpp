#include "commands/command.h"

#include <fmt/format.h>

#include <algorithm>

namespace app {

Command::Command(CLI::App& app)
    : app_(&app), reads_(std::make_shared<std::vector<std::function<void()>>>()) {}

Command Command::under(const std::string& heading) const {
    Command same = *this;
    same.heading_ = heading;
    return same;
}

Command Command::command(const std::string& name, const std::string& help) {
    app_->require_subcommand(1);
    return Command(*app_->add_subcommand(name, help));
}

void Command::runs(std::function<void()> run) {
    app_->callback([reads = reads_, run = std::move(run)] {
        for (const std::function<void()>& read : *reads) read();
        run();
    });
}

void Command::checks(std::function<void()> check) {
    reads_->push_back(std::move(check));
}

CLI::Option* Command::declare(const std::string& name, const Declared& declared, const std::string& help,
                              Read read) {
    std::string about = declared.range;
    if (!declared.otherwise.empty())
        about += (about.empty() ? "default " : "; default ") + declared.otherwise;
    CLI::Option* option =
        app_->add_option(name, CLI::callback_t{}, about.empty() ? help : fmt::format("{} [{}]", help, about));
    const bool argument = !name.starts_with('-');
    option->group(argument && heading_ == "Options" ? option->get_group() : heading_);
    option->type_name(argument ? "" : declared.placeholder);
    if (declared.several) option->expected(1, CLI::detail::expected_max_vector_size)->allow_extra_args();
    reads_->push_back([option, read = std::move(read)] {
        if (option->count() > 0) read(option->results());
    });
    return option;
}

CLI::Option* Command::flag(const std::string& name, bool& target, const std::string& help, bool value) {
    CLI::Option* option = app_->add_flag(name, help);
    option->group(heading_);
    reads_->push_back([option, &target, value] {
        if (option->count() > 0 && option->as<bool>()) target = value;
    });
    return option;
}

std::vector<std::string> Command::given_but(const std::vector<std::string>& names) const {
    std::vector<std::string> arguments, options;
    for (const CLI::Option* option :
         app_->get_options([](const CLI::Option* each) { return each->count() > 0; })) {
        const std::vector<std::string>& words = option->results();
        if (!option->nonpositional()) {
            arguments.insert(arguments.end(), words.begin(), words.end());
            continue;
        }
        const std::string name = "--" + option->get_lnames().front();
        if (std::ranges::count(names, name) > 0) continue;
        if (option->get_items_expected_max() == 0) {  // a flag
            options.push_back(name);
        } else if (words.size() == 1) {
            options.push_back(name + "=" + words.front());
        } else {
            options.push_back(name);
            options.insert(options.end(), words.begin(), words.end());
        }
    }
    arguments.insert(arguments.end(), options.begin(), options.end());
    return arguments;
}

}  // namespace app
