#pragma once
#include <render/renderer.h>

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "latency/realtime_result.h"
#include "pictures/frame_writer.h"
#include "realtime/artificial_load.h"

namespace app {

/// A frame that is to be on the screen at a time of CLOCK_MONOTONIC.
struct FrameJob {
    FrameTiming timing;  ///< index, lead, quality, ages and query filled in; times since the epoch
    render::FrameState state;
};

/// Frames in real time: drawn one at a time on a thread that owns the renderers (one a quality level), so
/// none ever waits for another: a frame that comes while one is being drawn is refused, and one that is ready
/// after it was due is dropped. Frames in time are encoded and written as FOLDER/000000.png (index) on
/// another thread; where that falls behind by 8, frames are not written, and counted.
class RealtimeFrames {
public:
    /// `scenes`: one a quality level, all of `width` x `height` when shown. Draws each a few times: warm-up
    /// and the trial. Waits until that is done; throws what went wrong.
    RealtimeFrames(std::vector<render::SceneDescription> scenes, const render::FrameState& rest, int width,
                   int height, std::filesystem::path folder, bool realtime);
    ~RealtimeFrames();
    RealtimeFrames(const RealtimeFrames&) = delete;
    RealtimeFrames& operator=(const RealtimeFrames&) = delete;

    void start(std::int64_t epoch_ns, const ArtificialLoad& disturbance);
    /// False: the thread is still busy with the one before. Waits 0.1 ms at the longest.
    [[nodiscard]] bool offer(FrameJob job);
    /// Frames that were drawn (in time or late) since the last call. Throws what went wrong on a thread.
    [[nodiscard]] std::vector<FrameTiming> take_done();
    /// Lets the frames at hand be finished and written. Later take_done() has the rest.
    void finish();

    [[nodiscard]] const std::vector<double>& trial_s() const {
        return trial_s_;
    }  ///< lower quartile of drawing times, by level
    [[nodiscard]] const std::string& version() const { return version_; }
    [[nodiscard]] const render::Image& rest_image() const { return rest_image_; }
    [[nodiscard]] const std::string& priority() const { return priority_; }

    // After finish():
    [[nodiscard]] std::uint64_t not_written() const { return not_written_; }
    /// When each frame's file was complete: index, nanoseconds since the epoch. In order.
    [[nodiscard]] const std::vector<std::pair<std::uint64_t, std::int64_t>>& written() const {
        return written_;
    }
    [[nodiscard]] double draw_s() const { return draw_s_; }
    [[nodiscard]] double write_s() const { return write_s_; }

private:
    struct Finished {
        std::uint64_t index;
        render::Image image;
    };
    using Renderers = std::vector<std::unique_ptr<render::Renderer>>;
    void draw_all(const std::vector<render::SceneDescription>& scenes, const render::FrameState& rest);
    void draw_one(Renderers& renderers, FrameJob& job);
    void write_all();
    void join();
    [[nodiscard]] std::unique_lock<std::mutex> try_to_lock();
    void guard(const std::function<void()>& work);
    void rethrow();

    int width_, height_;
    std::filesystem::path folder_;
    bool realtime_;
    std::int64_t epoch_ns_ = 0;
    ArtificialLoad disturbance_;

    std::mutex mutex_;
    std::condition_variable changed_;
    bool ready_ = false, end_ = false, busy_ = false;
    std::optional<FrameJob> job_;
    std::vector<FrameTiming> done_;
    std::exception_ptr error_;
    BoundedQueue<Finished> images_{8};
    std::atomic<int> waiting_images_ = 0;

    std::vector<double> trial_s_;
    std::string version_, priority_;
    render::Image rest_image_;
    std::uint64_t not_written_ = 0;
    std::vector<std::pair<std::uint64_t, std::int64_t>> written_;
    double draw_s_ = 0, write_s_ = 0;
    std::thread drawing_, writing_;
};

}  // namespace app
