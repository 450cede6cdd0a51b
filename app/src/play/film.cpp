#include "play/film.h"

#include <render/renderer.h>
#include <tracking/input.h>

#include <algorithm>
#include <array>

namespace app {
namespace fs = std::filesystem;
namespace {

constexpr int kBar = 4;  // height of the bar [pixels]
using Pixel = std::array<std::uint8_t, 3>;
constexpr Pixel kBarPaint = {70, 78, 88}, kNowPaint = {245, 245, 245}, kStruckPaint = {43, 154, 72};

void fill(render::Image& image, int left, int right, int top, const Pixel& paint) {
    for (int y = top; y < image.height; ++y)
        for (int x = left; x < right; ++x)
            std::ranges::copy(paint, image.rgb.begin() + 3 * (std::ptrdiff_t{y} * image.width + x));
}

std::optional<render::Image> frame_of(const fs::path& file) {
    std::error_code error;
    if (!fs::exists(file, error)) return {};
    const std::string bytes = tracking::read_bytes(file.string(), "a picture");
    return render::decode_png({bytes.begin(), bytes.end()});
}

}  // namespace

std::uint64_t frame_number(const fs::path& file) {
    return std::stoull(file.stem().string());
}

render::Image scaled_down(const render::Image& image, int width, int height) {
    render::Image small{width, height, {}};
    small.rgb.reserve(std::size_t{3} * static_cast<std::size_t>(width * height));
    for (int y = 0; y < height; ++y) {
        const int top = y * image.height / height,
                  bottom = std::max(top + 1, (y + 1) * image.height / height);
        for (int x = 0; x < width; ++x) {
            const int left = x * image.width / width,
                      right = std::max(left + 1, (x + 1) * image.width / width);
            std::array<int, 3> sum{};
            for (int row = top; row < bottom; ++row)
                for (int column = left; column < right; ++column)
                    for (std::size_t c = 0; c < 3; ++c)
                        sum[c] += image.rgb[3 * (static_cast<std::size_t>(row) *
                                                     static_cast<std::size_t>(image.width) +
                                                 static_cast<std::size_t>(column)) +
                                            c];
            const int count = (bottom - top) * (right - left);
            for (const int value : sum) small.rgb.push_back(static_cast<std::uint8_t>(value / count));
        }
    }
    return small;
}

render::Image film_strip(const Film& film, int width, const PictureOf& picture_of) {
    render::Image strip;
    render::Image shown;
    const int count = static_cast<int>(film.files.size());
    for (int i = 0; i < count; ++i) {
        const fs::path& file = film.files[static_cast<std::size_t>(i)];
        std::optional<render::Image> frame = picture_of(file);
        if (!frame) frame = frame_of(file);
        if (frame) {
            const int shown_width = std::min(width, frame->width);
            shown = scaled_down(*frame, shown_width, std::max(1, frame->height * shown_width / frame->width));
        }
        if (shown.rgb.empty()) continue;  // none yet: black
        if (strip.rgb.empty()) {
            strip = {shown.width * count, shown.height + kBar, {}};
            strip.rgb.resize(std::size_t{3} * static_cast<std::size_t>(strip.width * strip.height));
        }
        const int left = i * shown.width, struck = static_cast<int>(film.struck);
        for (int y = 0; y < std::min(shown.height, strip.height - kBar); ++y)
            std::copy_n(shown.rgb.begin() + 3 * std::ptrdiff_t{y} * shown.width, 3 * shown.width,
                        strip.rgb.begin() + 3 * (std::ptrdiff_t{y} * strip.width + left));
        const auto share = [&](int k) { return left + k * shown.width / count; };
        fill(strip, left, left + shown.width, shown.height, kBarPaint);
        fill(strip, share(i), share(i + 1), shown.height, kNowPaint);
        fill(strip, share(struck), share(struck + 1), shown.height + (i == struck ? 0 : kBar / 2),
             kStruckPaint);
    }
    return strip;
}

}  // namespace app
