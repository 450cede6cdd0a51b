#pragma once
#include <deque>
#include <optional>
#include <string>
#include <vector>

namespace app {

/// One level of picture quality, the most expensive first.
struct QualityLevel {
    std::string name;
    int samples = 4;          ///< of multisampling, 1: none
    int shadow_texels = 512;  ///< 0: no shadows
    int size_divisor = 1;     ///< drawn smaller by this factor and enlarged
    int rate_divisor = 1;     ///< only every rate_divisor-th frame is drawn
};

[[nodiscard]] const std::vector<QualityLevel>& quality_levels();

/// Lowers the quality of pictures, then their rate, before the sound suffers, and raises it again.
///
/// The rule:
///
///   lower   when 3 of the last 90 frames that were asked for were late or skipped, or when 5 % of the last
///           200 blocks of sound were late beyond what their lead allows (and, with leads that adapt, when
///           the delay outgrows the lead asked for). Frames that wait for one of another level do not count.
///   raise   when for 8 s nothing was late and the next better level would fit; after a rise that had to be
///           taken back, the wait doubles (up to 64 s)
///   fits    what the level took in its trial, times how much slower drawing is now than in the trial of the
///           level at hand, is less than 0.6 of the time between two frames. Before anything was drawn 0.5: a
///           frame draws about a third of the whole pictures of the trial again, but the trial runs alone
///
/// Begins at the best level that fits. Pure: times come from the caller.
class QualityRule {
public:
    /// `frame_s`: time between two frames; `trial_s`: what drawing a frame took at each level in a trial.
    QualityRule(double frame_s, std::vector<double> trial_s);

    [[nodiscard]] std::size_t level() const { return level_; }
    /// Whether frame `index` is drawn at the level's rate.
    [[nodiscard]] bool wants(std::uint64_t index) const;
    /// A frame that was asked for at `at_s`; draw_s < 0: it was skipped. Returns why the level changed, if it
    /// did.
    std::optional<std::string> frame(double at_s, bool in_time, double draw_s);
    /// The delay of pictures has outgrown the lead asked for (`--lead auto`): simpler pictures come before a
    /// longer lead, which costs accuracy; a lower rate does not help. At most every 0.25 s, so that a level
    /// can show its delay.
    std::optional<std::string> outgrown(double at_s);
    /// Blocks of sound since the last call, and how many were late.
    std::optional<std::string> blocks(double at_s, std::size_t count, std::size_t late);

private:
    std::optional<std::string> lower(double at_s, const std::string& why);

    [[nodiscard]] bool fits(std::size_t level) const;

    double frame_s_;
    std::vector<double> trial_s_;  // by level
    double slowdown_ = 0.5;        // a running mean
    std::size_t level_ = 0;
    std::deque<bool> late_;  // of the last frames
    std::deque<std::pair<std::size_t, std::size_t>> blocks_;
    double quiet_since_s_ = 0, wait_s_ = 8, raised_at_s_ = -1e9, lowered_at_s_ = -1e9;
};

}  // namespace app
