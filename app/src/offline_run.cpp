#include "offline_run.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>

#include "notes.h"

namespace app {
namespace {

constexpr double kSlackS = 1e-9;    // of the causality rules
constexpr double kReboundS = 0.05;  // a filter has seen a rebound by then

/// Adds the time of its life to a sum.
class Stopwatch {
public:
    explicit Stopwatch(double& sum) : sum_(sum), start_(std::chrono::steady_clock::now()) {}
    ~Stopwatch() { sum_ += std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count(); }
    Stopwatch(const Stopwatch&) = delete;
    Stopwatch& operator=(const Stopwatch&) = delete;

private:
    double& sum_;
    std::chrono::steady_clock::time_point start_;
};

StrikeRules rules_of(const PlayOptions& options, double t0_s) {
    StrikeRules rules;
    rules.t0_s = t0_s;
    rules.release_margin_s = rules.commit_lead_s = options.release_margin_s;
    rules.cancelling = options.cancelling;
    return rules;
}

}  // namespace

OfflineRun::OfflineRun(const tracking::Trace& trace, const Kit& kit, const PlayOptions& options,
                       const StickGeometry& stick, sim::Simulation& simulation, const Stage& stage,
                       FrameWriter* frames, audio::Performance* performance)
    : trace_(trace),
      kit_(kit),
      options_(options),
      simulation_(simulation),
      stage_(stage),
      frames_(frames),
      performance_(performance),
      tip_radius_m_(stick.radius_m),
      t0_s_(trace.t0_s()),
      t_end_s_(trace.t_end_s()),
      scheduler_(rules_of(options, trace.t0_s()), trace.sticks.size(), kit.instruments.size()) {
    for (std::uint32_t i = 0; i < trace.sticks.size(); ++i)
        sticks_.emplace_back(i, trace.sticks[i].name, stick, options.picture_predictor,
                             options.sound_predictor, options.sound_lead_s);
}

std::vector<OfflineRun::Tick> OfflineRun::ticks() const {
    struct Entry {
        double t_s;
        std::uint32_t stick;
        std::size_t index;
    };
    std::vector<Entry> entries;
    for (std::uint32_t stick = 0; stick < trace_.sticks.size(); ++stick)
        for (std::size_t i = 0; i < trace_.sticks[stick].samples.size(); ++i)
            entries.push_back({trace_.sticks[stick].samples[i].t_s, stick, i});
    std::stable_sort(entries.begin(), entries.end(),
                     [](const Entry& a, const Entry& b) { return a.t_s < b.t_s; });
    std::vector<Tick> result;
    for (const Entry& entry : entries) {
        if (result.empty() || entry.t_s > result.back().t_s) result.push_back({entry.t_s, {}});
        result.back().samples.emplace_back(entry.stick, entry.index);
    }
    return result;
}

void OfflineRun::run(const std::function<void(double)>& progress) {
    const std::vector<Tick> all = ticks();
    draw_frames(-std::numeric_limits<double>::infinity(), all.front().t_s);
    for (std::size_t i = 0; i < all.size(); ++i) {
        take(all[i]);
        draw_frames(all[i].t_s,
                    i + 1 < all.size() ? all[i + 1].t_s : std::numeric_limits<double>::infinity());
        if (i % 64 == 0) progress(static_cast<double>(i) / static_cast<double>(all.size()));
    }
    scheduler_.finish();
    send_notes();
}

void OfflineRun::feed(const Tick& tick, std::vector<std::uint32_t>& moved, std::vector<sim::TipPath>& paths) {
    const Stopwatch watch(times_.tracking);
    for (const auto& [stick, index] : tick.samples) {
        const tracking::SampleStatus status = sticks_[stick].correct(trace_.sticks[stick].samples[index]);
        if (status != tracking::SampleStatus::accepted && status != tracking::SampleStatus::reinitialised) {
            ++refused_;
            continue;
        }
        if (status == tracking::SampleStatus::reinitialised) scheduler_.restart(stick);
        moved.push_back(stick);
        paths.push_back(sticks_[stick].predicted_path());
        paths.push_back(sticks_[stick].measured_path());
        // Numbered beyond the sticks, so that its contacts are told apart.
        paths.back().stick += static_cast<std::uint32_t>(sticks_.size());
        if (std::optional<sim::TipPath> confirming = sticks_[stick].confirming_path()) {
            paths.push_back(std::move(*confirming));
            paths.back().stick += 2 * static_cast<std::uint32_t>(sticks_.size());
        }
    }
}

void OfflineRun::settle_impulses(double s, sim::StepRequest& request) {
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

void OfflineRun::take(const Tick& tick) {
    const double s = tick.t_s;
    scheduler_.advance_to(s);
    if (performance_) {
        // Notes before this are fixed; those that this sample may still change lie at or after it.
        const double fixed = (s + options_.release_margin_s - t0_s_) * audio::kSampleRate;
        performance_->advance_to(static_cast<std::int64_t>(std::floor(fixed)));
    }
    sim::StepRequest request;
    request.t_s = s;
    std::vector<std::uint32_t> moved;
    feed(tick, moved, request.paths);
    settle_impulses(s, request);
    sim::StepReply reply;
    {
        const Stopwatch watch(times_.simulation);
        reply = simulation_.step(request);
    }
    const Stopwatch watch(times_.strikes);
    take_contacts(s, moved, reply);
    send_notes();
}

void OfflineRun::take_contacts(double s, const std::vector<std::uint32_t>& moved,
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
                sim::rest_distance(kit_.instruments[b].body, sticks_[stick].measured_tip(), tip_radius_m_)
                    .distance;
            measured[b] = std::min(rest, reply.clearance_m[(path + 1) * bodies + b]);
        }
        std::vector<sim::Contact> contacts = contacts_of(stick);
        if (sticks_[stick].confirms()) {
            if (options_.cancelling) keep_confirmed(contacts, contacts_of(stick + 2 * sticks), s);
            ++path;
        }
        path += 2;
        scheduler_.sample(stick, s, contacts, measured, filtered, sticks_[stick].selected_model());
    }
}

