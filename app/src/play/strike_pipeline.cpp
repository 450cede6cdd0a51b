#include "play/strike_pipeline.h"

#include <algorithm>
#include <iterator>

#include "sticks/predictors.h"
#include "strikes/strike_note.h"

namespace app {
namespace {

constexpr double kFadeS = 0.1;
constexpr double kLongAgoS = 2;  // no cancelled strike comes back after that

bool same(const sim::Impulse& a, const sim::Impulse& b) {
    return a.t_s == b.t_s && a.point_body == b.point_body && a.impulse_body == b.impulse_body;
}

double toward(double value, double target, double step) {
    return value < target ? std::min(target, value + step) : std::max(target, value - step);
}

std::vector<double> tip_holds(const Kit& kit) {
    std::vector<double> holds;
    for (const Instrument& instrument : kit.instruments) holds.push_back(instrument.tip_choke_s);
    return holds;
}

constexpr double kRecentS = 1;
constexpr double kReboundS = 0.05;  // a filter has seen a rebound by then

}  // namespace

sim::Impulse impulse_of(const Strike& strike) {
    return {strike.instrument, strike.contact_s, strike.point_body, strike.impulse_body};
}

void DrawnStrikes::start(double T, std::span<const Strike> strikes) {
    const auto settled = [&](const Strike& strike) {
        if (strike.outcome == Outcome::cancelled) return strike.decided_at_s < T - kLongAgoS;
        const Mark mark = mark_of(strike.id);
        return mark.seen && mark.folded;
    };
    while (first_open_ < strikes.size() && settled(strikes[first_open_])) ++first_open_;
    for (std::size_t i = first_open_; i < strikes.size(); ++i) {
        const Strike& strike = strikes[i];
        if (strike.outcome == Outcome::cancelled || strike.contact_s > T || mark_of(strike.id).seen) continue;
        mark(strike.id).seen = mark(strike.id).drawn = true;
        drawn_.push_back({strike.id, impulse_of(strike)});
    }
}

std::vector<sim::WeightedImpulse> DrawnStrikes::frame(double T, std::span<const Strike> strikes,
                                                      const ChokedBodies& choked) {
    const double step = (T - last_s_) / kFadeS;
    last_s_ = T;
    const auto is_replaced = [&](const Drawn& d) {
        const Strike& strike = strikes[d.id - 1];
        return strike.outcome == Outcome::released && !same(d.first, impulse_of(strike));
    };
    for (Drawn& d : drawn_) {
        const Strike& strike = strikes[d.id - 1];
        const bool replaced = is_replaced(d);
        d.first_weight =
            toward(d.first_weight, replaced || strike.outcome == Outcome::cancelled ? 0 : 1, step);
        if (replaced) d.final_weight = toward(d.final_weight, 1, step);
    }
    start(T, strikes);

    std::vector<sim::WeightedImpulse> result;
    const auto add = [&](const sim::Impulse& impulse, double weight, bool is_folded) {
        const double excess = weight * choked.weight(impulse, T) - (is_folded ? 1 : 0);
        if (excess != 0) result.push_back({impulse, excess});
    };
    for (const Drawn& d : drawn_) {
        const Mark mark = mark_of(d.id);
        if (mark.stopped) continue;
        const bool replaced = is_replaced(d);
        add(d.first, d.first_weight, mark.folded && !replaced);
        add(impulse_of(strikes[d.id - 1]), d.final_weight, mark.folded && replaced);
    }
    for (const ChokedBodies::Folded& moving : choked.moving())
        if (!mark_of(moving.id).drawn) add(moving.impulse, 1, true);
    std::erase_if(drawn_, [&](const Drawn& d) {
        const bool faded = d.first_weight == 0 && strikes[d.id - 1].outcome == Outcome::cancelled;
        if (faded) mark(d.id).seen = false;
        const bool replaced_settled = d.final_weight == 1 && d.first_weight == 0;
        const bool first_settled =
            d.first_weight == 1 && d.final_weight == 0 && same(d.first, impulse_of(strikes[d.id - 1]));
        const Mark known = mark_of(d.id);
        const bool over = faded || known.stopped || (known.folded && (replaced_settled || first_settled));
        mark(d.id).drawn = !over;
        return over;
    });
    return result;
}

StrikePipeline::StrikePipeline(const Kit& kit, const PipelineSettings& settings,
                               const std::vector<Stick>& sticks, sim::Simulation& simulation, Notify notify,
                               const std::shared_ptr<const tracking::PathModel>& contacts)
    : kit_(kit),
      settings_(settings),
      sticks_(sticks),
      simulation_(simulation),
      notify_(std::move(notify)),
      scheduler_({.t0_s = settings.t0_s,
                  .release_margin_s = settings.release_margin_s,
                  .commit_lead_s = settings.release_margin_s,
                  .cancelling = settings.cancelling},
                 sticks_.size(), kit.instruments.size()),
      rests_(tip_holds(kit), sticks_.size()),
      decisions_(sticks_.size() * tracking::StickState::kMostModels,
                 StrikeDecision(kit.instruments.size(), settings.false_cost, settings.release_margin_s)),
      choked_(kit, settings.t0_s, settings.render_lead_s) {
    if (!contacts) return;
    network_.emplace(contacts);
    for (const Stick& stick : sticks_) motions_.emplace_back(*contacts, stick.geometry().shaft);
}

void StrikePipeline::restart(std::uint32_t stick) {
    scheduler_.restart(stick);
    rests_.restart(stick);
    for (std::size_t model = 0; model < tracking::StickState::kMostModels; ++model)
        decisions_[stick * tracking::StickState::kMostModels + model].restart();
}

void StrikePipeline::advance_to(double s, double fixed_s) {
    scheduler_.advance_to(s, fixed_s);
    send_notes();
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

std::vector<StrikePipeline::StickPaths> StrikePipeline::add_paths(std::span<const std::uint32_t> moved,
                                                                  std::vector<sim::TipPath>& paths) const {
    const auto add = [&](sim::TipPath path) {
        path.stick = static_cast<std::uint32_t>(paths.size());
        paths.push_back(std::move(path));
        return paths.size() - 1;
    };
    std::vector<StickPaths> all;
    for (const std::uint32_t stick : moved) {
        const Stick& known = sticks_[stick];
        StickPaths own{.stick = stick, .predicted = paths.size()};
        for (std::size_t model = 0; model < known.state().models; ++model) add(known.predicted_path(model));
        own.measured = add(known.measured_path());
        if (std::optional<sim::TipPath> way = known.way()) own.way = add(std::move(*way));
        if (std::optional<sim::TipPath> confirming = known.confirming_path())
            own.confirming = add(std::move(*confirming));
        if (network_) {
            ContactForecast::Forecast expected = forecast(known);
            own.times = std::move(expected.times);
            if (expected.strike) own.network = add(std::move(expected.strike->path));
        }
        all.push_back(std::move(own));
    }
    return all;
}

ContactForecast::Forecast StrikePipeline::forecast(const Stick& stick) const {
    const ContactForecast::Surfaces surfaces{
        kit_.instruments.size(), [this](std::size_t instrument, const Eigen::Vector3d& tip) {
            return sim::rest_distance(kit_.instruments[instrument].body, tip, settings_.tip_radius_m);
        }};
    tracking::TipView view;
    if (!stick.look(view)) return {};
    return network_->after(view, stick.predicted_path(0), surfaces, stick.sound_lead_s());
}

void StrikePipeline::follow_motion(std::span<const std::uint32_t> moved) {
    if (!network_) return;
    for (const std::uint32_t stick : moved) {
        const tracking::StickState& state = sticks_[stick].state();
        motions_[stick].push({state.t_s, state.position, state.orientation, state.oriented != 0});
    }
}

void StrikePipeline::settle_impulses(double s, sim::StepRequest& request) {
    for (const std::uint64_t id : scheduler_.take_released()) {
        unfolded_.push_back(id);
        const Strike& released = scheduler_.strikes()[id - 1];
        rests_.struck(released.instrument, released.onset_s);
        choked_.take(note_of(released, kit_.instruments[released.instrument]), s);
    }
    std::vector<std::uint64_t> ahead;
    for (const std::uint64_t id : unfolded_) {
        const sim::Impulse impulse = impulse_of(scheduler_.strikes()[id - 1]);
        if (impulse.t_s <= s) {
            request.folded.push_back(impulse);
            drawn_.folded(id);
            choked_.folded({id, impulse});
        } else {
            request.confirmed.push_back(impulse);
            ahead.push_back(id);
        }
    }
    unfolded_ = std::move(ahead);
    for (ChokedBodies::Folded& strike : choked_.take_stopped(s)) {
        strike.impulse.impulse_body *= -1;
        request.folded.push_back(strike.impulse);
        drawn_.stopped(strike.id);
    }
}

void StrikePipeline::take(double s, std::span<const std::uint32_t> moved) {
    sim::StepRequest request;
    request.t_s = s;
    std::vector<StickPaths> paths;
    {
        const Stopwatch watch(times_.tracking);
        follow_motion(moved);
        paths = add_paths(moved, request.paths);
    }
    settle_impulses(s, request);
    const sim::StepReply reply = step(request);
    const Stopwatch watch(times_.strikes);
    for (const StickPaths& stick : paths) take_contacts(s, stick, reply);
    send_notes();
}

std::vector<double> StrikePipeline::measured_clearance(const StickPaths& paths,
                                                       const sim::StepReply& reply) const {
    const std::size_t bodies = kit_.instruments.size();
    const Eigen::Vector3d& tip = sticks_[paths.stick].measured_tip();
    std::vector<double> measured(bodies);
    for (std::size_t b = 0; b < bodies; ++b) {
        // The nearer of the surface as it vibrates and at rest: a vibrating head does not arm a stick that lies
        // on it.
        const double rest =
            sim::rest_distance(kit_.instruments[b].body, tip, settings_.tip_radius_m).distance;
        measured[b] = std::min(rest, reply.clearance_m[paths.measured * bodies + b]);
    }
    return measured;
}

void StrikePipeline::take_contacts(double s, const StickPaths& paths, const sim::StepReply& reply) {
    const std::size_t bodies = kit_.instruments.size();
    const auto contacts_of = [&](std::size_t path) {
        std::vector<sim::Contact> own;
        std::ranges::copy_if(reply.contacts, std::back_inserter(own),
                             [&](const sim::Contact& contact) { return contact.stick == path; });
        return own;
    };
    const std::vector<double> measured = measured_clearance(paths, reply);
    const Stick& known = sticks_[paths.stick];
    ExpectedStrikes expected{s, known.interval_s(), measured};
    if (paths.way) expected.passed = passed_through(contacts_of(*paths.way), known.interval_s(), measured);
    if (paths.network) expected.network = contacts_of(*paths.network);
    expected.times = paths.times;
    expected.known = network_ && motions_[paths.stick].is_known();
    std::vector<std::vector<sim::Contact>> contacts;
    std::vector<std::vector<double>> silent_until_s;
    std::vector<ModelContacts> views;
    for (std::size_t model = 0; paths.predicted + model < paths.measured; ++model) {
        const std::size_t path = paths.predicted + model;
        expected.filtered_m = std::span(reply.clearance_m).subspan(path * bodies, bodies);
        expected.path = expected.confirmed = contacts_of(path);
        if (paths.confirming && settings_.cancelling)
            keep_confirmed(expected.confirmed, contacts_of(*paths.confirming), s);
        DecidedStrikes decided =
            decisions_[paths.stick * tracking::StickState::kMostModels + model].after(expected);
        contacts.push_back(std::move(settings_.cancelling ? decided.sounding : decided.kept));
        silent_until_s.push_back(std::move(decided.silent_until_s));
        views.push_back({{}, expected.filtered_m});
    }
    for (std::size_t model = 0; model < views.size(); ++model) {
        views[model].contacts = contacts[model];
        views[model].silent_until_s = silent_until_s[model];
    }
    scheduler_.sample(paths.stick, s, views, known.state().model, {measured, expected.passed});
    rests_.sample(paths.stick, s, known.measured_tip(), measured);
}

std::vector<TipRest> StrikePipeline::take_tip_rests() {
    std::vector<TipRest> rests = rests_.take();
    for (const TipRest& rest : rests)
        choked_.end(rest.instrument, rest.s + settings_.release_margin_s, rest.s);
    return rests;
}

void StrikePipeline::send_notes() {
    for (const std::uint64_t id : scheduler_.take_changes()) {
        const Strike& strike = scheduler_.strikes()[id - 1];
        notify_(note_of(strike, kit_.instruments[strike.instrument]), strike.outcome != Outcome::cancelled);
    }
}

void StrikePipeline::finish() {
    scheduler_.finish();
    send_notes();
}

/// The strikes of a stick that are not cancelled and were predicted within the last second, newest first.
std::vector<const Strike*> StrikePipeline::recent(std::uint32_t stick, double s) const {
    std::vector<const Strike*> found;
    const std::vector<Strike>& all = scheduler_.strikes();
    for (auto strike = all.rbegin(); strike != all.rend() && strike->scheduled_at_s > s - kRecentS; ++strike)
        if (strike->stick == stick && strike->outcome != Outcome::cancelled) found.push_back(&*strike);
    return found;
}

/// The strike that the frame at T has to show the stick at: one whose contact lies between s and T, or one
/// that no frame has shown yet. Its rebound is unknown, so the stick stays on the surface.
const Strike* StrikePipeline::struck_by(std::uint32_t stick, double s, double T) const {
    const Strike* earliest = nullptr;
    for (const Strike* strike : recent(stick, s)) {
        const bool shown = strike->contact_s <= s - kReboundS || touching_.contains(strike->id);
        if (strike->contact_s > T || (strike->contact_s <= s && shown)) continue;
        if (!earliest || strike->contact_s < earliest->contact_s) earliest = strike;
    }
    return earliest;
}

DrawnStick StrikePipeline::drawn(std::uint32_t stick, double s, double T, bool shows) {
    const Stick& known = sticks_[stick];
    DrawnStick result{known.pose_at(T), {}, false};
    result.tip = tracking::point_of(result.pose, known.geometry().tip);
    if (const Strike* strike = struck_by(stick, s, T)) {
        if (shows) touching_.insert(strike->id);
        const Eigen::Vector3d touch = strike->point_world + settings_.tip_radius_m * strike->normal_world;
        if (strike->contact_s > s) result.tip = known.sounding_tip_at(T);
        result.pose = known.pose_at(std::max(s, strike->contact_s));
        result.pose.position += touch - tracking::point_of(result.pose, known.geometry().tip).position;
        result.held = true;
        return result;
    }
    // One that has just struck and whose filter has not yet seen the rebound is drawn as it was at s.
    for (const Strike* strike : recent(stick, s))
        if (strike->contact_s > s - kReboundS && strike->contact_s <= s &&
            (result.tip.position - strike->point_world).dot(strike->normal_world) < 0) {
            result.pose = known.pose_at(s);
            result.held = true;
        }
    return result;
}

FrameContents StrikePipeline::scene(double s, double T) {
    return std::move(scenes(s, {&T, 1}).front());
}

std::vector<FrameContents> StrikePipeline::scenes(double s, std::span<const double> moments) {
    std::erase_if(touching_, [&](std::uint64_t id) {
        return scheduler_.strikes()[id - 1].scheduled_at_s <= s - kRecentS;
    });
    std::vector<FrameContents> scenes(moments.size());
    sim::StepRequest request;
    request.t_s = s;
    settle_impulses(s, request);
    for (std::size_t m = 0; m < moments.size(); ++m) {
        const double T = moments[m];
        for (std::uint32_t i = 0; i < sticks_.size(); ++i)
            scenes[m].sticks.push_back(
                sticks_[i].started() ? std::optional(drawn(i, s, T, m + 1 == moments.size())) : std::nullopt);
        request.pictures.push_back({std::max(T, s), drawn_.frame(T, scheduler_.strikes(), choked_)});
    }
    sim::StepReply reply = step(request);
    for (std::size_t m = 0; m < moments.size(); ++m) scenes[m].bodies = std::move(reply.pictures[m]);
    return scenes;
}

}  // namespace app
