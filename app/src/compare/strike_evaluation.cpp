#include "compare/strike_evaluation.h"

#include <sim/simulation.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <optional>

#include "kit/tip_track.h"
#include "statistics/statistics.h"
#include "sticks/auto_predictor.h"
#include "sticks/stick_tracker.h"
#include "strikes/played_strikes.h"
#include "strikes/score_strikes.h"
#include "strikes/strike_scheduler.h"
#include "strikes/strike_score.h"
#include "strikes/stroke_lows.h"
#include "strikes/true_contacts.h"

namespace app {
namespace {

// Contacts are looked for this far beyond the lead at which they are committed: more than a sample's period,
// so that each is seen, and re-timed, before.
constexpr double kBeyondLeadS = 0.025;

/// What a stick may strike: distances and contacts of its tip.
class Surface {
public:
    virtual ~Surface() = default;
    [[nodiscard]] virtual std::size_t parts() const = 0;
    /// Contacts of a path by time, and the signed distances of its first node.
    [[nodiscard]] virtual std::vector<sim::Contact> sweep(const sim::TipPath& path) = 0;
    [[nodiscard]] virtual std::vector<double> clearances(const Eigen::Vector3d& tip) const = 0;
    [[nodiscard]] virtual std::vector<TrueContact> true_contacts(const TipTrack& track) const = 0;
};

class Plane final : public Surface {
public:
    explicit Plane(double height) : height_(height) {}

    [[nodiscard]] std::size_t parts() const override { return 1; }
    [[nodiscard]] std::vector<sim::Contact> sweep(const sim::TipPath& path) override {
        return plane_contacts(path, height_);
    }
    [[nodiscard]] std::vector<double> clearances(const Eigen::Vector3d& tip) const override {
        return {tip.y() - height_};
    }
    [[nodiscard]] std::vector<TrueContact> true_contacts(const TipTrack& track) const override {
        return find_plane_contacts(track, height_);
    }

private:
    double height_;
};

class KitSurface final : public Surface {
public:
    KitSurface(const Kit& kit, double tip_radius_m) : radius_(tip_radius_m) {
        for (const Instrument& instrument : kit.instruments) bodies_.push_back(instrument.body);
        simulation_ = sim::make_local_simulation(bodies_);
    }

    [[nodiscard]] std::size_t parts() const override { return bodies_.size(); }
    [[nodiscard]] std::vector<sim::Contact> sweep(const sim::TipPath& path) override {
        sim::StepRequest request;
        // A confirming filter may lag behind: it refused the newest sample.
        request.t_s = last_s_ = std::max(last_s_, path.nodes.front().t_s);
        request.paths = {path};
        return simulation_->step(request).contacts;
    }
    [[nodiscard]] std::vector<double> clearances(const Eigen::Vector3d& tip) const override {
        std::vector<double> all;
        for (const sim::BodyDefinition& body : bodies_)
            all.push_back(sim::rest_distance(body, tip, radius_).distance);
        return all;
    }
    [[nodiscard]] std::vector<TrueContact> true_contacts(const TipTrack& track) const override {
        return find_true_contacts({&track, 1}, bodies_, radius_);
    }

private:
    double radius_;
    double last_s_ = -std::numeric_limits<double>::infinity();
    std::vector<sim::BodyDefinition> bodies_;
    std::unique_ptr<sim::Simulation> simulation_;
};

std::unique_ptr<Surface> surface_under(const StrikeSurface& surface, const TipTrack& track,
                                       double tip_radius_m) {
    switch (surface.kind) {
        case StrikeSurface::Kind::plane:
            return std::make_unique<Plane>(surface.height_m);
        case StrikeSurface::Kind::kit:
            return std::make_unique<KitSurface>(surface.kit, tip_radius_m);
        case StrikeSurface::Kind::above_contact:
            if (const std::vector<Low> lows = find_lows(track); !lows.empty())
                return std::make_unique<Plane>(contact_height(lows) + surface.height_m);
            return nullptr;
        case StrikeSurface::Kind::none:
            break;
    }
    return nullptr;
}

StrikeRules rules_at(const StrikeTiming& timing, bool cancelling, double t0_s) {
    StrikeRules rules;
    rules.t0_s = t0_s;
    rules.release_margin_s = timing.release_margin_s;
    rules.commit_lead_s = rules.sent_lead_s = std::max(timing.lead_s, timing.release_margin_s);
    rules.cancelling = cancelling;
    return rules;
}

HitScore score_of(const std::vector<Strike>& strikes, std::vector<TrueContact>& contacts) {
    const StrikeScore score = score_strikes(strikes, contacts);
    HitScore hits;
    hits.true_contacts = score.true_contacts;
    hits.predicted = score.released;
    for (const TrueContact& contact : contacts)
        if (contact.matched_id != 0)
            hits.errors_ms.push_back(1e3 * (strikes[contact.matched_id - 1].onset_s - contact.t_s));
    hits.matched = static_cast<int>(hits.errors_ms.size());
    return hits;
}

std::vector<double> absolute(std::vector<double> values) {
    for (double& value : values) value = std::abs(value);
    return values;
}

}  // namespace

double HitScore::precision() const {
    return predicted > 0 ? static_cast<double>(matched) / predicted : kNoValue;
}

double HitScore::recall() const {
    return true_contacts > 0 ? static_cast<double>(matched) / true_contacts : kNoValue;
}

double HitScore::f1() const {
    const int both = true_contacts + predicted;
    return both > 0 ? 2.0 * matched / both : kNoValue;
}

double HitScore::median_ms() const {
    return median(absolute(errors_ms));
}

double HitScore::p95_ms() const {
    return quantile(absolute(errors_ms), 0.95);
}

double HitScore::false_per_min() const {
    return minutes > 0 ? false_notes() / minutes : 0;
}

double HitScore::false_per_min_without_cancel() const {
    return minutes > 0 ? false_without_cancel / minutes : 0;
}

double HitScore::loss() const {
    double sum = true_contacts + predicted - 2 * matched;
    for (const double error : errors_ms) sum += 0.5 * std::abs(error) / (1e3 * kMatchWindow_s);
    return sum;
}

void HitScore::add(const HitScore& other) {
    true_contacts += other.true_contacts;
    predicted += other.predicted;
    matched += other.matched;
    false_without_cancel += other.false_without_cancel;
    minutes += other.minutes;
    errors_ms.insert(errors_ms.end(), other.errors_ms.begin(), other.errors_ms.end());
}

namespace {

/// The paths of a run, at each sample, against a surface.
class Sweeps {
public:
    Sweeps(const StrikePredictors& predictors, const StickGeometry& geometry, Surface& surface,
           const StrikeTiming& timing)
        : predictors_(predictors),
          geometry_(geometry),
          surface_(surface),
          advance_s_(timing.advance_s),
          leads_(strike_leads(timing)),
          confirming_leads_(path_leads(kConfirmingLeadS)) {}

