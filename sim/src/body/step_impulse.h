#pragma once
#include <Eigen/Core>

namespace sim {

/// Impulse that other moving bodies gave a body in one step.
struct StepImpulse {
    Eigen::Vector3d linear = Eigen::Vector3d::Zero();   ///< [N s]
    Eigen::Vector3d angular = Eigen::Vector3d::Zero();  ///< about its centre, world axes [N m s]
    Eigen::VectorXd modal;  ///< of the modal coordinates, spread over the step [N s kg^-1/2]

    void set_zero() { linear.setZero(), angular.setZero(), modal.setZero(); }
    [[nodiscard]] bool is_zero() const { return linear.isZero(0) && angular.isZero(0) && modal.isZero(0); }
};

}  // namespace sim
