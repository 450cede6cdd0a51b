#include "compare/predictor_scores.h"

#include <sim/simulation.h>
#include <tracking/known_motion.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <memory>
#include <numbers>

#include "strikes/strike_scheduler.h"
#include "strikes/stroke_lows.h"
#include "strikes/true_contacts.h"

namespace app {
namespace {

constexpr double kMm2 = 1e6, kDegrees = 180 / std::numbers::pi;

// Contacts are looked for this far beyond the lead at which they are committed: more than a sample's period,
// so that each is seen, and re-timed, before.
constexpr double kBeyondLeadS = 0.025;

/// What a stick may strike: distances and contacts of its tip.
struct Surface {
    std::size_t parts;
    std::function<std::vector<sim::Contact>(const sim::TipPath&)> sweep;    ///< contacts of a path by time
    std::function<std::vector<double>(const Eigen::Vector3d&)> clearances;  ///< of a tip, signed [m]
    ContactForecast::Nearest nearest;                                       ///< of a part, at rest
    std::function<std::vector<TrueContact>(const TipTrack&)> true_contacts;
};

Surface plane_at(double height_m) {
    return {1, [=](const sim::TipPath& path) { return plane_contacts(path, height_m); },
            [=](const Eigen::Vector3d& tip) { return std::vector{tip.y() - height_m}; },
            [=](std::size_t, const Eigen::Vector3d& tip) {
                return sim::SurfacePoint{tip.y() - height_m, Eigen::Vector3d::UnitY()};
            },
            [=](const TipTrack& track) { return find_plane_contacts(track, height_m); }};
}

Surface surface_of(const Kit& kit, double tip_radius_m) {
    const std::vector<sim::BodyDefinition> bodies = bodies_of(kit);
    const auto sweep = [simulation = std::shared_ptr(sim::make_local_simulation(bodies)),
                        last_s = -std::numeric_limits<double>::infinity()](const sim::TipPath& path) mutable {
        sim::StepRequest request;
        // A confirming filter may lag behind: it refused the newest sample.
        request.t_s = last_s = std::max(last_s, path.nodes.front().t_s);
        request.paths = {path};
        return simulation->step(request).contacts;
    };
    const auto clearances = [=](const Eigen::Vector3d& tip) {
        std::vector<double> all;
        for (const sim::BodyDefinition& body : bodies)
            all.push_back(sim::rest_distance(body, tip, tip_radius_m).distance);
        return all;
    };
    const auto nearest = [=](std::size_t body, const Eigen::Vector3d& tip) {
        return sim::rest_distance(bodies[body], tip, tip_radius_m);
    };
    return {bodies.size(), sweep, clearances, nearest, [=](const TipTrack& track) {
                return find_true_contacts({&track, 1}, bodies, tip_radius_m);
            }};
}

std::optional<Surface> surface_under(const StrikeSurface& surface, const TipTrack& track,
                                     double tip_radius_m) {
    switch (surface.kind) {
        case StrikeSurface::Kind::plane:
            return plane_at(surface.height_m);
        case StrikeSurface::Kind::kit:
            return surface_of(surface.kit, tip_radius_m);
        case StrikeSurface::Kind::above_contact:
            if (const std::vector<Low> lows = find_lows(track); !lows.empty())
                return plane_at(contact_height(lows) + surface.height_m);
            break;
        case StrikeSurface::Kind::none:
            break;
    }
    return std::nullopt;
}

StrikeRules rules_at(const StrikeTiming& timing, bool cancelling, double t0_s) {
    const double commit_lead_s = std::max(timing.lead_s, kReleaseMarginS);
    return {.t0_s = t0_s,
            .release_margin_s = kReleaseMarginS,
            .commit_lead_s = commit_lead_s,
            .cancelling = cancelling,
            .sent_lead_s = commit_lead_s};
}

HitScore score_of(const std::vector<Strike>& strikes, std::vector<TrueContact>& contacts) {
    const StrikeScore score = score_strikes(strikes, contacts);
    HitScore hits;
    hits.true_contacts = score.true_contacts;
    hits.predicted = score.released;
    for (const TrueContact& contact : contacts) {
        if (contact.matched_id == 0) continue;
        const Strike& strike = strikes[contact.matched_id - 1];
        hits.errors_ms.push_back(1e3 * (strike.onset_s - contact.t_s));
        if (const auto dynamics = dynamics_of(strike, contact)) hits.dynamics.push_back(*dynamics);
    }
    hits.matched = static_cast<int>(hits.errors_ms.size());
    return hits;
}

std::vector<double> absolute(std::vector<double> values) {
    for (double& value : values) value = std::abs(value);
    return values;
}

/// What a model predicts at a sample.
struct Expected {
    std::vector<sim::Contact> contacts;
    std::vector<double> clearance_m, silent_until_s = {};
    operator ModelContacts() const {  // NOLINT(google-explicit-constructor)
        return {contacts, clearance_m, silent_until_s};
    }
};

using PoseAfter = std::function<tracking::PosePrediction(double)>;

/// Contacts of the path that poses by lead make from a newest sample at `time_s`.
std::vector<sim::Contact> swept(const Surface& surface, const PoseAfter& pose_after, double time_s,
                                const StickGeometry& geometry, std::span<const double> leads_s) {
    const auto path = predicted_path(pose_after, time_s, geometry, 0, leads_s);
    return path ? surface.sweep(*path) : std::vector<sim::Contact>();
}

/// What a model predicts from its newest sample.
Expected expected_of(const tracking::Predictor& predictor, std::size_t model, const Surface& surface,
                     const StickGeometry& geometry, const StrikeTiming& timing) {
    const PoseAfter pose = [&](double lead_s) { return predictor.predict_model(model, lead_s); };
    const double now_s = predictor.time_s();
    Expected expected{swept(surface, pose, now_s, geometry, strike_leads(timing)),
                      surface.clearances(tracking::point_of(pose(0), geometry.tip).position)};
    for (sim::Contact& contact : expected.contacts)
        if (!contact.starts_inside) contact.t_s = std::max(now_s, contact.t_s - timing.advance_s);
    return expected;
}

/// Follows the tip for a network of contacts.
class ForecastContacts {
public:
    ForecastContacts(const ContactForecast& forecast, const Surface& surface, const StickGeometry& geometry,
                     const StrikeTiming& timing)
        : forecast_(forecast),
          surface_(surface),
          geometry_(geometry),
          timing_(timing),
          history_(geometry.shaft, geometry.tip),
          motion_(forecast.model(), geometry.shaft) {}

