#pragma once
#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "learned/learned_path.h"
#include "learned/sighting.h"
#include "tracking/training.h"

namespace tracking {

/// Training examples, one a column.
struct Examples {
    Eigen::MatrixXf inputs;    ///< kInputs
    Eigen::MatrixXf means;     ///< kPathMeans: the residuals, as the network's outputs
    Eigen::MatrixXf known;     ///< 2 kNodes: 1 where the position, the direction at a lead is known
    std::vector<float> speed;  ///< of the PathFrame [m/s]
    std::vector<std::size_t> recording;

    [[nodiscard]] Eigen::Index count() const { return static_cast<Eigen::Index>(speed.size()); }
};

/// Collects examples; `reserve` of them at most.
class ExampleCollector {
public:
    explicit ExampleCollector(std::size_t reserve);
    /// A `share` of the samples, drawn at random, of those later than `from_s` after the first.
    void add(const TrainingStick& stick, const Sighting& sighting, double share, double from_s = 0);
    [[nodiscard]] Examples finish() &&;

private:
    Examples examples_;
    std::size_t count_ = 0;
};

/// Mirrors an example left to right: components across the motion change their sign.
void mirror(Eigen::Ref<Eigen::VectorXf> inputs, Eigen::Ref<Eigen::VectorXf> means);

}  // namespace tracking