    /// Contacts that a model predicts from its newest sample.
    [[nodiscard]] std::vector<sim::Contact> of_model(std::size_t model) const {
        std::vector<sim::Contact> contacts;
        const tracking::Predictor& timing = predictors_.timing;
        const auto pose = [&](double lead) { return timing.predict_model(model, lead); };
        if (const auto path = predicted_path(pose, timing.time_s(), geometry_, 0, leads_))
            contacts = surface_.sweep(*path);
        for (sim::Contact& contact : contacts)
            if (!contact.starts_inside) contact.t_s = std::max(timing.time_s(), contact.t_s - advance_s_);
        return contacts;
    }
    [[nodiscard]] std::vector<sim::Contact> confirmed(std::vector<sim::Contact> contacts) const {
        if (!predictors_.confirming) return contacts;
        const tracking::Predictor& other = *predictors_.confirming;
        const auto pose = [&](double lead) { return other.predict(lead); };
        std::vector<sim::Contact> borne_out;
        if (const auto path = predicted_path(pose, other.time_s(), geometry_, 0, confirming_leads_))
            borne_out = surface_.sweep(*path);
        keep_confirmed(contacts, borne_out, predictors_.timing.time_s());
        return contacts;
    }

private:
    const StrikePredictors& predictors_;
    const StickGeometry& geometry_;
    Surface& surface_;
    double advance_s_;
    std::vector<double> leads_, confirming_leads_;
};

}  // namespace

std::vector<double> strike_leads(const StrikeTiming& timing) {
    return path_leads(std::max(timing.lead_s, timing.release_margin_s) + kBeyondLeadS);
}

HitScore evaluate_strikes(const tracking::StickTrace& recorded, std::span<const tracking::PoseSample> samples,
                          const StrikePredictors& predictors, const StickGeometry& geometry,
                          const StrikeSurface& where, const StrikeTiming& timing) {
    const TipTrack track = tip_track(recorded, geometry);
    HitScore hits;
    hits.minutes = (track.t_s.back() - track.t_s.front()) / 60;
    const std::unique_ptr<Surface> surface = surface_under(where, track, geometry.radius_m);
    if (!surface) return hits;
    tracking::Predictor& predictor = predictors.timing;
    const std::size_t models = predictor.models();
    PlayedStrikes played(rules_at(timing, true, track.t_s.front()), surface->parts(), models);
    PlayedStrikes uncancelled(rules_at(timing, false, track.t_s.front()), surface->parts(), models);
    const Sweeps sweeps(predictors, geometry, *surface, timing);
    for (const tracking::PoseSample& sample : samples) {
        if (predictors.confirming) (void)predictors.confirming->correct(sample);
        const tracking::SampleStatus status = predictor.correct(sample);
        const bool restarted = status == tracking::SampleStatus::reinitialised;
        if (!restarted && status != tracking::SampleStatus::accepted) continue;
        const double s = sample.t_s;
        const std::vector<double> measured =
            surface->clearances(sample.position + sample.orientation * geometry.tip);
        for (PlayedStrikes* strikes : {&played, &uncancelled}) {
            strikes->advance_to(s);
            if (restarted) strikes->restart();
        }
        for (std::size_t model = 0; model < models; ++model) {
            const std::vector<double> filtered = surface->clearances(
                tracking::point_of(predictor.predict_model(model, 0), geometry.tip).position);
            const std::vector<sim::Contact> contacts = sweeps.of_model(model);
            uncancelled.sample(model, s, contacts, measured, filtered);
            played.sample(model, s, sweeps.confirmed(contacts), measured, filtered);
        }
        played.select(predictor.selected(), s, measured);
        uncancelled.select(predictor.selected(), s, measured);
    }
    std::vector<TrueContact> contacts = surface->true_contacts(track);
    const int without_cancel = score_of(uncancelled.finish(), contacts).false_notes();
    const double minutes = hits.minutes;
    hits = score_of(played.finish(), contacts);
    hits.false_without_cancel = without_cancel;
    hits.minutes = minutes;
    return hits;
}

}  // namespace app
