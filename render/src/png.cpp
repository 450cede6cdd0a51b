#include <isa-l/crc.h>
#include <isa-l/igzip_lib.h>
#include <spng.h>

#include <algorithm>
#include <memory>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>

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
void filter(const std::uint8_t* rgb, std::size_t row, std::size_t rows, std::vector<std::uint8_t>& lines) {
    lines.resize((row + 1) * rows);
    for (std::size_t y = 0; y < rows; ++y) {
        const std::uint8_t* from = rgb + y * row;
        std::uint8_t* to = lines.data() + y * (row + 1);
        *to++ = 1;
        std::copy(from, from + 3, to);
        for (std::size_t i = 3; i < row; ++i) to[i] = static_cast<std::uint8_t>(from[i] - from[i - 3]);
    }
}

/// Deflate blocks by ISA-L, level 1 (an image takes a tenth of zlib's time), that end at a byte and refer to nothing
/// before them; none is the last.
void compress(std::vector<std::uint8_t>& lines, std::vector<std::uint8_t>& work,
              std::vector<std::uint8_t>& out) {
    isal_zstream stream;
    isal_deflate_init(&stream);
    work.resize(ISAL_DEF_LVL1_DEFAULT);
    out.resize(lines.size() + lines.size() / 8 + 1024);
    stream.level = 1;
    stream.level_buf = work.data();
    stream.level_buf_size = static_cast<std::uint32_t>(work.size());
    stream.gzip_flag = IGZIP_DEFLATE;
    stream.end_of_stream = 0;
    stream.flush = FULL_FLUSH;
    stream.next_in = lines.data();
    stream.avail_in = static_cast<std::uint32_t>(lines.size());
    stream.next_out = out.data();
    stream.avail_out = static_cast<std::uint32_t>(out.size());
    if (isal_deflate(&stream) != COMP_OK || stream.avail_in != 0 || stream.avail_out == 0)
        throw std::runtime_error("PNG: error: cannot compress the image");
    out.resize(stream.total_out);
}

/// Of zlib (RFC 1950): of a and then b, where b is `length` bytes long.
std::uint32_t joined_adler(std::uint32_t a, std::uint32_t b, std::size_t length) {
    constexpr std::uint64_t kBase = 65521;
    const std::uint64_t low = a & 0xffff, high = a >> 16;
    const std::uint64_t sum = (low + (b & 0xffff) + kBase - 1) % kBase;
    const std::uint64_t sums = (high + (b >> 16) + (length % kBase) * (low + kBase - 1)) % kBase;
    return static_cast<std::uint32_t>(sums << 16 | sum);
}

}  // namespace

std::vector<std::uint8_t> PngEncoder::encode(Image image) {
    if (image.width <= 0 || image.height <= 0 || image.width > static_cast<int>(kMaxSide) ||
        image.height > static_cast<int>(kMaxSide) ||
        image.rgb.size() !=
            std::size_t{3} * static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height)) {
        throw std::invalid_argument("encode_png: the image has not width x height x 3 bytes");
    }
    const std::size_t row = std::size_t{3} * static_cast<std::size_t>(image.width);
    const auto height = static_cast<std::size_t>(image.height);
    const Image before = std::exchange(before_, {});
    const bool same_size = before.width == image.width && before.height == image.height;
    bands_.resize((height + kBandRows - 1) / kBandRows);
    std::vector<std::uint8_t> stream = {0x78, 0x01};  // of zlib: deflate, window of 32 KiB, fastest
    std::uint32_t adler = 1;
    for (std::size_t i = 0; i < bands_.size(); ++i) {
        Band& band = bands_[i];
        const std::size_t first = i * kBandRows, rows = std::min(kBandRows, height - first);
        const std::uint8_t* rgb = image.rgb.data() + first * row;
        if (!same_size || !std::equal(rgb, rgb + rows * row, before.rgb.data() + first * row)) {
            filter(rgb, row, rows, lines_);
            compress(lines_, work_, band.deflated);
            band.adler = isal_adler32(1, lines_.data(), lines_.size());
        }
        stream.insert(stream.end(), band.deflated.begin(), band.deflated.end());
        adler = joined_adler(adler, band.adler, (row + 1) * rows);
    }
    stream.insert(stream.end(), {0x03, 0x00});  // the last block, empty
    append_number(stream, adler);

    std::vector<std::uint8_t> png = {0x89, 'P', 'N', 'G', '\r', '\n', 0x1a, '\n'};
    png.reserve(stream.size() + 64);
    std::vector<std::uint8_t> header;
    append_number(header, static_cast<std::uint32_t>(image.width));
    append_number(header, static_cast<std::uint32_t>(image.height));
    header.insert(header.end(), {8, 2, 0, 0, 0});  // 8 bits, RGB, deflate, adaptive filters, not interlaced
    append_chunk(png, "IHDR", header);
    append_chunk(png, "IDAT", stream);
    append_chunk(png, "IEND", {});
    before_ = std::move(image);
    return png;
}

std::vector<std::uint8_t> encode_png(const Image& image) {
    return PngEncoder().encode(image);
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
