#include "pictures/frame_thread.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>

#include "files/output_file.h"
#include "pictures/motion_blur.h"
#include "process/child_process.h"
#include "process/clock.h"
#include "process/thread_priority.h"
#include "statistics/statistics.h"

namespace app {
namespace fs = std::filesystem;
namespace {

constexpr int kTrialFrames = 8, kWarmFrames = 2;
constexpr double kLongestTrialS = 0.5;
constexpr std::size_t kStateBytes = std::size_t{1} << 26, kLeastJobs = 16, kMostJobs = 4096;  // waiting

/// How many frames may wait to be drawn whose states, as many as a blurred one has, are as large as this one.
std::size_t job_limit(const render::FrameState& state) {
    std::size_t bytes = sizeof(FrameJob) + state.world_from_object.size() * sizeof(Eigen::Matrix4f);
    for (const Eigen::VectorXf& modal : state.modal)
        bytes += sizeof modal + static_cast<std::size_t>(modal.size()) * sizeof(float);
    return std::clamp(kStateBytes / (bytes * kBlurMoments), kLeastJobs, kMostJobs);
}

/// Every pixel as wide and high as it takes, cut or padded to the size shown.
render::Image enlarged(render::Image small, int width, int height) {
    if (small.width == width) return small;
    const int times = (width + small.width - 1) / small.width;
    render::Image image{width, height, {}};
    image.rgb.resize(3 * static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
    auto to = image.rgb.begin();
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            const std::ptrdiff_t row = std::min(y / times, small.height - 1),
                                 column = std::min(x / times, small.width - 1);
            to = std::copy_n(small.rgb.begin() + 3 * (row * small.width + column), 3, to);
        }
    return image;
}

}  // namespace

FrameThread::FrameThread(std::vector<render::SceneDescription> scenes, const render::FrameState& rest,
                         FrameThreadOptions options)
    : options_(std::move(options)), jobs_(job_limit(rest)) {
    drawing_ =
        std::thread([this, scenes = std::move(scenes), rest] { run([&] { draw_all(scenes, rest); }); });
    writing_ = std::thread([this] { run([&] { write_all(); }); });
    if (options_.policy == FramePolicy::wait) return;
    ready_.wait(false);
    if (!failed_) return;
    join();
    rethrow();
}

FrameThread::~FrameThread() {
    pictures_.close();  // without finish(), what is still to be drawn is not needed
    join();
}

void FrameThread::join() {
    jobs_.close();
    if (drawing_.joinable()) drawing_.join();
    pictures_.close();
    if (writing_.joinable()) writing_.join();
}

void FrameThread::run(const std::function<void()>& work) {
    try {
        work();
        return;
    } catch (...) {
        const std::scoped_lock lock(error_mutex_);
        if (!error_) error_ = std::current_exception();
    }
    failed_ = true;
    jobs_.close();
    pictures_.close();
    ready_ = true;
    ready_.notify_one();
    written_ = std::numeric_limits<std::uint64_t>::max();
    written_.notify_one();
}

void FrameThread::rethrow() {
    if (!failed_) return;
    const std::scoped_lock lock(error_mutex_);
    std::rethrow_exception(error_);
}

void FrameThread::draw_all(const std::vector<render::SceneDescription>& scenes,
                           const render::FrameState& rest) {
    const bool refuses = options_.policy == FramePolicy::refuse;
    // The rasteriser's threads, started below, inherit it.
    if (refuses) report_.priority = set_thread_priority(ThreadRole::drawing, options_.realtime_priority);
    std::vector<std::unique_ptr<render::Renderer>> renderers;
    for (const render::SceneDescription& scene : scenes) {
        renderers.push_back(std::make_unique<render::Renderer>(scene));
        try_out(*renderers.back(), rest);
    }
    report_.version = renderers.front()->version();
    ready_ = true;
    ready_.notify_one();
    if (!refuses) return draw_in_turn(*renderers.front());
    FrameJob job;
    while (jobs_.pop(job)) draw_one(*renderers[std::min(job.level, renderers.size() - 1)], job);
}

/// A moment is begun before the picture of the one before it is taken, so that both are drawn at once; unless
/// nothing is at hand.
void FrameThread::draw_in_turn(render::Renderer& renderer) {
    std::optional<Moment> begun;
    LinearMean light;
    render::Image image;
    const auto take = [&] {
        Picture picture{begun->index, {}};
        if (begun->exposed) light.add(image);
        if (!begun->last) return true;
        picture.image = begun->exposed ? std::exchange(light, {}).mean() : std::exchange(image, {});
        return pictures_.push(std::move(picture));
    };
    const auto draw = [&](const render::FrameState& state) {
        const Stopwatch watch(report_.draw_s);
        return renderer.draw_next(state, image);
    };
    const auto finish = [&] {
        const Stopwatch watch(report_.draw_s);
        return renderer.finish(image);
    };
    for (FrameJob job;;) {
        if (!jobs_.try_pop(job)) {
            if (finish() && !take()) return;
            if (!jobs_.pop(job)) return;
        }
        const bool exposed = !job.earlier.empty();
        std::vector<render::FrameState> states = std::move(job.earlier);
        states.push_back(std::move(job.state));
        for (std::size_t i = 0; i < states.size(); ++i) {
            if (draw(states[i]) && !take()) return;  // the pictures are not wanted any more
            begun = {job.index, exposed, i + 1 == states.size()};
        }
    }
}

void FrameThread::try_out(render::Renderer& renderer, const render::FrameState& rest) {
    render::Image image;
    const WallTimer all;
    std::vector<double> times_s;
    const int frames = options_.policy == FramePolicy::refuse ? kWarmFrames + kTrialFrames : 1;
    for (int i = 0; i < frames && (times_s.empty() || all.seconds() < kLongestTrialS); ++i) {
        const WallTimer one;
        renderer.forget();  // a whole picture is the most that a frame may take
        renderer.draw(rest, image);
        if (i >= kWarmFrames) times_s.push_back(one.seconds());
    }
    if (!times_s.empty())
        report_.trial_s.push_back(quantile(times_s, 0.25));  // busy moments of the start aside
    if (report_.rest_image.rgb.empty()) report_.rest_image = std::move(image);
}

void FrameThread::draw_one(render::Renderer& renderer, const FrameJob& job) {
    DrawnFrame drawn{job.index, monotonic_ns()};
    if (job.slower_s > 0) std::this_thread::sleep_for(std::chrono::duration<double>(job.slower_s));
    Picture picture{job.index, {}};
    const render::DrawTimes times = renderer.draw(job.state, picture.image);
    drawn.drawn_ns = monotonic_ns(times.drawn);
    drawn.read_ns = monotonic_ns(times.read);
    drawn.in_time = drawn.read_ns <= job.shown_ns;
    report_.draw_s += to_s(drawn.read_ns - drawn.started_ns);
    if (drawn.in_time && !pictures_.try_push(std::move(picture))) ++report_.not_written;
    drawn_ = drawn;
    turn_ = Turn::done;
}

void FrameThread::write_all() {
    if (options_.policy == FramePolicy::refuse)
        set_thread_priority(ThreadRole::writing, options_.realtime_priority);
    render::PngEncoder encoder;
    Picture picture;
    while (pictures_.pop(picture)) {
        const Stopwatch watch(report_.write_s);
        picture.image = enlarged(std::move(picture.image), options_.width, options_.height);
        {
            const std::scoped_lock lock(kept_mutex_);
            if (const auto wanted = kept_.find(picture.index); wanted != kept_.end())
                wanted->second = picture.image;
        }
        write_file(options_.folder / fmt::format("{:06}.png", picture.index),
                   encoder.encode(std::move(picture.image)));
        report_.written.emplace_back(picture.index, monotonic_ns());
        // Not beyond the largest, which says that a thread has failed.
        std::uint64_t before = written_;
        while (before != std::numeric_limits<std::uint64_t>::max() &&
               !written_.compare_exchange_weak(before, before + 1)) {
        }
        written_.notify_one();
    }
}

bool FrameThread::push(FrameJob job) {
    rethrow();
    if (options_.policy == FramePolicy::refuse) {
        collect();
        if (turn_ != Turn::free) return false;
        turn_ = Turn::drawing;
    }
    if (!jobs_.push(std::move(job))) rethrow();
    ++pushed_;
    return true;
}

void FrameThread::wait_for(std::uint64_t count) {
    if (options_.policy == FramePolicy::wait)
        for (std::uint64_t now = written_; now < count && now < pushed_; now = written_) written_.wait(now);
    rethrow();
}

void FrameThread::keep_pictures(const std::vector<std::uint64_t>& frames) {
    const std::scoped_lock lock(kept_mutex_);
    for (const std::uint64_t frame : frames) kept_.try_emplace(frame);
}

std::optional<render::Image> FrameThread::take_picture(std::uint64_t frame) {
    wait_for(frame + 1);
    const std::scoped_lock lock(kept_mutex_);
    const auto kept = kept_.extract(frame);
    return kept.empty() ? std::nullopt : std::move(kept.mapped());
}

/// The timing of the frame that was drawn last, unless it was taken already.
void FrameThread::collect() {
    if (turn_ != Turn::done) return;
    done_.push_back(drawn_);
    turn_ = Turn::free;
}

std::vector<DrawnFrame> FrameThread::take_done() {
    rethrow();
    collect();
    return std::exchange(done_, {});
}

void FrameThread::finish() {
    join();
    rethrow();
}

void require_ffmpeg() {
    require_program("ffmpeg", "the video; install the package ffmpeg");
}

std::unique_ptr<OutputFile> make_video(const fs::path& video, double fps, std::size_t held, bool sound,
                                       const fs::path& staging) {
    auto made = std::make_unique<OutputFile>(video);
    std::vector<std::string> command = {"ffmpeg", "-nostdin", "-loglevel", "error", "-y", "-framerate"};
    command.insert(command.end(), {fmt::format("{}", fps), "-i", (staging / "frames" / "%06d.png").string()});
    if (sound) command.insert(command.end(), {"-i", (staging / "audio.wav").string(), "-c:a", "aac"});
    if (held > 0) command.insert(command.end(), {"-vf", fmt::format("tpad=stop_mode=clone:stop={}", held)});
    command.insert(command.end(), {"-c:v", "libx264", "-preset", "veryfast", "-pix_fmt", "yuv420p", "-fflags",
                                   "+bitexact", "-f", "mp4", made->partial().string()});
    run_child(command, staging / "scratch" / "ffmpeg.log");
    return made;
}

}  // namespace app
