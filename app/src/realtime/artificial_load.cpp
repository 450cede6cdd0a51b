#include "realtime/artificial_load.h"

#include <fmt/format.h>

#include <cmath>
#include <limits>

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

struct Part {
    std::string kind;
    double amount, from_s, to_s;
};

Part parse_part(const std::string& text) {
    const std::size_t colon = text.find(':'), at = text.find('@');
    if (colon == std::string::npos || at == std::string::npos || at < colon) refuse(text);
    const std::size_t dash = text.find('-', at);
    const auto number = [](const std::string& part) { return as::number().parse(part, "--disturb"); };
    Part part{text.substr(0, colon), number(text.substr(colon + 1, at - colon - 1)),
              number(text.substr(at + 1, dash == std::string::npos ? dash : dash - at - 1)),
              dash == std::string::npos ? kEver : number(text.substr(dash + 1))};
    if (!(part.amount > 0 && part.amount <= 1e5 && part.from_s >= 0 && part.to_s > part.from_s)) refuse(text);
    return part;
}

}  // namespace

ArtificialLoad parse_disturbance(const std::string& text) {
    ArtificialLoad d;
    for (std::size_t begin = 0; begin < text.size();) {
        const std::size_t end = std::min(text.find(',', begin), text.size());
        const std::string piece = text.substr(begin, end - begin);
        const Part part = parse_part(piece);
        if (part.kind == "load" && part.amount <= kMostThreads) {
            d.load_threads = static_cast<int>(part.amount);
            d.load_from_s = part.from_s, d.load_to_s = part.to_s;
        } else if (part.kind == "renderer") {
            d.slower_s = part.amount / 1e3, d.slower_from_s = part.from_s, d.slower_to_s = part.to_s;
        } else if (part.kind == "stall") {
            d.stall_s = part.amount / 1e3, d.stall_at_s = part.from_s;
        } else {
            refuse(piece);
        }
        begin = end + 1;
    }
    return d;
}

BusyThreads::BusyThreads(const ArtificialLoad& d, std::int64_t epoch_ns) {
    for (int i = 0; i < d.load_threads; ++i)
        threads_.emplace_back([this, d, epoch_ns] {
            volatile double sink = 1;
            while (!end_) {
                const double now_s = to_s(monotonic_ns() - epoch_ns);
                if (now_s >= d.load_to_s) return;
                if (now_s < d.load_from_s)
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
