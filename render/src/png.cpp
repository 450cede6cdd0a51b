#include <isa-l/crc.h>
#include <isa-l/igzip_lib.h>
#include <spng.h>

#include <algorithm>
#include <memory>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>

#include "render/renderer.h"

namespace render {
namespace {

using Context = std::unique_ptr<spng_ctx, void (*)(spng_ctx*)>;
constexpr std::uint32_t kMaxSide = 16384;

void require(int error) {
    if (error != 0)
        throw std::runtime_error(std::string("PNG: error: found ") + spng_strerror(error) +
                                 ", expected an image");
}

Context make_context(int flags) {
    Context context(spng_ctx_new(flags), spng_ctx_free);
    if (!context) throw std::runtime_error("PNG: error: out of memory");
    return context;
}

void append_number(std::vector<std::uint8_t>& bytes, std::uint32_t value) {
    for (int shift = 24; shift >= 0; shift -= 8) bytes.push_back(static_cast<std::uint8_t>(value >> shift));
}

void append_chunk(std::vector<std::uint8_t>& png, std::string_view type, std::span<const std::uint8_t> data) {
    append_number(png, static_cast<std::uint32_t>(data.size()));
    const std::size_t start = png.size();
    png.insert(png.end(), type.begin(), type.end());
    png.insert(png.end(), data.begin(), data.end());
    append_number(png, crc32_gzip_refl(0, png.data() + start, png.size() - start));
}

/// Rows of the image, each after the number of its filter: 1, the difference to the pixel on the left.
std::vector<std::uint8_t> sub_filtered(const Image& image) {
    const std::size_t row = std::size_t{3} * static_cast<std::size_t>(image.width);
    std::vector<std::uint8_t> lines((row + 1) * static_cast<std::size_t>(image.height));
    for (std::size_t y = 0; y < static_cast<std::size_t>(image.height); ++y) {
        const std::uint8_t* from = image.rgb.data() + y * row;
        std::uint8_t* to = lines.data() + y * (row + 1);
        *to++ = 1;
        std::copy(from, from + 3, to);
        for (std::size_t i = 3; i < row; ++i) to[i] = static_cast<std::uint8_t>(from[i] - from[i - 3]);
    }
    return lines;
}

/// zlib stream by ISA-L, level 1: an image takes a tenth of zlib's time.
std::vector<std::uint8_t> compressed(std::vector<std::uint8_t> lines) {
    isal_zstream stream;
    isal_deflate_init(&stream);
    std::vector<std::uint8_t> work(ISAL_DEF_LVL1_DEFAULT);
    std::vector<std::uint8_t> out(lines.size() + lines.size() / 8 + 1024);
    stream.level = 1;
    stream.level_buf = work.data();
    stream.level_buf_size = static_cast<std::uint32_t>(work.size());
    stream.gzip_flag = IGZIP_ZLIB;
    stream.end_of_stream = 1;
    stream.flush = NO_FLUSH;
    stream.next_in = lines.data();
    stream.avail_in = static_cast<std::uint32_t>(lines.size());
    stream.next_out = out.data();
    stream.avail_out = static_cast<std::uint32_t>(out.size());
    if (isal_deflate(&stream) != COMP_OK || stream.avail_in != 0 || stream.internal_state.state != ZSTATE_END)
        throw std::runtime_error("PNG: error: cannot compress the image");
    out.resize(stream.total_out);
    return out;
}

}  // namespace

std::vector<std::uint8_t> encode_png(const Image& image) {
    if (image.width <= 0 || image.height <= 0 || image.width > static_cast<int>(kMaxSide) ||
        image.height > static_cast<int>(kMaxSide) ||
        image.rgb.size() !=
            std::size_t{3} * static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height)) {
        throw std::invalid_argument("encode_png: the image has not width x height x 3 bytes");
    }
    std::vector<std::uint8_t> png = {0x89, 'P', 'N', 'G', '\r', '\n', 0x1a, '\n'};
    std::vector<std::uint8_t> header;
    append_number(header, static_cast<std::uint32_t>(image.width));
    append_number(header, static_cast<std::uint32_t>(image.height));
    header.insert(header.end(), {8, 2, 0, 0, 0});  // 8 bits, RGB, deflate, adaptive filters, not interlaced
    append_chunk(png, "IHDR", header);
    append_chunk(png, "IDAT", compressed(sub_filtered(image)));
    append_chunk(png, "IEND", {});
    return png;
}

Image decode_png(const std::vector<std::uint8_t>& bytes) {
    const Context context = make_context(0);
    require(spng_set_image_limits(context.get(), kMaxSide, kMaxSide));
    require(spng_set_png_buffer(context.get(), bytes.data(), bytes.size()));
    spng_ihdr header{};
    require(spng_get_ihdr(context.get(), &header));
    std::size_t length = 0;
    require(spng_decoded_image_size(context.get(), SPNG_FMT_RGB8, &length));
    Image image{static_cast<int>(header.width), static_cast<int>(header.height),
                std::vector<std::uint8_t>(length)};
    require(spng_decode_image(context.get(), image.rgb.data(), length, SPNG_FMT_RGB8, 0));
    return image;
}

}  // namespace render
