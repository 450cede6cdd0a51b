// Rows of samples that come from standard input or ZeroMQ: the first byte says how they are cut.
#include "fuzz_target.h"
#include "sensors/live_sources.h"

void fuzz_rows(std::string_view bytes) {
    if (bytes.empty()) return;
    const auto cut = static_cast<unsigned char>(bytes[0]);
    bytes.remove_prefix(1);
    const auto refused = [](const std::string& why) {
        require(why.find_first_of("\n\r") == why.npos, "a fault of several lines: " + why);
    };
    app::RowDecoder rows(
        "fuzz",
        [](const tracking::TraceRow& row) {
            require(row.sample.position.allFinite(), "a position that is none");
            require(row.stick < tracking::kMostLiveSticks, "too many sticks");
        },
        refused);
    if (cut % 2 != 0) rows.skip_line();
    if (cut < 128) return rows.message(bytes);
    while (!bytes.empty()) {
        const std::size_t size = std::min<std::size_t>(bytes.size(), 1 + cut % 64U);
        rows.piece(bytes.substr(0, size));
        bytes.remove_prefix(size);
    }
    rows.end();
    require(rows.head().size() <= 2000, "a head of more than 2000 bytes");
}
