#include "commands/command.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>

namespace app {

Option& Option::required() {
    option_->required();
    return *this;
}

Option& Option::expected(int words) {
    option_->expected(words);
    return *this;
}

Option& Option::excludes(const Option& other) {
    option_->excludes(other.option_);
    return *this;
}

Option& Option::needs(const Option& other) {
    option_->needs(other.option_);
    return *this;
}

Option& Option::group(const std::string& heading) {
    option_->group(heading);
    return *this;
}

bool Option::given() const {
    return option_->count() > 0;
}

std::string Option::name() const {
    return option_->get_name();
}

Command::Command(CLI::App& app)
    : app_(&app), reads_(std::make_shared<std::vector<std::function<void()>>>()) {}

Command Command::command(const std::string& name, const std::string& help) {
    app_->require_subcommand(1);
    return Command(*app_->add_subcommand(name, help));
}

Command& Command::hidden() {
    app_->group("");
    return *this;
}

void Command::runs(std::function<void()> run) {
    app_->callback([reads = reads_, run = std::move(run)] {
        for (const std::function<void()>& read : *reads) read();
        run();
    });
}

void Command::hands_on(std::function<void(std::vector<std::string>)> run) {
    app_->prefix_command();
    app_->set_help_flag();
    app_->callback([app = app_, run = std::move(run)] { run(app->remaining()); });
}

void Command::checks(std::function<void()> check) {
    reads_->push_back(std::move(check));
}

Option Command::declare(const std::string& name, const Declared& declared, const std::string& help,
                        Read read) {
    std::string about = declared.range;
    if (!declared.otherwise.empty())
        about += (about.empty() ? "default " : "; default ") + declared.otherwise;
    CLI::Option* option =
        app_->add_option(name, CLI::callback_t{}, about.empty() ? help : fmt::format("{} [{}]", help, about));
    const bool argument = !name.starts_with('-');
    option->type_name(argument ? "" : declared.placeholder);
    if (declared.several) option->expected(1, CLI::detail::expected_max_vector_size)->allow_extra_args();
    reads_->push_back([option, read = std::move(read)] {
        if (option->count() > 0) read(option->results());
    });
    return Option(option);
}

Option Command::flag(const std::string& name, bool& target, const std::string& help, bool value) {
    CLI::Option* option = app_->add_flag(name, help);
    reads_->push_back([option, &target, value] {
        if (option->count() > 0 && option->as<bool>()) target = value;
    });
    return Option(option);
}

}  // namespace app
