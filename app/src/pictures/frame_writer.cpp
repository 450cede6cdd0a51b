#include "pictures/frame_writer.h"

#include <fmt/format.h>

#include <chrono>

#include "files/output_folder.h"

namespace app {
namespace {

using Clock = std::chrono::steady_clock;
double seconds_since(Clock::time_point start) {
    return std::chrono::duration<double>(Clock::now() - start).count();
}

}  // namespace

FrameWriter::FrameWriter(const render::SceneDescription& scene, const render::FrameState& rest,
                         std::filesystem::path folder)
    : folder_(std::move(folder)) {
    drawing_ = std::thread([this, scene, rest] { guard([&] { draw_all(scene, rest); }); });
    writing_ = std::thread([this] { guard([&] { write_all(); }); });
}

FrameWriter::~FrameWriter() {
    states_.close();
    images_.close();
    if (drawing_.joinable()) drawing_.join();
    if (writing_.joinable()) writing_.join();
}

void FrameWriter::guard(const std::function<void()>& work) {
    try {
        work();
    } catch (...) {
        const std::scoped_lock lock(error_mutex_);
        if (!error_) error_ = std::current_exception();
        states_.close();
    }
    images_.close();
}

void FrameWriter::rethrow() {
    const std::scoped_lock lock(error_mutex_);
    if (error_) std::rethrow_exception(error_);
}

void FrameWriter::draw_all(const render::SceneDescription& scene, const render::FrameState& rest) {
    render::Renderer renderer(scene);
    version_ = renderer.version();
    renderer.draw(rest, rest_image_);
    render::FrameState state;
    while (states_.pop(state)) {
        const Clock::time_point start = Clock::now();
        render::Image image;
        renderer.draw(state, image);
        draw_s_ += seconds_since(start);
        if (!images_.push(std::move(image))) return;
    }
}

void FrameWriter::write_all() {
    render::Image image;
    while (images_.pop(image)) {
        const Clock::time_point start = Clock::now();
        write_file(folder_ / fmt::format("{:06}.png", written_), render::encode_png(image));
        ++written_;
        write_s_ += seconds_since(start);
    }
}

void FrameWriter::push(render::FrameState frame) {
    if (!states_.push(std::move(frame))) rethrow();
}

void FrameWriter::finish() {
    states_.close();
    if (drawing_.joinable()) drawing_.join();
    if (writing_.joinable()) writing_.join();
    rethrow();
}

}  // namespace app
