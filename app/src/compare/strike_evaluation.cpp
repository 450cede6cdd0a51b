#include "compare/strike_evaluation.h"

#include <sim/simulation.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <optional>

#include "kit/tip_track.h"
#include "statistics/statistics.h"
#include "sticks/predictors.h"
#include "sticks/stick.h"
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

/// What a model predicts at a sample.
struct Expected {
    std::vector<sim::Contact> contacts;
    std::vector<double> clearance_m;
    operator ModelContacts() const { return {contacts, clearance_m}; }  // NOLINT(google-explicit-constructor)
};

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

    /// What a model predicts from its newest sample.
    [[nodiscard]] Expected of_model(std::size_t model) const {
        const tracking::Predictor& timing = predictors_.timing;
        const auto pose = [&](double lead) { return timing.predict_model(model, lead); };
        Expected expected{{}, surface_.clearances(tracking::point_of(pose(0), geometry_.tip).position)};
        if (const auto path = predicted_path(pose, timing.time_s(), geometry_, 0, leads_))
            expected.contacts = surface_.sweep(*path);
        for (sim::Contact& contact : expected.contacts)
            if (!contact.starts_inside) contact.t_s = std::max(timing.time_s(), contact.t_s - advance_s_);
        return expected;
    }
    [[nodiscard]] Expected confirmed(Expected expected) const {
        if (!predictors_.confirming) return expected;
        const tracking::Predictor& other = *predictors_.confirming;
        const auto pose = [&](double lead) { return other.predict(lead); };
        std::vector<sim::Contact> confirming;
        if (const auto path = predicted_path(pose, other.time_s(), geometry_, 0, confirming_leads_))
            confirming = surface_.sweep(*path);
        keep_confirmed(expected.contacts, confirming, predictors_.timing.time_s());
        return expected;
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
    StrikeScheduler played(rules_at(timing, true, track.t_s.front()), 1, surface->parts());
    StrikeScheduler uncancelled(rules_at(timing, false, track.t_s.front()), 1, surface->parts());
    const Sweeps sweeps(predictors, geometry, *surface, timing);
    replay(predictor, samples, [&](const ReplayedSample& now) {
        if (predictors.confirming) (void)predictors.confirming->correct(now.sample);
        if (!is_taken(now.status)) return;
        const std::vector<double> measured =
            surface->clearances(now.sample.position + now.sample.orientation * geometry.tip);
        std::vector<Expected> all, confirmed;
        for (std::size_t model = 0; model < models; ++model) {
            all.push_back(sweeps.of_model(model));
            confirmed.push_back(sweeps.confirmed(all.back()));
        }
        for (const auto& [strikes, expected] : {std::pair(&played, &confirmed), {&uncancelled, &all}}) {
            strikes->advance_to(now.sample.t_s);
            if (now.status == tracking::SampleStatus::reinitialised) strikes->restart(0);
            const std::vector<ModelContacts> views(expected->begin(), expected->end());
            strikes->sample(0, now.sample.t_s, views, predictor.selected(), measured);
        }
    });
    std::vector<TrueContact> contacts = surface->true_contacts(track);
    played.finish();
    uncancelled.finish();
    const int without_cancel = score_of(uncancelled.strikes(), contacts).false_notes();
    const double minutes = hits.minutes;
    hits = score_of(played.strikes(), contacts);
    hits.false_without_cancel = without_cancel;
    hits.minutes = minutes;
    return hits;
}

}  // namespace app
