#include "play/strike_pipeline.h"

#include <algorithm>

#include "sticks/auto_predictor.h"

namespace app {
namespace {

constexpr double kReboundS = 0.05;  // a filter has seen a rebound by then

}  // namespace

StrikePipeline::StrikePipeline(const Kit& kit, const StrikeRules& rules, double tip_radius_m,
                               std::vector<const StickOutlook*> sticks, sim::Simulation& simulation,
                               Notify notify)
    : kit_(kit),
      cancelling_(rules.cancelling),
      tip_radius_m_(tip_radius_m),
      sticks_(std::move(sticks)),
      simulation_(simulation),
      notify_(std::move(notify)),
      scheduler_(rules, sticks_.size(), kit.instruments.size()) {}

void StrikePipeline::advance_to(double s, double fixed_s) {
    scheduler_.advance_to(s, fixed_s);
}

sim::StepReply StrikePipeline::step(sim::StepRequest& request) {
    const Stopwatch watch(times_.simulation);
    request.anew = !begun_;
    // A sample that came after a newer one of another stick finds the bodies as they are by then.
    if (begun_) request.t_s = std::max(request.t_s, simulated_s_);
    begun_ = true;
    simulated_s_ = request.t_s;
    return simulation_.step(request);
}

std::vector<sim::TipPath> StrikePipeline::paths_of(std::span<const std::uint32_t> moved) const {
    const auto sticks = static_cast<std::uint32_t>(sticks_.size());
    std::vector<sim::TipPath> paths;
    for (const std::uint32_t stick : moved) {
        const StickOutlook& outlook = *sticks_[stick];
        paths.push_back(outlook.predicted_path());
        paths.push_back(outlook.measured_path());
        // Numbered beyond the sticks, so that its contacts are told apart.
        paths.back().stick += sticks;
        if (std::optional<sim::TipPath> confirming = outlook.confirming_path()) {
            paths.push_back(std::move(*confirming));
            paths.back().stick += 2 * sticks;
        }
    }
    return paths;
}

void StrikePipeline::settle_impulses(double s, sim::StepRequest& request) {
    for (const std::uint64_t id : scheduler_.take_released()) unfolded_.push_back(id);
    std::vector<std::uint64_t> ahead;
    for (const std::uint64_t id : unfolded_) {
        const sim::Impulse impulse = impulse_of(scheduler_.strikes()[id - 1]);
        if (impulse.t_s <= s) {
            request.folded.push_back(impulse);
            drawn_.folded(id);
        } else {
            request.confirmed.push_back(impulse);
            ahead.push_back(id);
        }
    }
    unfolded_ = std::move(ahead);
}

void StrikePipeline::take(double s, std::span<const std::uint32_t> moved) {
    sim::StepRequest request;
    request.t_s = s;
    {
        const Stopwatch watch(times_.tracking);
        request.paths = paths_of(moved);
    }
    settle_impulses(s, request);
    const sim::StepReply reply = step(request);
    const Stopwatch watch(times_.strikes);
    take_contacts(s, moved, reply);
    send_notes();
}

void StrikePipeline::take_contacts(double s, std::span<const std::uint32_t> moved,
                                   const sim::StepReply& reply) {
    const std::size_t bodies = kit_.instruments.size();
    const auto sticks = static_cast<std::uint32_t>(sticks_.size());
    const auto contacts_of = [&](std::uint32_t number) {
        std::vector<sim::Contact> own;
        for (const sim::Contact& contact : reply.contacts)
            if (contact.stick == number) own.push_back(contact);
        return own;
    };
    std::size_t path = 0;
    for (const std::uint32_t stick : moved) {
        // Two paths a stick: the predicted one, and the measured tip, which stands still and makes no contact
        // but by starting inside; a third where another filter confirms.
        const std::span<const double> filtered(reply.clearance_m.data() + path * bodies, bodies);
        std::vector<double> measured(bodies);
        for (std::size_t b = 0; b < bodies; ++b) {
            // The nearer of the surface as it vibrates and at rest: a vibrating head does not arm a stick
            // that lies on it.
            const double rest =
                sim::rest_distance(kit_.instruments[b].body, sticks_[stick]->measured_tip(), tip_radius_m_)
                    .distance;
            measured[b] = std::min(rest, reply.clearance_m[(path + 1) * bodies + b]);
        }
        std::vector<sim::Contact> contacts = contacts_of(stick);
        if (sticks_[stick]->confirms()) {
            if (cancelling_) keep_confirmed(contacts, contacts_of(stick + 2 * sticks), s);
            ++path;
        }
        path += 2;
        scheduler_.sample(stick, s, contacts, measured, filtered, sticks_[stick]->selected_model());
    }
}

void StrikePipeline::send_notes() {
    for (const NoteChange& change : scheduler_.take_changes())
        notify_(scheduler_.strikes()[change.id - 1], change.scheduled);
}

void StrikePipeline::finish() {
    scheduler_.finish();
    send_notes();
}

/// The strike that the frame at T has to show the stick at: one whose contact lies between s and T, or one
/// that no frame has shown yet. Its rebound is unknown, so the stick stays on the surface.
const Strike* StrikePipeline::struck_by(std::uint32_t stick, double s, double T) {
    const std::vector<Strike>& all = scheduler_.strikes();
    const Strike* earliest = nullptr;
    for (auto strike = all.rbegin(); strike != all.rend() && strike->scheduled_at_s > s - 1; ++strike) {
        if (strike->stick != stick || strike->outcome == Outcome::cancelled || strike->contact_s > T)
            continue;
        if (strike->contact_s <= s && (strike->contact_s <= s - kReboundS || touching_.contains(strike->id)))
            continue;
        if (!earliest || strike->contact_s < earliest->contact_s) earliest = &*strike;
    }
    return earliest;
}

DrawnStick StrikePipeline::drawn(std::uint32_t stick, double s, double T) {
    const StickOutlook& outlook = *sticks_[stick];
    DrawnStick result{outlook.pose_at(T), {}, false};
    result.tip = tracking::point_of(result.pose, outlook.geometry().tip);
    if (const Strike* strike = struck_by(stick, s, T)) {
        touching_.insert(strike->id);
        const Eigen::Vector3d touch = strike->point_world + tip_radius_m_ * strike->normal_world;
        if (strike->contact_s > s) result.tip = outlook.sounding_tip_at(T);
        result.pose = outlook.pose_at(std::max(s, strike->contact_s));
        result.pose.position += touch - tracking::point_of(result.pose, outlook.geometry().tip).position;
        result.held = true;
        return result;
    }
    // One that has just struck and whose filter has not yet seen the rebound is drawn as it was at s.
    const std::vector<Strike>& all = scheduler_.strikes();
    for (auto strike = all.rbegin(); strike != all.rend() && strike->scheduled_at_s > s - 1; ++strike)
        if (strike->stick == stick && strike->outcome != Outcome::cancelled &&
            strike->contact_s > s - kReboundS && strike->contact_s <= s &&
            (result.tip.position - strike->point_world).dot(strike->normal_world) < 0) {
            result.pose = outlook.pose_at(s);
            result.held = true;
        }
    return result;
}

FrameContents StrikePipeline::scene(double s, double T) {
    FrameContents scene;
    for (std::uint32_t i = 0; i < sticks_.size(); ++i)
        scene.sticks.push_back(sticks_[i]->started() ? std::optional(drawn(i, s, T)) : std::nullopt);
    sim::StepRequest request;
    request.t_s = s;
    settle_impulses(s, request);
    request.pictures.push_back({std::max(T, s), drawn_.frame(T, scheduler_.strikes())});
    scene.bodies = std::move(step(request).pictures.front());
    return scene;
}

}  // namespace app
