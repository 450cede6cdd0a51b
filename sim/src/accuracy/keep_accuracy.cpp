#include <algorithm>
#include <cmath>
#include <limits>

#include "accuracy/body_choice.h"

namespace sim {
namespace {

constexpr int kProbes = 14;
constexpr std::uint64_t kMostMoments = 256;
constexpr int kMostFirst = 8;         // parts of a step in the coarser of the first two trials
constexpr double kStepsOfImpact = 2;  // there, at least: trials with less find the same, wrong rebound

std::size_t count_of(const WorldScene& scene) {
    return scene.world.bodies.size() + scene.later.size();
}

WorldBody& body_of(WorldScene& scene, std::size_t b) {  // in the order in which they are added
    const std::size_t first = scene.world.bodies.size();
    return b < first ? scene.world.bodies[b] : scene.later[b - first];
}

void divide_step(WorldScene& scene, int parts) {
    scene.world.settings.dt /= parts;
    for (WorldEvent& event : scene.events) event.step *= static_cast<std::uint64_t>(parts);
}

// Six poles and eight corners of the surface.
Eigen::Matrix<double, 3, kProbes> probes_of(const WorldBody& body) {
    const Gauge gauge(body.shape.base);
    Eigen::Matrix<double, 3, kProbes> probes;
    for (int i = 0; i < kProbes; ++i) {
        Eigen::Vector3d way = Eigen::Vector3d::Zero();
        if (i < 6)
            way[i / 2] = i % 2 == 0 ? 1 : -1;
        else
            way = Eigen::Vector3d((i - 6) & 1 ? 1 : -1, (i - 6) & 2 ? 1 : -1, (i - 6) & 4 ? 1 : -1);
        probes.col(i) = gauge.onto_surface(way.cwiseProduct(body.shape.base.semi_axes));
    }
    return probes;
}

// A run with the paths of every body's probes at up to kMostMoments moments.
class Trial : public DistributedObserver {
public:
    Trial(WorldScene scene, const AccuracyRequest& request, int parts,
          const std::vector<const ContactCompliance*>& kinds, const std::function<void(double)>& progress)
        : scene_(std::move(scene)), watch_(kinds), progress_(progress) {
        divide_step(scene_, parts);
        steps_ = request.steps * static_cast<std::uint64_t>(parts);
        every_ = (request.steps + kMostMoments - 1) / kMostMoments * static_cast<std::uint64_t>(parts);
        for (std::size_t b = 0; b < count_of(scene_); ++b) {
            const WorldBody& body = body_of(scene_, b);
            probes_.push_back(probes_of(body));
            extents_.push_back(2 * body.shape.base.semi_axes.maxCoeff());
        }
        DistributedSettings settings;
        settings.steps = steps_;
        settings.until_rest = request.until_rest;
        run_alone(scene_, settings, *this);
    }

    void at(std::uint64_t step, const World& world) override {
        watch_.at(world);
        if (progress_ && steps_ > 0) progress_(static_cast<double>(step) / static_cast<double>(steps_));
        if (step == 0 || step % every_ != 0) return;
        times_.push_back(world.time_s());
        places_.emplace_back();
        for (int b = 0; b < world.bodies(); ++b) {
            const WorldBodyState state = world.state(b);
            for (int i = 0; i < kProbes; ++i) {
                Eigen::Vector3d r = probes_[static_cast<std::size_t>(b)].col(i);
                if (state.q.size() > 0) r += mode_shapes_at(world.basis(b), r) * state.q;
                places_.back().emplace_back((state.position + state.orientation * r).cast<float>());
            }
        }
    }