    /// After a sample that `predictor` took: fills in what the network expects.
    void look(const tracking::PoseSample& sample, bool anew, const tracking::Predictor& predictor,
              ExpectedStrikes& expected) {
        if (anew) history_.restart();
        history_.push(sample);
        motion_.push(sample);
        expected.known = motion_.is_known();
        const auto path = predicted_path([&](double lead_s) { return predictor.predict(lead_s); },
                                         predictor.time_s(), geometry_, 0, strike_leads(timing_));
        if (!path || !history_.look(view_)) return;
        forecast_now_ = forecast_.after(view_, *path, {surface_.parts, surface_.nearest},
                                        std::max(timing_.lead_s, kReleaseMarginS) + kBeyondLeadS);
        expected.times = forecast_now_.times;
        if (!forecast_now_.strike) return;
        expected.network = surface_.sweep(forecast_now_.strike->path);
        for (sim::Contact& contact : expected.network)
            contact.t_s = std::max(sample.t_s, contact.t_s - timing_.advance_s);
    }

private:
    const ContactForecast& forecast_;
    const Surface& surface_;
    const StickGeometry& geometry_;
    const StrikeTiming& timing_;
    tracking::TipHistory history_;
    tracking::KnownMotion motion_;
    tracking::TipView view_;
    ContactForecast::Forecast forecast_now_;
};

}  // namespace

void ErrorScore::add(const tracking::PosePrediction& predicted, const Truth& truth,
                     const Eigen::Vector3d& tip_body) {
    const Eigen::Vector3d error = predicted.position - truth.pose.position;
    const double square_mm2 = kMm2 * error.squaredNorm();
    position.add(square_mm2);
    errors_mm.push_back(std::sqrt(square_mm2));
    if (truth.free) free.add(square_mm2);
    if (truth.unflagged) unflagged.add(square_mm2);
    if (!truth.rotation_trusted) return;
    const double angle = kDegrees * predicted.orientation.angularDistance(truth.pose.orientation);
    const Eigen::Vector3d tip_error =
        error + predicted.orientation * tip_body - truth.pose.orientation * tip_body;
    rotation.add(angle * angle);
    tip.add(kMm2 * tip_error.squaredNorm());
}

void ErrorScore::add(const ErrorScore& other) {
    for (SquareSum ErrorScore::*sum : {&ErrorScore::position, &ErrorScore::free, &ErrorScore::unflagged,
                                       &ErrorScore::rotation, &ErrorScore::tip})
        (this->*sum).add(other.*sum);
    errors_mm.insert(errors_mm.end(), other.errors_mm.begin(), other.errors_mm.end());
}

void LeadScore::add(const tracking::PosePrediction& predicted, const Truth& truth,
                    const Eigen::Vector3d& tip_body,
                    const std::optional<tracking::PoseCovariance>& covariance) {
    error.add(predicted, truth, tip_body);
    if (!covariance) return;
    ++sums.count;
    const Eigen::LLT<Eigen::Matrix3d> factor(covariance->position);
    if (factor.info() != Eigen::Success) {
        ++sums.singular;
        return;
    }
    const Eigen::Vector3d whitened = factor.matrixL().solve(predicted.position - truth.pose.position);
    const double square = whitened.squaredNorm();
    const double log_root = factor.matrixLLT().diagonal().array().log().sum();  // log sqrt(det)
    sums.inside_50 += square <= covariance->radius_50;
    sums.inside_95 += square <= covariance->radius_95;
    sums.negative_log_likelihood += 0.5 * square + log_root + 1.5 * std::log(2 * std::numbers::pi);
}

std::optional<Calibration> LeadScore::calibration() const {
    const std::size_t stated = sums.count - sums.singular;
    if (stated == 0) return std::nullopt;
    Calibration mean = sums;
    for (double* sum : {&mean.inside_50, &mean.inside_95, &mean.negative_log_likelihood})
        *sum /= static_cast<double>(stated);
    return mean;
}

void add(std::optional<Calibration>& sum, const std::optional<Calibration>& other) {
    if (!other) return;
    if (!sum) {
        sum = other;
        return;
    }
    const double a = static_cast<double>(sum->count - sum->singular);
    const double b = static_cast<double>(other->count - other->singular);
    for (double Calibration::*mean :
         {&Calibration::inside_50, &Calibration::inside_95, &Calibration::negative_log_likelihood})
        *sum.*mean = (a * (*sum.*mean) + b * (*other.*mean)) / (a + b);
    sum->count += other->count;
    sum->singular += other->singular;
}

std::vector<LeadScore> score_predictor(const SensedStick& stick, tracking::Predictor& predictor,
                                       const SeePrediction& see) {
    std::vector<LeadScore> scores(stick.leads_s.size());
    for (std::size_t i = 0; i < stick.samples.size(); ++i) {
        const double behind_s = tracking::feed(predictor, stick.samples[i]);
        for (std::size_t lead = 0; lead < scores.size(); ++lead)
            if (const std::optional<Truth>& truth = stick.truth(i, lead)) {
                const double ahead_s = stick.leads_s[lead] + behind_s;
                const tracking::PosePrediction predicted = predictor.predict(ahead_s);
                const std::optional<tracking::PoseCovariance> covariance = predictor.covariance(ahead_s);
                scores[lead].add(predicted, *truth, stick.tip, covariance);
                if (see) see(i, lead, predicted, covariance);
            }
    }
    return scores;
}

std::vector<SquareSum> score_positions(const SensedStick& stick, tracking::Predictor& predictor) {
    std::vector<SquareSum> sums(stick.leads_s.size());
    for (std::size_t i = 0; i < stick.samples.size(); ++i) {
        const tracking::PoseSample& sample = stick.samples[i];
        const double behind_s = tracking::feed(
            predictor,
            predictor.heeds_orientation() ? sample : tracking::PoseSample{sample.t_s, sample.position});
        for (std::size_t lead = 0; lead < sums.size(); ++lead)
            if (const std::optional<Truth>& truth = stick.truth(i, lead))
                sums[lead].add(
                    kMm2 * (predictor.predict(stick.leads_s[lead] + behind_s).position - truth->pose.position)
                               .squaredNorm());
    }
    return sums;
}

double HitScore::median_ms() const {
    return median(absolute(errors_ms));
}

double HitScore::p95_ms() const {
    return quantile(absolute(errors_ms), 0.95);
}

namespace {

template <class Value>
double median_of(const std::vector<StrikeDynamics>& dynamics, const Value& value) {
    std::vector<double> values;
    for (const StrikeDynamics& each : dynamics) values.push_back(value(each));
    return median(std::move(values));
}

}  // namespace

double HitScore::speed_percent() const {
    return median_of(dynamics, [](const StrikeDynamics& d) { return std::abs(d.speed_percent); });
}

double HitScore::speed_db() const {
    return median_of(dynamics, [](const StrikeDynamics& d) { return std::abs(d.speed_db); });
}

double HitScore::speed_bias_db() const {
    return median_of(dynamics, [](const StrikeDynamics& d) { return d.speed_db; });
}

double HitScore::place_mm() const {
    return median_of(dynamics, [](const StrikeDynamics& d) { return d.place_mm; });
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
    dynamics.insert(dynamics.end(), other.dynamics.begin(), other.dynamics.end());
}

std::vector<double> strike_leads(const StrikeTiming& timing) {
    return path_leads(std::max(timing.lead_s, kReleaseMarginS) + kBeyondLeadS);
}

HitScore evaluate_strikes(const TipTrack& recorded, std::span<const tracking::PoseSample> samples,
                          const StrikePredictors& predictors, const StickGeometry& geometry,
                          const StrikeSurface& where, const StrikeTiming& timing) {
    HitScore hits;
    hits.minutes = (recorded.t_s.back() - recorded.t_s.front()) / 60;
    const std::optional<Surface> surface = surface_under(where, recorded, geometry.radius_m);
    if (!surface) return hits;
    const tracking::Predictor& predictor = predictors.timing;
    tracking::Predictor* const other = predictors.confirming;
    StrikeScheduler played(rules_at(timing, true, recorded.t_s.front()), 1, surface->parts);
    StrikeScheduler uncancelled(rules_at(timing, false, recorded.t_s.front()), 1, surface->parts);
    std::optional<ForecastContacts> network;
    if (predictors.network) network.emplace(*predictors.network, *surface, geometry, timing);
    std::vector<StrikeDecision> decisions(
        predictor.models(), StrikeDecision(surface->parts, predictors.false_cost, kReleaseMarginS));
    double newest_s = 0;
    Eigen::Vector3d tip_before = Eigen::Vector3d::Zero();
    for (const tracking::PoseSample& sample : samples) {
        const tracking::SampleStatus status = predictors.timing.correct(sample);
        if (other) (void)other->correct(sample);
        if (!is_taken(status)) {
            predictor.require_working();
            continue;
        }
        const bool anew = status == tracking::SampleStatus::reinitialised;
        const Eigen::Vector3d tip = sample.position + sample.orientation * geometry.tip;
        const std::vector<double> measured = surface->clearances(tip);
        ExpectedStrikes expected{sample.t_s, anew ? 0 : sample.t_s - newest_s, measured};
        if (const double interval_s = expected.interval_s; interval_s > 0)
            expected.passed = passed_through(
                surface->sweep(measured_way(tip_before, tip, sample.t_s, interval_s, geometry.radius_m)),
                interval_s, measured);
        newest_s = sample.t_s;
        tip_before = tip;
        if (network) network->look(sample, anew, predictor, expected);
        std::vector<sim::Contact> confirming;
        if (other)
            confirming = swept(
                *surface, [&](double lead_s) { return other->predict(lead_s); }, other->time_s(), geometry,
                path_leads(kConfirmingLeadS));
        std::vector<Expected> all, sounding;
        for (std::size_t model = 0; model < predictor.models(); ++model) {
            Expected own = expected_of(predictor, model, *surface, geometry, timing);
            expected.filtered_m = own.clearance_m;
            expected.path = expected.confirmed = std::move(own.contacts);
            if (other) keep_confirmed(expected.confirmed, confirming, predictor.time_s());
            if (anew) decisions[model].restart();
            DecidedStrikes decided = decisions[model].after(expected);
            all.push_back({std::move(decided.kept), own.clearance_m});
            sounding.push_back(
                {std::move(decided.sounding), std::move(own.clearance_m), std::move(decided.silent_until_s)});
        }
        for (const auto& [strikes, contacts] : {std::pair(&played, &sounding), {&uncancelled, &all}}) {
            strikes->advance_to(sample.t_s);
            if (anew) strikes->restart(0);
            const std::vector<ModelContacts> views(contacts->begin(), contacts->end());
            strikes->sample(0, sample.t_s, views, predictor.selected(), {measured, expected.passed});
        }
    }
    std::vector<TrueContact> contacts = surface->true_contacts(recorded);
    played.finish();
    uncancelled.finish();
    const int without_cancel = score_of(uncancelled.strikes(), contacts).false_notes();
    hits.add(score_of(played.strikes(), contacts));
    hits.false_without_cancel = without_cancel;
    return hits;
}

}  // namespace app
