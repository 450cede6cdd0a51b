// The tables of messages in docs/formats.md are made from the messages' declarations.
#include "message_table.h"

#include <gtest/gtest.h>

#include <fstream>
#include <iterator>
#include <utility>

namespace {

using sim_test::FieldTable;

template <std::size_t I>
std::string message_row(FieldTable::Parts& parts) {
    using Message = std::variant_alternative_t<I, sim::WorkerMessage>;
    Message message{};
    return "| " + std::to_string(I + 1) + " `" + sim_test::type_name<Message>() + "` | " + Message::kRoute +
           " | " + FieldTable::row(message, parts) + " |\n";
}

std::string message_tables() {
    FieldTable::Parts parts;
    std::string text = "| Message | From, to | Fields | Bytes |\n|---|---|---|---|\n";
    [&]<std::size_t... I>(std::index_sequence<I...>) {
        ((text += message_row<I>(parts)), ...);
    }
    (std::make_index_sequence<std::variant_size_v<sim::WorkerMessage>>());
    text += "\n| Part | Fields | Bytes |\n|---|---|---|\n";
    for (const auto& [name, row] : parts) text += "| `" + name + "` | " + row + " |\n";
    return text;
}

TEST(MessageTable, InTheDocumentationIsWhatTheMessagesDeclare) {
    std::ifstream file(MUSICWORLD_SOURCE_DIR "/docs/formats.md");
    const std::string page{std::istreambuf_iterator<char>(file), {}};
    EXPECT_TRUE(page.find(message_tables()) != page.npos)
        << "the tables of messages in docs/formats.md are out of date; they are:\n\n"
        << message_tables();
}

}  // namespace