    [[nodiscard]] const std::vector<BodyLoads>& loads() const { return watch_.loads(); }
    [[nodiscard]] const std::vector<double>& times() const { return times_; }
    /// Root mean square over a body's probes, share of its extent, at moment m; 0 before it is there.
    [[nodiscard]] double apart(const Trial& other, std::size_t m, std::size_t b) const {
        if ((b + 1) * kProbes > std::min(places_[m].size(), other.places_[m].size())) return 0;
        double sum = 0;
        for (std::size_t i = b * kProbes; i < (b + 1) * kProbes; ++i)
            sum += double((places_[m][i] - other.places_[m][i]).squaredNorm());
        return std::sqrt(sum / kProbes) / extents_[b];
    }

private:
    WorldScene scene_;
    LoadWatch watch_;
    const std::function<void(double)>& progress_;
    std::uint64_t steps_ = 0, every_ = 1;
    std::vector<Eigen::Matrix<double, 3, kProbes>> probes_;
    std::vector<double> times_, extents_;
    std::vector<std::vector<Eigen::Vector3f>> places_;  // [moment][body x probe]
};

// How far the paths of two trials part.
struct Parting {
    std::vector<double> most = {};    // of each body, share of its extent
    double worst = 0;                 // of these, in units of what is allowed
    std::optional<double> at_s = {};  // when the first body goes beyond
    int body = -1;                    // which
};

Parting compare(const Trial& coarse, const Trial& fine, const std::vector<double>& allowed) {
    Parting made;
    made.most.assign(allowed.size(), 0);
    const std::size_t moments = std::min(coarse.times().size(), fine.times().size());
    for (std::size_t m = 0; m < moments; ++m)
        for (std::size_t b = 0; b < allowed.size(); ++b) {
            const double apart = coarse.apart(fine, m, b);
            made.most[b] = std::max(made.most[b], apart);
            made.worst = std::max(made.worst, apart / allowed[b]);
            if (apart <= allowed[b] || made.at_s) continue;
            made.at_s = fine.times()[m];
            made.body = static_cast<int>(b);
        }
    return made;
}

class Chooser {
public:
    Chooser(WorldScene& scene, const AccuracyRequest& request, const std::function<void(double)>& progress)
        : scene_(&scene), request_(request), progress_(progress), count_(count_of(scene)) {
        estimates_.resize(count_), compliances_.resize(count_);
        for (std::size_t b = 0; b < count_; ++b)
            if (const WorldBody& body = body_of(scene, b); body.moves()) {
                estimates_[b] = estimates_of(body);
                compliances_[b] = &estimates_[b]->compliance();
            }
    }

    AccuracyReport run() {
        report_.accuracy = request_.accuracy;
        find_loads();
        choose_bodies();
        halve_steps();
        return std::move(report_);
    }

private:
    using Estimates = std::unique_ptr<BodyEstimates>;

    const BodyEstimates* estimates_of(const WorldBody& body) {
        const auto known = std::ranges::find_if(kinds_, [&](const Estimates& k) { return k->serves(body); });
        if (known != kinds_.end()) return known->get();
        kinds_.push_back(std::make_unique<BodyEstimates>(body));
        return kinds_.back().get();
    }
    [[nodiscard]] bool is_open(std::size_t b) const {  // left to the choice
        const WorldBody& body = body_of(*scene_, b);
        return body.moves() && body.fidelity.fidelity == Fidelity::automatic;
    }
    std::unique_ptr<Trial> tried(const WorldScene& scene, int parts) {
        ++report_.trials;
        return std::make_unique<Trial>(scene, request_, parts, compliances_, progress_);
    }

    void find_loads() {
        WorldScene stiff = *scene_;
        for (std::size_t b = 0; b < count_; ++b)
            if (is_open(b)) body_of(stiff, b).fidelity.fidelity = Fidelity::rigid;
        loads_ = tried(stiff, 1)->loads();
    }

    void choose_bodies() {
        const double dt = scene_->world.settings.dt;
        const double resolved_s = request_.keep_step ? kStepsOfImpact * dt : kStepsOfImpact * dt / kMostFirst;
        double shortest = std::numeric_limits<double>::infinity();  // impact of what deforms [s]
        for (const Estimates& kind : kinds_) {
            std::vector<BodyLoads> most(1);
            for (std::size_t b = 0; b < count_; ++b)
                if (estimates_[b] == kind.get() && is_open(b)) join_loads({loads_[b]}, most);
            for (std::size_t b = 0; b < count_; ++b)
                if (estimates_[b] == kind.get() && is_open(b))
                    kind->choose(body_of(*scene_, b), most[0], kShareOfBody * request_.accuracy, resolved_s);
        }
        for (std::size_t b = 0; b < count_; ++b)
            if (const WorldBody& body = body_of(*scene_, b);
                body.moves() && body.fidelity.fidelity != Fidelity::rigid)
                shortest = std::min(shortest, estimates_[b]->shortest_impact(loads_[b]));
        while (!request_.keep_step && first_ < kMostFirst && kStepsOfImpact * dt / first_ > shortest)
            first_ *= 2;
    }

