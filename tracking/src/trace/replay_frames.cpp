#include "trace/replay_frames.h"

namespace tracking {
namespace {

constexpr double kStartUp = 0.5;  // s
constexpr double kTeleport = 30;  // m/s

}  // namespace

std::vector<std::size_t> frames_that_count(
    const std::vector<double>& t_s, std::size_t hands,
    const std::function<Eigen::Vector3d(std::size_t frame, std::size_t hand)>& position,
    std::vector<std::string>& remarks) {
    std::vector<std::size_t> kept;
    for (std::size_t k = 0; k < t_s.size(); ++k)
        if (kept.empty() || t_s[k] > t_s[kept.back()]) kept.push_back(k);
    const std::size_t repeated = t_s.size() - kept.size();
    std::size_t first = 0;
    for (std::size_t i = 1; i < kept.size() && t_s[kept[i]] - t_s[kept[0]] <= kStartUp; ++i)
        for (std::size_t hand = 0; hand < hands; ++hand) {
            const double way = (position(kept[i], hand) - position(kept[i - 1], hand)).norm();
            if (!(way <= kTeleport * (t_s[kept[i]] - t_s[kept[i - 1]]))) first = i;
        }
    kept.erase(kept.begin(), kept.begin() + static_cast<std::ptrdiff_t>(first));
    if (repeated > 0)
        remarks.push_back("left out " + std::to_string(repeated) + " frames not later than the ones before");
    if (first > 0)
        remarks.push_back("left out " + std::to_string(first) + " frames of the start-up, before " +
                          std::to_string(t_s[kept.front()]) + " s");
    return kept;
}

}  // namespace tracking
