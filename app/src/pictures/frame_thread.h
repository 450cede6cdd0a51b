#pragma once
#include <render/renderer.h>

#include <atomic>
#include <cstdint>
#include <exception>
#include <filesystem>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "files/output_file.h"
#include "process/bounded_queue.h"

namespace app {

/// A frame to be drawn.
struct FrameJob {
    std::uint64_t index = 0;  ///< written as FOLDER/000000.png
    /// Policy `refuse`: of picture quality, which of the scenes is drawn; else the first is.
    std::size_t level = 0;
    /// CLOCK_MONOTONIC when it is shown: one that is drawn later is not written.
    std::int64_t shown_ns = std::numeric_limits<std::int64_t>::max();
    double slower_s = 0;  ///< policy `refuse`, artificial load: wait this long before drawing [s]
    render::FrameState state;
    /// Policy `wait`: states before it while the shutter is open; the picture is the mean of them and `state`
    /// in linear light.
    std::vector<render::FrameState> earlier = {};
};

/// When a frame was drawn. Times of CLOCK_MONOTONIC [ns].
struct DrawnFrame {
    std::uint64_t index = 0;
    std::int64_t started_ns = 0, drawn_ns = 0, read_ns = 0;  ///< drawing began, ended, pixels were there
    bool in_time = true;
};

/// What happens to a frame that is asked for while others are being drawn or written.
enum class FramePolicy {
    wait,    ///< offline: every frame is drawn and written; push() waits for room (64 MB of states)
    refuse,  ///< real time: one frame at a time, push() never waits, late frames are dropped
};

/// Where frames are drawn and written.
struct FrameThreadOptions {
    int width = 640, height = 480;  ///< of the files; pictures of smaller scenes are enlarged
    std::filesystem::path folder;   ///< exists
    FramePolicy policy = FramePolicy::wait;
    bool realtime_priority = false;  ///< of the policy `refuse`: what set_thread_priority() is asked for
};

/// What the threads have measured and obtained.
struct FrameReport {
    std::string version;          ///< of the renderer
    render::Image rest_image;     ///< what the frame `rest` looks like
    std::string priority;         ///< what the drawing thread obtained; empty with the policy `wait`
    std::vector<double> trial_s;  ///< policy `refuse`: lower quartile of drawing times at the start, by level
    double draw_s = 0, write_s = 0;
    /// Frames written, in order: index, CLOCK_MONOTONIC when the file was complete [ns].
    std::vector<std::pair<std::uint64_t, std::int64_t>> written;
    std::uint64_t not_written = 0;  ///< frames in time for which writing had fallen behind by 8
};

/// Throws std::runtime_error where ffmpeg cannot be started: before a run that ends with a video.
void require_ffmpeg();
/// Encodes the frames, and audio.wav if `sound`, of a staging folder into a file that OutputFile::finish()
/// puts in place as `video`. The last frame stays for `held` more. Throws std::runtime_error; nothing of it
/// is left then.
[[nodiscard]] std::unique_ptr<OutputFile> make_video(const std::filesystem::path& video, double fps,
                                                     std::size_t held, bool sound,
                                                     const std::filesystem::path& staging);

/// Draws frames on a thread of its own, which owns the renderers, and encodes and writes them as
/// FOLDER/000000.png on another. push(), take_done() and finish() are for one thread; failures of either
/// thread are thrown by the next call of these. With the policy `refuse` none of them waits for a lock.
class FrameThread {
public:
    /// `scenes`: one for each level of picture quality. `rest`: the frame drawn first, to warm up and for the
    /// fingerprint; it is not written. With the policy `refuse`, waits until each scene has been drawn a few
    /// times, and throws what went wrong.
    FrameThread(std::vector<render::SceneDescription> scenes, const render::FrameState& rest,
                FrameThreadOptions options);
    ~FrameThread();
    FrameThread(const FrameThread&) = delete;
    FrameThread& operator=(const FrameThread&) = delete;

    /// False: refused, the frame before is still being drawn.
    bool push(FrameJob job);
    /// With the policy `refuse`: frames drawn since the last call, in time or late.
    [[nodiscard]] std::vector<DrawnFrame> take_done();
    [[nodiscard]] std::size_t pushed() const { return pushed_; }
    /// With the policy `wait`: returns when the first `count` frames, or all at hand, are drawn and written.
    void wait_for(std::uint64_t count);
    void drain() { wait_for(pushed_); }
    /// With the policy `wait`: of these frames, the pictures of those that are not written yet are kept for
    /// take_picture().
    void keep_pictures(const std::vector<std::uint64_t>& frames);
    /// With the policy `wait`: returns when the frame is written, with its picture where that was kept; once.
    [[nodiscard]] std::optional<render::Image> take_picture(std::uint64_t frame);
    /// Lets the frames at hand be drawn and written. Then take_done() has the rest.
    void finish();

    /// What it has measured; the frames' since finish().
    [[nodiscard]] const FrameReport& report() const { return report_; }

private:
    struct Picture {
        std::uint64_t index = 0;
        render::Image image;
    };
    /// Of a frame: what is drawn at once.
    struct Moment {
        std::uint64_t index = 0;
        bool exposed = false, last = true;  ///< one of several; of these the last
    };
    /// Of the one frame at a time of the policy `refuse`: who may touch drawn_.
    enum class Turn : std::uint8_t { free, drawing, done };

    void run(const std::function<void()>& work);
    void draw_all(const std::vector<render::SceneDescription>& scenes, const render::FrameState& rest);
    void try_out(render::Renderer& renderer, const render::FrameState& rest);
    void draw_in_turn(render::Renderer& renderer);
    void draw_one(render::Renderer& renderer, const FrameJob& job);
    void write_all();
    void collect();
    void rethrow();
    void join();

    FrameThreadOptions options_;
    BoundedQueue<FrameJob> jobs_;  // long: what comes after the frames is computed while they are drawn
    BoundedQueue<Picture> pictures_{8};
    std::atomic<bool> ready_ = false;
    std::uint64_t pushed_ = 0;                // of the pushing thread
    std::atomic<std::uint64_t> written_ = 0;  // or given up, as a thread has failed

    std::atomic<Turn> turn_ = Turn::free;
    DrawnFrame drawn_;
    std::vector<DrawnFrame> done_;  // of the pushing thread

    std::atomic<bool> failed_ = false;
    std::mutex error_mutex_;
    std::exception_ptr error_;

    std::mutex kept_mutex_;
    std::map<std::uint64_t, std::optional<render::Image>> kept_;  // by frame, where it is wanted
    FrameReport report_;
    std::thread drawing_, writing_;
};

}  // namespace app
