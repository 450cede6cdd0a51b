#include "trace/bsor_reader.h"
#include "trace/text_cursor.h"
#include "trace/xror_reader.h"
#include "tracking/import.h"
#include "tracking/trace.h"
#include "tracking/trace_rows.h"

namespace tracking {
namespace {

Trace read_rows(std::string_view text, const std::string& name) {
    LineReader lines(text, name);
    TraceRows rows(name, RowOrder::strict);
    std::vector<StickTrace> sticks;
    while (!lines.at_end()) {
        const Line line = lines.next();
        if (rows.headed() && trimmed(line.text()).empty()) {
            if (lines.only_blank_left()) break;
            line.fail(0, "an empty line", "a sample", "delete the line");
        }
        const std::optional<TraceRow> row = rows.take(line.text());
        if (!row) continue;
        if (row->stick == sticks.size()) sticks.push_back({std::string(row->name), {}});
        sticks[row->stick].samples.push_back(row->sample);
    }
    rows.require_complete();
    Trace trace = rows.keys();
    trace.file = name;
    trace.sticks = std::move(sticks);
    return trace;
}

}  // namespace

Trace parse_trace(std::string_view text, const std::string& name) {
    if (text.empty())
        Line(name, 1, text).fail(0, "an empty file", "a trace", "check that the trace is complete");
    if (is_bsor(text)) return parse_bsor(text, name);
    if (is_xror(text)) return parse_xror(text, name);
    if (is_c3d(text)) return read_markers(text, name, {});
    if (text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);
    return read_rows(text, name);
}

}  // namespace tracking
