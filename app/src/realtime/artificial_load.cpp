#include "realtime/artificial_load.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>

#include "files/bad_input.h"
#include "files/option_values.h"
#include "process/clock.h"

namespace app {
namespace {

constexpr double kEver = std::numeric_limits<double>::infinity();
constexpr int kMostThreads = 256;

[[noreturn]] void refuse(const std::string& part) {
    throw BadInput(
        fmt::format("error: found --disturb {}, expected load:N@A-B, renderer:MS@A-B or stall:MS@A (seconds; "
                    "-B may be left out)",
                    part));
}

ArtificialLoad::Part& part_named(ArtificialLoad& load, const std::string& kind, const std::string& text) {
    if (kind == "load") return load.load;
    if (kind == "renderer") return load.renderer;
    if (kind == "stall") return load.stall;
    refuse(text);
}

void read_part(ArtificialLoad& load, const std::string& text) {
    const std::size_t colon = text.find(':'), at = text.find('@');
    if (colon == std::string::npos || at == std::string::npos || at < colon) refuse(text);
    const std::size_t dash = std::min(text.find('-', at), text.size());
    const auto number = [&](std::size_t begin, std::size_t end) {
        return as::number().parse(text.substr(begin, end - begin), "--disturb");
    };
    const ArtificialLoad::Part part{number(colon + 1, at), number(at + 1, dash),
                                    dash == text.size() ? kEver : number(dash + 1, text.size())};
    if (!(part.amount > 0 && part.amount <= 1e5 && part.from_s >= 0 && part.to_s > part.from_s)) refuse(text);
    part_named(load, text.substr(0, colon), text) = part;
    if (load.load.amount > kMostThreads) refuse(text);
}

}  // namespace

ArtificialLoad parse_artificial_load(const std::string& text) {
    ArtificialLoad load{.load = {}, .renderer = {}, .stall = {}, .text = text};
    std::istringstream parts(text);
    for (std::string part; std::getline(parts, part, ',');) read_part(load, part);
    return load;
}

BusyThreads::BusyThreads(const ArtificialLoad& load, std::int64_t epoch_ns) {
    for (int i = 0; i < static_cast<int>(load.load.amount); ++i)
        threads_.emplace_back([this, part = load.load, epoch_ns] {
            volatile double sink = 1;
            while (!end_) {
                const double now_s = to_s(monotonic_ns() - epoch_ns);
                if (now_s >= part.to_s) return;
                if (now_s < part.from_s)
                    std::this_thread::sleep_for(std::chrono::milliseconds(5));
                else
                    for (int k = 0; k < 10000; ++k) sink = std::sqrt(sink + k);
            }
        });
}

BusyThreads::~BusyThreads() {
    end_ = true;
    for (std::thread& thread : threads_) thread.join();
}

}  // namespace app
