#pragma once
#include <Eigen/Core>

namespace tracking {

inline constexpr double kLever = 0.4;  ///< a stick's length [m]: turns rad into metres at the tip

/// Refuses measurements that a stick cannot have made:
///   - a step from the last measurement taken that is faster than `fastest`;
///   - one that is both more than `sigmas` standard deviations from the filter's prediction, and further from
///     straight on than 2 speed dt + strongest dt^2 / 2, which a reversal of the recent speed and the
///     acceleration `strongest` can explain. The recent speed is the greater of the last two measured steps',
///     so contacts pass. Before there are two steps this is not tested.
/// The limits grow with the time since the last measurement taken. The third measurement that would be
/// refused in a row is taken as real (Verdict::persists): the filter then starts anew there.
class OutlierGate {
public:
    enum class Verdict { pass, refuse, persists };

    /// In the unit of the quantity, m or rad. sigmas <= 0 passes everything.
    OutlierGate(double sigmas, double fastest, double strongest)
        : sigmas_(sigmas), fastest_(fastest), strongest_(strongest) {}

    /// The gates of a tracked hand or tip: 25 m/s and 3000 m/s^2; 120 rad/s and what moves the tip of a stick
    /// of kLever by the same acceleration.
    [[nodiscard]] static OutlierGate of_positions(double sigmas) noexcept;
    [[nodiscard]] static OutlierGate of_rotations(double sigmas) noexcept;

    [[nodiscard]] bool is_on() const noexcept { return sigmas_ > 0; }

    /// `measured`, `dt` after the last measurement taken, lies `innovation_square` from the filter's
    /// prediction, whose variance on an axis is `variance`.
    [[nodiscard]] Verdict judge(const Eigen::Vector3d& measured, double dt, double innovation_square,
                                double variance) noexcept;
    /// The same for a quantity of which only steps are known (a rotation): `step` from the last one taken.
    [[nodiscard]] Verdict judge_step(const Eigen::Vector3d& step, double dt, double innovation_square,
                                     double variance) noexcept;
    /// The state starts anew, at `measured`.
    void restart(const Eigen::Vector3d& measured = Eigen::Vector3d::Zero()) noexcept;

private:
    [[nodiscard]] bool possible(const Eigen::Vector3d& step, double dt, double innovation_square,
                                double variance) const noexcept;

    double sigmas_;
    double fastest_;
    double strongest_;
    int refused_ = 0;
    int steps_ = 0;  // measured so far, counted to 2
    Eigen::Vector3d taken_ = Eigen::Vector3d::Zero();
    Eigen::Vector3d velocity_ = Eigen::Vector3d::Zero();  // of the last step
    double speed_ = 0, speed_before_ = 0;                 // of the last step and the one before
};

}  // namespace tracking
