#pragma once
#include <Eigen/Core>

namespace tracking {

/// Refuses measurements that a stick cannot have made: a step faster than `fastest` from the last one taken,
/// or one that surprises both the filter, by more than `sigmas` standard deviations, and mechanics: it lies
/// further from straight on than a reversal of the recent speed and the acceleration `strongest` explain, 2
/// speed dt + strongest dt^2 / 2. The recent speed is the greater of the last two measured steps', so
/// contacts pass; the second test waits until there are two. The limits grow with the time since the last
/// measurement taken, and the third refusal in a row means that the new place is real: what persists is
/// accepted, by starting anew.
class OutlierGate {
public:
    enum class Verdict { pass, refuse, persists };

    /// In the unit of the quantity, m or rad. sigmas <= 0 passes everything.
    OutlierGate(double sigmas, double fastest, double strongest)
        : sigmas_(sigmas), fastest_(fastest), strongest_(strongest) {}

    /// `step`: from the last measurement taken, `dt` ago. `innovation`: distance from the filter's
    /// prediction, of standard deviation `sigma` on each axis.
    [[nodiscard]] Verdict judge(const Eigen::Vector3d& step, double dt, double innovation,
                                double sigma) noexcept;
    /// The state starts anew.
    void restart() noexcept;

private:
    [[nodiscard]] bool possible(const Eigen::Vector3d& step, double dt, double innovation,
                                double sigma) const noexcept;

    double sigmas_;
    double fastest_;
    double strongest_;
    int refused_ = 0;
    int steps_ = 0;                                       // measured so far, counted to 2
    Eigen::Vector3d velocity_ = Eigen::Vector3d::Zero();  // of the last step
    double speed_before_ = 0;                             // of the step before it
};

}  // namespace tracking
