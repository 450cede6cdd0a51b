#include "latency_products.h"

#include <array>

#include "latency_page.h"
#include "latency_tables.h"

namespace app {

std::span<const std::string_view> latency_products() {
    static constexpr std::array<std::string_view, 8> kProducts = {"latency.json", "samples.csv", "frames.csv",
                                                                  "notes.csv",    "blocks.csv",  "leads.csv",
                                                                  "errors.csv",   "report.html"};
    return kProducts;
}

void write_latency_products(OutputFolder& out, const LatencyReport& report, const PlayResult& play,
                            const RealtimeResult& realtime) {
    write_file(out.path("latency.json"), format_latency_json(report, play, realtime));
    write_file(out.path("samples.csv"), format_samples_csv(play, realtime));
    write_file(out.path("frames.csv"), format_frames_csv(realtime));
    write_file(out.path("notes.csv"), format_notes_csv(report, play, realtime));
    write_file(out.path("blocks.csv"), format_blocks_csv(realtime));
    write_file(out.path("leads.csv"), format_leads_csv(realtime));
    write_file(out.path("errors.csv"), format_errors_csv(report, play));
    write_file(out.path("report.html"), format_latency_page(report, play, realtime, out.scratch()));
}

}  // namespace app
