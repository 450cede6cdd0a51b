#pragma once
#include <sim/simulation.h>

#include <cstdint>
#include <random>
#include <vector>

namespace sim_bench {

/// So many drums, 0.4 m apart in rows of five.
[[nodiscard]] std::vector<sim::BodyDefinition> drums(int count);
/// A path of a tip that comes down on a point from 0.15 m above at 4 m/s, 8 nodes over 1/15 s from t on.
[[nodiscard]] sim::TipPath stroke(const Eigen::Vector3d& at, double t);

/// Two sticks on drums, each of which strikes another one in each step of 1/60 s; two pictures a step. What is
/// struck is felt from then on, and folded into the bodies' states a step later. The same for every seed.
class Strokes {
public:
    Strokes(std::vector<sim::BodyDefinition> bodies, unsigned seed)
        : random_(seed), bodies_(std::move(bodies)) {}
    [[nodiscard]] sim::StepRequest next();
    void learn(const sim::StepReply& reply);
    [[nodiscard]] std::uint64_t contacts() const { return contacts_; }  ///< learnt of

private:
    std::mt19937 random_;
    std::vector<sim::BodyDefinition> bodies_;
    std::vector<sim::Impulse> struck_;  // in the last step
    std::uint64_t contacts_ = 0;
    double t_s_ = 0;
};

struct StruckSpeed {
    int workers = 0;    ///< processes; 0: all in this one
    double step_s = 0;  ///< median, by the wall clock
    /// Mean a step by processor time: what the calling thread used, and the worker process that used most.
    double critical_path_s = 0;
    std::uint64_t contacts = 0;
};

/// The same strokes with each number of workers, in turns of 25 steps. `launch`: of workers, whatever its count.
[[nodiscard]] std::vector<StruckSpeed> measure_struck(int bodies, const std::vector<int>& workers,
                                                      const sim::WorkerLaunch& launch, int steps);

}  // namespace sim_bench