void OfflineRun::send_notes() {
    for (const NoteChange& change : scheduler_.take_changes()) {
        if (!performance_ || (options_.solo && *options_.solo != change.id)) continue;
        const Strike& strike = scheduler_.strikes()[change.id - 1];
        if (change.scheduled)
            performance_->schedule(note_of(strike, kit_.instruments[strike.instrument]));
        else
            performance_->cancel(change.id);
    }
}

void OfflineRun::draw_frames(double s, double next) {
    if (!frames_) return;
    for (;; ++next_frame_) {
        const double elapsed = static_cast<double>(next_frame_) / options_.fps;
        const double T = t0_s_ + elapsed;
        if (!(elapsed < t_end_s_ - t0_s_) || T - options_.render_lead_s + kSlackS >= next) return;
        draw_frame(s, T);
    }
}

double OfflineRun::until_contact(std::uint32_t stick, double s, double T) const {
    double until = T;
    const auto behind = [&](const Strike& strike) {
        return (sticks_[stick].tip_at(T) - strike.point_world).dot(strike.normal_world) < 0;
    };
    const std::vector<Strike>& all = scheduler_.strikes();
    for (auto strike = all.rbegin(); strike != all.rend() && strike->scheduled_at_s > s - 1; ++strike)
        if (strike->stick == stick && strike->outcome != Outcome::cancelled) {
            if (strike->contact_s > s)
                until = std::min(until, strike->contact_s);
            else if (strike->contact_s > s - kReboundS && behind(*strike))
                until = std::min(until, s);
        }
    return until;
}

void OfflineRun::draw_frame(double s, double T) {
    std::vector<std::optional<tracking::PosePrediction>> poses(sticks_.size());
    std::vector<sim::ModalState> bodies;
    if (std::isfinite(s)) {
        for (std::size_t i = 0; i < sticks_.size(); ++i)
            if (sticks_[i].started())
                poses[i] = sticks_[i].pose_at(until_contact(static_cast<std::uint32_t>(i), s, T));
        sim::StepRequest request;
        request.t_s = s;
        settle_impulses(s, request);
        request.pictures.push_back({std::max(T, s), drawn_.frame(T, scheduler_.strikes())});
        const Stopwatch watch(times_.simulation);
        bodies = std::move(simulation_.step(request).pictures.front());
    }
    const Stopwatch watch(times_.waiting_for_frames);
    frames_->push(stage_.frame(bodies, poses));
}

}  // namespace app
