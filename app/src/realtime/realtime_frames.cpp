#include "realtime/realtime_frames.h"

#include <fmt/format.h>

#include <algorithm>

#include "files/output_folder.h"
#include "process/clock.h"
#include "process/thread_priority.h"
#include "statistics/statistics.h"

namespace app {
namespace {

constexpr int kTrialFrames = 8, kWarmFrames = 2;
constexpr int kMostWaiting = 8;
constexpr int kTries = 5;
constexpr double kLongestTrialS = 0.5;

/// Every pixel `times` as wide and high, cut or padded to the size shown.
render::Image enlarged(const render::Image& small, int width, int height, int times) {
    if (times == 1) return small;
    render::Image image{width, height, {}};
    image.rgb.resize(3 * static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            const int from_x = std::min(x / times, small.width - 1),
                      from_y = std::min(y / times, small.height - 1);
            const auto to = 3 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
                                 static_cast<std::size_t>(x));
            const auto from = 3 * (static_cast<std::size_t>(from_y) * static_cast<std::size_t>(small.width) +
                                   static_cast<std::size_t>(from_x));
            std::copy_n(small.rgb.begin() + static_cast<std::ptrdiff_t>(from), 3,
                        image.rgb.begin() + static_cast<std::ptrdiff_t>(to));
        }
    return image;
}

}  // namespace

RealtimeFrames::RealtimeFrames(std::vector<render::SceneDescription> scenes, const render::FrameState& rest,
                               int width, int height, std::filesystem::path folder, bool realtime)
    : width_(width), height_(height), folder_(std::move(folder)), realtime_(realtime) {
    drawing_ =
        std::thread([this, scenes = std::move(scenes), rest] { guard([&] { draw_all(scenes, rest); }); });
    writing_ = std::thread([this] { guard([&] { write_all(); }); });
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return ready_ || error_; });
    if (!error_) return;
    const std::exception_ptr error = error_;
    lock.unlock();
    images_.close();
    drawing_.join();
    writing_.join();
    std::rethrow_exception(error);
}

RealtimeFrames::~RealtimeFrames() {
    join();
}

void RealtimeFrames::join() {
    {
        const std::scoped_lock lock(mutex_);
        end_ = true;
        changed_.notify_all();
    }
    if (drawing_.joinable()) drawing_.join();
    images_.close();
    if (writing_.joinable()) writing_.join();
}

void RealtimeFrames::guard(const std::function<void()>& work) {
    try {
        work();
    } catch (...) {
        const std::scoped_lock lock(mutex_);
        if (!error_) error_ = std::current_exception();
        changed_.notify_all();
    }
}

void RealtimeFrames::rethrow() {
    const std::scoped_lock lock(mutex_);
    if (error_) std::rethrow_exception(error_);
}

void RealtimeFrames::start(std::int64_t epoch_ns, const ArtificialLoad& disturbance) {
    const std::scoped_lock lock(mutex_);
    epoch_ns_ = epoch_ns;
    disturbance_ = disturbance;
}

void RealtimeFrames::draw_all(const std::vector<render::SceneDescription>& scenes,
                              const render::FrameState& rest) {
    // The rasteriser's threads, started below, inherit it.
    priority_ = set_thread_priority(ThreadRole::drawing, realtime_);
    Renderers renderers;
    for (const render::SceneDescription& scene : scenes) {
        renderers.push_back(std::make_unique<render::Renderer>(scene));
        std::vector<double> times;
        render::Image image;
        const auto begun = std::chrono::steady_clock::now();
        for (int i = 0; i < kWarmFrames + kTrialFrames; ++i) {
            if (!times.empty() &&
                std::chrono::duration<double>(std::chrono::steady_clock::now() - begun).count() >
                    kLongestTrialS)
                break;
            const auto start = std::chrono::steady_clock::now();
            const render::DrawTimes drawn = renderers.back()->draw(rest, image);
            if (i >= kWarmFrames) times.push_back(std::chrono::duration<double>(drawn.read - start).count());
        }
        trial_s_.push_back(quantile(std::move(times), 0.25));  // busy moments of the start aside
        if (rest_image_.rgb.empty()) rest_image_ = image;
    }
    version_ = renderers.front()->version();
    std::unique_lock lock(mutex_);
    ready_ = true;
    changed_.notify_all();
    for (;;) {
        changed_.wait(lock, [&] { return end_ || job_; });
        if (!job_) return;
        FrameJob job = std::move(*job_);
        job_.reset();
        lock.unlock();
        draw_one(renderers, job);
        lock.lock();
        done_.push_back(job.timing);
        busy_ = false;
        changed_.notify_all();
    }
}

void RealtimeFrames::draw_one(Renderers& renderers, FrameJob& job) {
    FrameTiming& timing = job.timing;
    timing.started_ns = monotonic_ns() - epoch_ns_;
    const auto level = static_cast<std::size_t>(timing.quality);
    const std::size_t renderer = std::min(level, renderers.size() - 1);
    if (const double slower_s = disturbance_.slower_at(static_cast<double>(timing.started_ns) / 1e9);
        slower_s > 0)
        std::this_thread::sleep_for(std::chrono::duration<double>(slower_s));
    render::Image image;
    const render::DrawTimes times = renderers[renderer]->draw(job.state, image);
    timing.drawn_ns = monotonic_ns(times.drawn) - epoch_ns_;
    timing.read_ns = monotonic_ns(times.read) - epoch_ns_;
    draw_s_ += static_cast<double>(timing.read_ns - timing.started_ns) / 1e9;
    timing.fate = timing.read_ns <= timing.shown_ns ? FrameFate::in_time : FrameFate::late;
    if (timing.fate == FrameFate::late) return;
    if (waiting_images_.load() >= kMostWaiting) {
        ++not_written_;
        return;
    }
    ++waiting_images_;
    (void)images_.push({timing.index, std::move(image)});
}

void RealtimeFrames::write_all() {
    set_thread_priority(ThreadRole::writing, realtime_);
    Finished finished;
    while (images_.pop(finished)) {
        const std::int64_t start = monotonic_ns();
        const render::Image& drawn = finished.image;
        const int times = drawn.width == width_ ? 1 : (width_ + drawn.width - 1) / drawn.width;
        write_file(folder_ / fmt::format("{:06}.png", finished.index),
                   render::encode_png(enlarged(drawn, width_, height_, times)));
        --waiting_images_;
        const std::int64_t end = monotonic_ns();
        write_s_ += static_cast<double>(end - start) / 1e9;
        written_.emplace_back(finished.index, end - epoch_ns_);
    }
}

bool RealtimeFrames::offer(FrameJob job) {
    const std::unique_lock lock = try_to_lock();
    if (!lock) return false;
    if (error_) std::rethrow_exception(error_);
    if (busy_) return false;
    busy_ = true;
    job_ = std::move(job);
    changed_.notify_all();
    return true;
}

/// The drawing thread gives way to all others, also while it holds the lock: whoever is in time does not wait
/// for it.
std::unique_lock<std::mutex> RealtimeFrames::try_to_lock() {
    std::unique_lock lock(mutex_, std::defer_lock);
    for (int i = 0; i < kTries && !lock.try_lock(); ++i)
        std::this_thread::sleep_for(std::chrono::microseconds(20));
    return lock;
}

std::vector<FrameTiming> RealtimeFrames::take_done() {
    const std::unique_lock lock = try_to_lock();
    if (!lock) return {};
    if (error_) std::rethrow_exception(error_);
    return std::exchange(done_, {});
}

void RealtimeFrames::finish() {
    join();
    rethrow();
}

}  // namespace app
