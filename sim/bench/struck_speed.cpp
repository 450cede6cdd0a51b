#include "struck_speed.h"

#include <sys/types.h>
#include <time.h>

#include <algorithm>
#include <fstream>
#include <memory>
#include <utility>

#include "bench_clock.h"

namespace sim_bench {
namespace {

constexpr int kTurn = 25;  // steps

/// Processes that this thread has started and that still are there.
std::vector<pid_t> children() {
    std::ifstream file("/proc/thread-self/children");
    std::vector<pid_t> children;
    for (pid_t child = 0; file >> child;) children.push_back(child);
    return children;
}

double cpu_s_of(pid_t process) {
    clockid_t clock = 0;
    return clock_getcpuclockid(process, &clock) == 0 ? clock_s(clock) : 0;
}

/// A simulation under way, and what its steps took.
class Way {
public:
    Way(int bodies, int workers, sim::WorkerLaunch launch) : strokes_(drums(bodies), 1992) {
        speed_.workers = workers;
        launch.count = workers;
        const std::vector<pid_t> before = children();
        simulation_ = workers == 0 ? sim::make_local_simulation(drums(bodies))
                                   : sim::make_distributed_simulation(drums(bodies), launch);
        for (const pid_t child : children())
            if (std::ranges::find(before, child) == before.end())
                workers_.push_back({child, cpu_s_of(child)});
    }
    void step() {
        const sim::StepRequest request = strokes_.next();
        const double wall = wall_s(), cpu = thread_cpu_s();
        const sim::StepReply reply = simulation_->step(request);
        cpu_s_ += thread_cpu_s() - cpu;
        walls_.push_back(wall_s() - wall);
        strokes_.learn(reply);
    }
    [[nodiscard]] StruckSpeed speed() {
        double busiest = 0;
        for (const auto& [process, before] : workers_)
            busiest = std::max(busiest, cpu_s_of(process) - before);
        speed_.step_s = median_of(walls_);
        speed_.critical_path_s = (cpu_s_ + busiest) / static_cast<double>(walls_.size());
        speed_.contacts = strokes_.contacts();
        return speed_;
    }

private:
    Strokes strokes_;
    StruckSpeed speed_;
    std::unique_ptr<sim::Simulation> simulation_;
    std::vector<std::pair<pid_t, double>> workers_;  // processor time when they had joined
    std::vector<double> walls_;
    double cpu_s_ = 0;
};

}  // namespace

std::vector<sim::BodyDefinition> drums(int count) {
    std::vector<sim::BodyDefinition> bodies(static_cast<std::size_t>(count));
    for (int i = 0; i < count; ++i) {
        sim::BodyDefinition& body = bodies[static_cast<std::size_t>(i)];
        body.shape = {{0.18, 0.1, 0.18}, 0.1, 1};
        body.world_from_body.translation() = Eigen::Vector3d(0.4 * (i % 5), 0.8, 0.45 * (i / 5));
    }
    return bodies;
}

sim::TipPath stroke(const Eigen::Vector3d& at, double t) {
    sim::TipPath path;
    for (int k = 0; k < 8; ++k) {
        const double h = k / 15.0 / 7;
        path.nodes.push_back(
            {t + h, at + Eigen::Vector3d(0.5 * h, 0.15 - 4 * h, 0), Eigen::Vector3d(0.5, -4, 0)});
    }
    return path;
}

sim::StepRequest Strokes::next() {
    t_s_ += 1.0 / 60;
    sim::StepRequest request{t_s_, {}, {}, {}, {{t_s_ + 0.01, {}}, {t_s_ + 0.03, {}}}};
    for (sim::Impulse& impulse : struck_) {
        impulse.t_s = std::min(impulse.t_s, t_s_);
        request.folded.push_back(impulse);
    }
    struck_.clear();
    for (std::uint32_t stick = 0; stick < 2; ++stick) {
        const sim::BodyDefinition& body = bodies_[random_() % bodies_.size()];
        request.paths.push_back(
            stroke(body.world_from_body.translation() + Eigen::Vector3d(0.05, 0.1, 0), t_s_));
        request.paths.back().stick = stick;
    }
    return request;
}

void Strokes::learn(const sim::StepReply& reply) {
    for (const sim::Contact& c : reply.contacts) {
        if (c.starts_inside || c.speed_mps <= 0.2) continue;
        struck_.push_back({c.body, c.t_s, c.point_body, c.impulse_body});
        ++contacts_;
    }
}

std::vector<StruckSpeed> measure_struck(int bodies, const std::vector<int>& workers,
                                        const sim::WorkerLaunch& launch, int steps) {
    std::vector<std::unique_ptr<Way>> ways;
    for (const int count : workers) ways.push_back(std::make_unique<Way>(bodies, count, launch));
    for (int done = 0; done < steps; done += kTurn)
        for (const std::unique_ptr<Way>& way : ways)
            for (int k = 0; k < std::min(kTurn, steps - done); ++k) way->step();
    std::vector<StruckSpeed> speeds;
    for (const std::unique_ptr<Way>& way : ways) speeds.push_back(way->speed());
    return speeds;
}

}  // namespace sim_bench
