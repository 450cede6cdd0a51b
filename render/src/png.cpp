#include <spng.h>

#include <cstdlib>
#include <memory>
#include <stdexcept>
#include <string>

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
    if (!context) throw std::runtime_error("PNG: error: found no memory, expected enough for an image");
    return context;
}

}  // namespace

std::vector<std::uint8_t> encode_png(const Image& image) {
    if (image.width <= 0 || image.height <= 0 ||
        image.rgb.size() !=
            std::size_t{3} * static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height)) {
        throw std::invalid_argument("encode_png: the image has not width x height x 3 bytes");
    }
    const Context context = make_context(SPNG_CTX_ENCODER);
    spng_set_option(context.get(), SPNG_ENCODE_TO_BUFFER, 1);
    spng_set_option(context.get(), SPNG_IMG_COMPRESSION_LEVEL, 1);
    spng_set_option(context.get(), SPNG_FILTER_CHOICE, SPNG_FILTER_CHOICE_SUB);
    spng_ihdr header{};
    header.width = static_cast<std::uint32_t>(image.width);
    header.height = static_cast<std::uint32_t>(image.height);
    header.bit_depth = 8;
    header.color_type = SPNG_COLOR_TYPE_TRUECOLOR;
    require(spng_set_ihdr(context.get(), &header));
    require(spng_encode_image(context.get(), image.rgb.data(), image.rgb.size(), SPNG_FMT_PNG,
                              SPNG_ENCODE_FINALIZE));
    std::size_t length = 0;
    int error = 0;
    const std::unique_ptr<void, void (*)(void*)> bytes(spng_get_png_buffer(context.get(), &length, &error),
                                                       std::free);
    require(error);
    const auto* first = static_cast<const std::uint8_t*>(bytes.get());
    return {first, first + length};
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
