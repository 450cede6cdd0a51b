#include <fmt/format.h>

#include <string>
#include <vector>

#include "pictures/frame_thread.h"
#include "process/child_process.h"

namespace app {
namespace fs = std::filesystem;

void make_video(const fs::path& video, double fps, bool sound, const fs::path& staging) {
    std::vector<std::string> command = {"ffmpeg", "-nostdin", "-loglevel", "error", "-y", "-framerate"};
    command.insert(command.end(), {fmt::format("{}", fps), "-i", (staging / "frames" / "%06d.png").string()});
    if (sound) command.insert(command.end(), {"-i", (staging / "audio.wav").string(), "-c:a", "aac"});
    command.insert(command.end(), {"-c:v", "libx264", "-preset", "veryfast", "-pix_fmt", "yuv420p", "-fflags",
                                   "+bitexact", "-f", "mp4", video.string() + ".partial"});
    try {
        run_child(command, staging / "scratch" / "ffmpeg.log");
    } catch (...) {
        std::error_code ignored;
        fs::remove(video.string() + ".partial", ignored);
        throw;
    }
}

}  // namespace app