    // Of each body what its mesh, modes and samples leave to the step, or the same share of what they take where
    // they take too much.
    [[nodiscard]] std::vector<double> left_to_step() const {
        std::vector<double> left(count_, request_.accuracy);
        for (std::size_t b = 0; b < count_; ++b) {
            if (estimates_[b] == nullptr) continue;
            const double taken = estimates_[b]->of(body_of(*scene_, b), loads_[b]).total();
            left[b] =
                std::max(request_.accuracy - taken, (1 - kShareOfBody) * std::max(request_.accuracy, taken));
        }
        return left;
    }

    void halve_steps() {
        const std::vector<double> left = left_to_step();
        std::unique_ptr<Trial> coarse = tried(*scene_, first_), fine;
        double together = 0, worst = 0;
        for (int halving = 1;; ++halving) {
            fine = tried(*scene_, first_ << halving);
            const Parting parting = compare(*coarse, *fine, left);
            // Paths that part as early as before and as far, at the third time: no shorter step will do.
            const bool hopeless = parting.at_s && halving > 2 && *parting.at_s < 1.25 * together &&
                                  parting.worst > 0.85 * worst;
            if (parting.at_s && !hopeless && halving < kMostHalvings && !request_.keep_step) {
                together = *parting.at_s, worst = parting.worst;
                coarse = std::move(fine);
                continue;
            }
            bool coarse_suffices = true;
            for (std::size_t b = 0; b < count_; ++b) coarse_suffices &= 2 * parting.most[b] <= left[b];
            const bool take_coarse = request_.keep_step || hopeless || coarse_suffices;
            report_.step_parts = take_coarse ? first_ << (halving - 1) : first_ << halving;
            tell((take_coarse ? *coarse : *fine).loads(), parting, take_coarse ? 2 : 1);
            return divide_step(*scene_, report_.step_parts);
        }
    }

    void tell(const std::vector<BodyLoads>& last, const Parting& parting, double step_factor) {
        join_loads(last, loads_);
        report_.bodies.resize(count_);
        for (std::size_t b = 0; b < count_; ++b) {
            if (estimates_[b] != nullptr)
                report_.bodies[b] = estimates_[b]->of(body_of(*scene_, b), loads_[b]);
            report_.bodies[b].step = step_factor * parting.most[b];
        }
        report_.parted_s = parting.at_s, report_.parted_body = parting.body;
    }

    WorldScene* scene_;
    const AccuracyRequest& request_;
    const std::function<void(double)>& progress_;
    std::size_t count_;
    AccuracyReport report_;
    std::vector<Estimates> kinds_;
    std::vector<const BodyEstimates*> estimates_;  // of each body; none: not moved by forces
    std::vector<const ContactCompliance*> compliances_;
    std::vector<BodyLoads> loads_;
    int first_ = 1;  // parts of a step in the coarser of the first two trials
};

}  // namespace

double centrifugal_stretch(const World& world, int body) {
    const WorldBody& definition = world.definition(body);
    if (!definition.moves()) return 0;
    const WorldBodyState state = world.state(body);
    const Eigen::Vector3d spin = (state.orientation.conjugate() * state.angular_momentum)
                                     .cwiseQuotient(world.rigid_mass(body).inertia);
    const double reach = definition.shape.base.semi_axes.maxCoeff();
    return definition.material.density_kg_m3 * spin.squaredNorm() * reach * reach /
           (3 * definition.material.young_pa);
}

AccuracyReport keep_accuracy(WorldScene& scene, const AccuracyRequest& request,
                             const std::function<void(double)>& progress) {
    return Chooser(scene, request, progress).run();
}

}  // namespace sim
