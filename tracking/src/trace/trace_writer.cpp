#include <algorithm>
#include <charconv>
#include <limits>
#include <stdexcept>

#include "trace/text_cursor.h"
#include "tracking/trace.h"
#include "tracking/trace_rows.h"

namespace tracking {
namespace {

void append(std::string& out, double value) {
    char digits[32];
    out.append(digits, std::to_chars(digits, digits + sizeof digits, value).ptr);
}

void append_vector(std::string& out, const Eigen::Vector3d& v) {
    for (int axis = 0; axis < 3; ++axis) {
        if (axis > 0) out += ',';
        append(out, v[axis]);
    }
}

std::string axis_name(const Eigen::Vector3d& shaft) {
    for (int axis = 0; axis < 3; ++axis) {
        if (shaft == Eigen::Vector3d::Unit(axis)) return std::string("+") + "xyz"[axis];
        if (shaft == -Eigen::Vector3d::Unit(axis)) return std::string("-") + "xyz"[axis];
    }
    throw std::invalid_argument(
        "found a shaft that is not an axis of the body, expected one of +x, -x, +y, -y, +z, -z");
}

std::string format_keys(const Trace& trace) {
    if (first_unprintable(trace.source) != std::string::npos)
        throw std::invalid_argument(
            "found control characters in a trace's source, expected one line of text");
    std::string out = "# units: m\n# up: y\n";
    if (trace.rate_hz > 0) {
        out += "# rate_hz: ";
        append(out, trace.rate_hz);
        out += '\n';
    }
    if (const std::string_view source = trimmed(trace.source); !source.empty())
        out.append("# source: ").append(source) += '\n';
    if (trace.tip) {
        out += "# tip_m: ";
        append_vector(out, *trace.tip);
        out += '\n';
    }
    if (trace.shaft) out += "# shaft: " + axis_name(*trace.shaft) + "\n";
    return out;
}

void append_row(std::string& out, const std::string& stick, const PoseSample& sample, bool oriented) {
    append(out, sample.t_s);
    out += ',' + stick + ',';
    append_vector(out, sample.position);
    if (oriented && sample.has_orientation) {
        out += ',';
        append(out, sample.orientation.w());
        out += ',';
        append_vector(out, sample.orientation.vec());
    } else if (oriented) {
        out += ",,,,";
    }
    out += '\n';
}

void require_word(const std::string& name) {
    if (name.empty() || name.find_first_of(" \t,\"'") != std::string::npos ||
        first_unprintable(name) != std::string::npos)
        throw std::invalid_argument("found stick name " + in_quotes(name) +
                                    ", expected a word without blanks, commas or quotes");
}

}  // namespace

std::string format_trace_head(const Trace& keys, bool oriented) {
    return format_keys(keys) + (oriented ? "t,stick,px,py,pz,qw,qx,qy,qz\n" : "t,stick,px,py,pz\n");
}

void append_trace_row(std::string& text, const std::string& stick, const PoseSample& sample, bool oriented) {
    require_word(stick);
    append_row(text, stick, sample, oriented);
}

std::string format_trace(const Trace& trace) {
    // At equal times in the order in which a reader will come upon the sticks.
    std::vector<const StickTrace*> sticks;
    for (const StickTrace& stick : trace.sticks) sticks.push_back(&stick);
    std::ranges::stable_sort(sticks, {}, [](const StickTrace* s) {
        return s->samples.empty() ? std::numeric_limits<double>::infinity() : s->samples.front().t_s;
    });
    bool oriented = false;
    std::size_t rows = 0;
    for (const StickTrace& stick : trace.sticks) {
        require_word(stick.name);
        rows += stick.samples.size();
        oriented = oriented || std::any_of(stick.samples.begin(), stick.samples.end(),
                                           [](const PoseSample& sample) { return sample.has_orientation; });
    }
    std::string out = format_trace_head(trace, oriented);
    out.reserve(out.size() + rows * 160);
    std::vector<std::size_t> next(sticks.size(), 0);
    for (; rows > 0; --rows) {
        std::size_t first = sticks.size();
        for (std::size_t i = 0; i < sticks.size(); ++i) {
            if (next[i] == sticks[i]->samples.size()) continue;
            if (first == sticks.size() ||
                sticks[i]->samples[next[i]].t_s < sticks[first]->samples[next[first]].t_s)
                first = i;
        }
        append_row(out, sticks[first]->name, sticks[first]->samples[next[first]++], oriented);
    }
    return out;
}

}  // namespace tracking
