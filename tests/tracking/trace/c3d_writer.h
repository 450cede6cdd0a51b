#pragma once
#include <bit>
#include <cmath>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace tracking {

/// Writes C3D files as the format's guide describes them (c3d.org).
struct C3dWriter {
    enum Processor { intel = 84, dec = 85, mips = 86 };

    Processor processor = intel;
    bool floating = true;
    double scale = 0.1;
    double rate_hz = 200;
    int first_frame = 1;
    std::string units = "mm", x_screen = "+X", y_screen = "+Z";
    std::vector<std::string> labels;
    int analog = 3;                                                         ///< words a frame
    std::vector<std::vector<std::optional<std::array<double, 3>>>> frames;  ///< of points; none: not seen
    std::optional<double> frames_said, long_frames;
    std::optional<double> points_said, data_start;  ///< as real numbers
    bool trial = false;

    [[nodiscard]] std::string bytes() const {
        const std::string parameters = parameter_section();
        std::string out(512, '\0');
        out[0] = 2, out[1] = 80;
        put(out, 2, word(static_cast<int>(labels.size())));
        put(out, 4, word(analog));
        put(out, 6, word(first_frame));
        put(out, 8, word(first_frame + static_cast<int>(frames.size()) - 1));
        put(out, 12, real(floating ? -scale : scale));
        put(out, 16, word(2 + static_cast<int>(parameters.size() / 512)));
        put(out, 20, real(rate_hz));
        out += parameters;
        for (const auto& frame : frames) {
            for (const auto& point : frame) {
                for (std::size_t i = 0; i < 3; ++i) out += coordinate(point ? (*point)[i] : 7);
                out += floating ? real(point ? 2 : -1) : word(point ? 2 : -1);
            }
            for (int i = 0; i < analog; ++i) out += floating ? real(1234.5) : word(1234);
        }
        return out;
    }

    [[nodiscard]] std::string word(int value) const {
        const auto low = static_cast<char>(value), high = static_cast<char>(value >> 8);
        return processor == mips ? std::string{high, low} : std::string{low, high};
    }
    /// DEC's F format: the exponent is greater by 2, and the high word comes first.
    [[nodiscard]] std::string real(double value) const {
        const auto bits =
            std::bit_cast<std::uint32_t>(static_cast<float>(processor == dec ? 4 * value : value));
        const std::string low = word(static_cast<int>(bits & 0xFFFFu)),
                          high = word(static_cast<int>(bits >> 16));
        return processor == intel ? low + high : high + low;
    }

private:
    static void put(std::string& out, std::size_t at, const std::string& what) {
        out.replace(at, what.size(), what);
    }

    [[nodiscard]] std::string coordinate(double value) const {
        return floating ? real(value) : word(static_cast<int>(std::lround(value / scale)));
    }
    [[nodiscard]] std::string entry(const std::string& name, int group, const std::string& content) const {
        return std::string{static_cast<char>(name.size()), static_cast<char>(group)} + name +
               word(static_cast<int>(content.size()) + 2) + content;
    }
    [[nodiscard]] std::string parameter(const std::string& name, int group, int type,
                                        const std::string& extents, const std::string& data) const {
        return entry(
            name, group,
            std::string{static_cast<char>(type), static_cast<char>(extents.size())} + extents + data + '\0');
    }
    [[nodiscard]] std::string text(const std::string& name, const std::string& value) const {
        return parameter(name, 1, -1, std::string(1, static_cast<char>(value.size())), value);
    }
    [[nodiscard]] std::string label_block(const std::string& name, std::size_t from, std::size_t to) const {
        std::string all;
        for (std::size_t i = from; i < to; ++i) all += labels[i] + std::string(12 - labels[i].size(), ' ');
        return parameter(name, 1, -1, {12, static_cast<char>(to - from)}, all);
    }
    [[nodiscard]] std::string parameter_section() const {
        const auto count = static_cast<double>(frames.size());
        std::string out{0, 0, 0, static_cast<char>(processor)};
        const std::string points = word(static_cast<int>(labels.size()));
        out += points_said ? parameter("USED", 1, 4, "", real(*points_said))
                           : parameter("USED", 1, 2, "", points);  // before its group
        out += entry("POINT", -1, std::string(1, '\0')) + entry("TRIAL", -2, std::string(1, '\0'));
        out += parameter("SCALE", 1, 4, "", real(floating ? -scale : scale));
        out += parameter("RATE", 1, 4, "", real(rate_hz));
        out += parameter("FRAMES", 1, 2, "", word(static_cast<int>(frames_said.value_or(count))));
        if (long_frames) out += parameter("LONG_FRAMES", 1, 4, "", real(*long_frames));
        if (data_start) out += parameter("DATA_START", 1, 4, "", real(*data_start));
        if (trial) {
            const int last = first_frame + static_cast<int>(frames.size()) - 1;
            out += parameter("ACTUAL_START_FIELD", 2, 2, std::string(1, 2), word(first_frame) + word(0));
            out += parameter("ACTUAL_END_FIELD", 2, 2, std::string(1, 2),
                             word(last & 0xFFFF) + word(last >> 16));
        }
        if (!units.empty()) out += text("UNITS", units);
        if (!x_screen.empty()) out += text("X_SCREEN", x_screen);
        if (!y_screen.empty()) out += text("Y_SCREEN", y_screen);
        out += label_block("LABELS", 0, std::min<std::size_t>(labels.size(), 255));
        if (labels.size() > 255) out += label_block("LABELS2", 255, labels.size());
        out += std::string(2, '\0');
        out += std::string(512 - out.size() % 512, '\0');
        out[2] = static_cast<char>(out.size() / 512);
        return out;
    }
};

}  // namespace tracking
