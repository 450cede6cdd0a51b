#pragma once

namespace tracking {

/// How far a new measurement lies from what was known, in the unit of the quantity (m or rad).
struct Surprise {
    double dt = 0;            ///< since the last measurement taken [s]
    double displacement = 0;  ///< from that measurement
    double speed = 0;         ///< of the state [unit/s]
    double innovation = 0;    ///< distance from the predicted measurement
    double sigma = 0;         ///< standard deviation of the innovation on one axis
};

/// Refuses measurements that a stick cannot have made: a step faster than `fastest`, or an innovation beyond both `sigmas`
/// standard deviations and what a full reversal of the present speed plus the acceleration `strongest` explain,
/// 2 speed dt + strongest dt^2 / 2. The second test waits until three measurements have shown the speed.
/// The limits grow with the time since the last measurement taken, and the third refusal in a row means that
/// the new place is real: what persists is accepted, by starting anew.
class OutlierGate {
public:
    enum class Verdict { pass, refuse, persists };

    /// sigmas <= 0 passes everything.
    OutlierGate(double sigmas, double fastest, double strongest)
        : sigmas_(sigmas), fastest_(fastest), strongest_(strongest) {}

    [[nodiscard]] Verdict judge(const Surprise& surprise) noexcept;
    /// The state starts anew.
    void restart() noexcept;

private:
    [[nodiscard]] bool possible(const Surprise& surprise) const noexcept;

    double sigmas_;
    double fastest_;    // unit/s
    double strongest_;  // unit/s^2
    int refused_ = 0;
    int passed_ = 0;
};

}  // namespace tracking
