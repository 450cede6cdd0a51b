#pragma once
#include <cstddef>
#include <deque>

namespace app {

/// Keeps a lead as long as the delay that it hides, which changes with the scene and the machine (Friedmann
/// 1992, the end of section 3.4). The lead follows the 98th percentile of the last 2 s of delays and a
/// reserve, never below the lead that was asked for, in steps that cannot be seen or heard: at most 1.5 ms per
/// measured delay up and 0.5 ms down. If the median of the last 5 delays is beyond the lead, it is followed at
/// once: a lasting delay is covered after (its size / 1.5 ms) measurements. Pure.
class LeadControl {
public:
    /// `least_s`: the lead asked for; `rate_hz`: of the delays; `reserve_s` on top of them.
    LeadControl(double least_s, double rate_hz, double reserve_s);
    /// A measured delay [s]; the lead from now on.
    double measured(double delay_s);
    /// What is measured has changed: earlier delays do not count any more.
    void forget() { recent_.clear(); }
    [[nodiscard]] double lead_s() const { return lead_s_; }
    /// The percentile that it follows [s].
    [[nodiscard]] double delay_s() const { return delay_s_; }

private:
    double least_s_, reserve_s_;
    std::size_t window_;
    std::deque<double> recent_;  // delays of the window
    double lead_s_, delay_s_ = 0;
};

}  // namespace app
