#pragma once
#include <render/renderer.h>

#include <condition_variable>
#include <deque>
#include <exception>
#include <filesystem>
#include <functional>
#include <mutex>
#include <string>
#include <thread>

namespace app {

/// A queue between one producer and one consumer that holds the producer back when it is full.
template <class Item>
class BoundedQueue {
public:
    explicit BoundedQueue(std::size_t capacity) : capacity_(capacity) {}
    /// False when the queue was closed.
    bool push(Item item) {
        std::unique_lock lock(mutex_);
        changed_.wait(lock, [&] { return closed_ || items_.size() < capacity_; });
        if (closed_) return false;
        items_.push_back(std::move(item));
        changed_.notify_all();
        return true;
    }
    /// False when the queue is closed and empty.
    bool pop(Item& item) {
        std::unique_lock lock(mutex_);
        changed_.wait(lock, [&] { return closed_ || !items_.empty(); });
        if (items_.empty()) return false;
        item = std::move(items_.front());
        items_.pop_front();
        changed_.notify_all();
        return true;
    }
    void close() {
        const std::scoped_lock lock(mutex_);
        closed_ = true;
        changed_.notify_all();
    }

private:
    std::mutex mutex_;
    std::condition_variable changed_;
    std::deque<Item> items_;
    std::size_t capacity_;
    bool closed_ = false;
};

/// Draws frames on a thread of its own (which owns the renderer) and encodes and writes them as
/// FOLDER/000000.png on another. Failures of either thread are thrown by the next push() or by finish().
class FrameWriter {
public:
    /// `rest`: the frame drawn first, to warm up and for the fingerprint; it is not written.
    FrameWriter(const render::SceneDescription& scene, const render::FrameState& rest,
                std::filesystem::path folder);
    ~FrameWriter();
    FrameWriter(const FrameWriter&) = delete;
    FrameWriter& operator=(const FrameWriter&) = delete;

    void push(render::FrameState frame);
    void finish();

    // After finish():
    [[nodiscard]] std::size_t frames() const { return written_; }
    [[nodiscard]] double draw_s() const { return draw_s_; }
    [[nodiscard]] double write_s() const { return write_s_; }
    [[nodiscard]] const std::string& version() const { return version_; }
    [[nodiscard]] const render::Image& rest_image() const { return rest_image_; }

private:
    void draw_all(const render::SceneDescription& scene, const render::FrameState& rest);
    void write_all();
    void guard(const std::function<void()>& work);
    void rethrow();

    std::filesystem::path folder_;
    BoundedQueue<render::FrameState> states_{16};
    BoundedQueue<render::Image> images_{4};
    std::mutex error_mutex_;
    std::exception_ptr error_;
    std::size_t written_ = 0;
    double draw_s_ = 0, write_s_ = 0;
    std::string version_;
    render::Image rest_image_;
    std::thread drawing_, writing_;
};

}  // namespace app
