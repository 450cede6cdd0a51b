#pragma once
#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "learned_path.h"
#include "tracking/sensor.h"
#include "tracking/training.h"

namespace tracking {

/// What a network learns from: columns are examples.
struct Examples {
    Eigen::MatrixXf inputs;    ///< kInputs
    Eigen::MatrixXf means;     ///< kPathMeans: the residuals, as the network's outputs
    Eigen::MatrixXf known;     ///< 2 kNodes: 1 where the position, the direction at a lead is known
    std::vector<float> speed;  ///< of the PathFrame [m/s]
    std::vector<std::size_t> recording;

    [[nodiscard]] Eigen::Index count() const { return static_cast<Eigen::Index>(speed.size()); }
};

/// How one stick is seen once.
struct Rendition {
    SensorModel sensor;
    double slower = 1;  ///< times are multiplied by this
    bool orientation = true;
    double share = 1;   ///< of the samples that become examples, drawn at random
    double from_s = 0;  ///< after the first sample
};

/// Collects examples; `reserve` of them at most.
class ExampleCollector {
public:
    explicit ExampleCollector(std::size_t reserve);
    void add(const TrainingStick& stick, const Rendition& rendition);
    [[nodiscard]] Examples finish() &&;

private:
    Examples examples_;
    std::size_t count_ = 0;
};

/// Input vectors, and means and spreads of the outputs, as if left were right: across changes its sign.
void mirror(Eigen::Ref<Eigen::VectorXf> inputs, Eigen::Ref<Eigen::VectorXf> means);

}  // namespace tracking
