#pragma once
#include <functional>

#include "bench/bench_report.h"
#include "commands/bench_options.h"

namespace app {

/// The least work of a step: what the method cannot do without, whoever programs it.
///   samples   each of the V samples of a body follows its m modes and the body once a step: V (6 m + 18)
///   motion    each of S substeps advances m oscillators and the frame: S (6 m + 100)
///   contacts  each point's three rows see each of their bodies' 6 + m coordinates, to and fro, once a
///             substep: S 3 2 4 (6 + m), and the implicit function of the sample in it, once a step: 60
struct LeastWork {
    double flops, bytes;  ///< a body and step; bytes: state and positions of samples, read and written once
};
[[nodiscard]] LeastWork least_work(int modes, int samples, int substeps, double contacts_per_body);

/// Our bodies and Bullet's in one run, in turns of 25 steps, on this thread's processor time. `progress` gets
/// a line now and then.
[[nodiscard]] BenchReport bench_sim(const SimBenchOptions& options,
                                    const std::function<void(const std::string&)>& progress);

}  // namespace app
