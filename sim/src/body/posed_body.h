#pragma once
#include <utility>

#include "body/body_kind.h"

namespace sim {

/// One body's place and deformed shape at the start of a step, prepared for contact tests: single precision
/// relative to its own centre, so errors are 1e-7 of its size wherever it is.
struct PosedBody {
    const BodyKind* kind = nullptr;
    Eigen::Vector3d position = Eigen::Vector3d::Zero();
    Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();  ///< body to world
    LaneArray samples;     ///< deformed, body frame: [axis][8 batches]; empty: as at rest
    LaneArray polynomial;  ///< displacement: [brick][27][3], whole lanes in all; modal bodies only
    Eigen::Matrix3f deformation = Eigen::Matrix3f::Identity();  ///< D of (2.12), linear bodies
    Eigen::Matrix3f deformation_inverse = Eigen::Matrix3f::Identity();
    Eigen::Vector3f half_box = Eigen::Vector3f::Zero();   ///< of the deformed body, its own axes [m]
    float radius = 0;                                     ///< [m]
    float sample_reach = 0;                               ///< how far samples are from their rest places [m]
    Eigen::Vector3d half_aabb = Eigen::Vector3d::Zero();  ///< world axes [m]

    [[nodiscard]] const float* sample_data() const noexcept {  ///< [axis][8 batches]
        return kind->modes > 0 ? samples.data() : kind->rest.data();
    }
    [[nodiscard]] Eigen::Vector3f sample(int index) const noexcept {  ///< as deformed, body frame [m]
        const float* x = sample_data();
        const int stride = kind->batches * kLanes;
        return {x[index], x[index + stride], x[index + 2 * stride]};
    }
    /// The sample furthest along `direction` (unit, body frame), and how far that is [m].
    [[nodiscard]] std::pair<int, float> furthest_sample(const Eigen::Vector3f& direction) const noexcept;
    /// Deformed place of a rest point, body frame.
    [[nodiscard]] Eigen::Vector3d deformed(const Eigen::Vector3d& rest) const noexcept;

    /// q: the modal coordinates. Costs about modes x samples / 3 multiply-adds of eight.
    void set(const Eigen::Vector3d& position, const Eigen::Quaterniond& orientation,
             const Eigen::VectorXd& q);

private:
    void deform_linear(const Eigen::VectorXd& q);
    void deform_modal(const Eigen::VectorXd& q);
    void bend_polynomial(const float* q);
};

}  // namespace sim
