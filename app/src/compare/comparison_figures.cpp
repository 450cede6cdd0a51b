#include "compare/comparison_figures.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <string>

#include "process/parallel.h"

namespace app {
namespace {

constexpr double kLongestS = 0.150, kStepS = 0.010;
constexpr double kWindowS = 3, kZoomS = 0.6;

/// Of the leads asked for, the one nearest to `lead_s`.
std::size_t nearest(const std::vector<double>& asked_s, double lead_s) {
    const auto distance = [&](double asked) { return std::abs(asked - lead_s); };
    return static_cast<std::size_t>(std::ranges::min_element(asked_s, {}, distance) - asked_s.begin());
}

LeadCurve curve_of(const Entrant& entrant, std::span<const SensedStick> sticks,
                   const std::vector<double>& asked_s) {
    const std::vector<double>& leads_s = sticks.front().leads_s;
    std::vector<SquareSum> sums(leads_s.size());
    for (const SensedStick& stick : sticks) {
        for (const std::vector<std::size_t>& pass : passes_of(entrant, stick.recording)) {
            const auto predictor = make_entrant(entrant, stick, pass.front(), leads_s);
            const std::vector<SquareSum> scored = score_positions(stick, *predictor);
            for (std::size_t lead = 0; lead < leads_s.size(); ++lead)
                if (std::ranges::count(pass, nearest(asked_s, leads_s[lead])) > 0)
                    sums[lead].add(scored[lead]);
        }
    }
    LeadCurve curve{entrant.name, {}};
    for (std::size_t lead = 0; lead < leads_s.size(); ++lead)
        if (sums[lead].count > 0) curve.rms_mm.emplace_back(leads_s[lead], sums[lead].rms());
    return curve;
}

std::vector<std::pair<double, HitScore>> hits_over_lead(const Entrant& entrant, const Field& field,
                                                        const ComparisonOptions& options) {
    std::vector<std::pair<double, HitScore>> hits;
    for (const double lead_s : {0.01, 0.02, 0.03, 0.045, 0.06, 0.08, 0.1, 0.125, 0.15}) {
        hits.emplace_back(lead_s, HitScore());
        for (const SensedStick& stick : field.sticks)
            hits.back().second.add(strikes_of(entrant, field, stick, 0, options, {lead_s}));
    }
    return hits;
}

/// The lead from which on what `above` says of a point is > 0, linearly between the points before and after.
template <class Points, class Above>
std::optional<double> crossing_s(const Points& points, const Above& above) {
    double before_s = 0, before = 0;
    for (std::size_t i = 0; i < points.size(); ++i) {
        const double lead_s = points[i].first, now = above(points[i].second);
        if (now > 0) return i == 0 ? lead_s : std::lerp(before_s, lead_s, before / (before - now));
        before_s = lead_s, before = now;
    }
    return std::nullopt;
}

/// Start of the `length_s` in [from_s, to_s] in which the recorded point rises and falls most.
double liveliest(const std::vector<tracking::PoseSample>& samples, double from_s, double to_s,
                 double length_s) {
    double best = -1, start_s = from_s, sum = 0;
    std::size_t first = 0;
    while (first + 1 < samples.size() && samples[first].t_s < from_s) ++first;
    const auto way = [&](std::size_t i) {
        return std::abs(samples[i].position.y() - samples[i - 1].position.y());
    };
    for (std::size_t i = first + 1; i < samples.size() && samples[i].t_s <= to_s; ++i) {
        sum += way(i);
        while (samples[i].t_s - samples[first].t_s > length_s) sum -= way(++first);
        if (sum > best) best = sum, start_s = samples[first].t_s;
    }
    return start_s;
}

FigurePath path_of(const Entrant& entrant, const SensedStick& stick, std::size_t lead,
                   const StickFigure& figure) {
    FigurePath path{entrant.name, entrant.used[stick.recording][lead], stick.leads_s[lead], {}};
    const auto predictor = make_entrant(entrant, stick, lead, stick.leads_s);
    for (const tracking::PoseSample& sample : stick.samples) {
        const double behind_s = tracking::feed(*predictor, sample),
                     t_s = predictor->time_s() + behind_s + path.lead_s;
        if (t_s >= figure.from_s && t_s <= figure.to_s)
            path.height_m.emplace_back(t_s, predictor->predict(path.lead_s + behind_s).position.y());
    }
    return path;
}

/// Names of the predictors whose paths are drawn.
std::vector<std::string> drawn_predictors(const Comparison& comparison) {
    const std::vector<double>& leads_s = comparison.options.leads_s;
    const double middle_s = leads_s[leads_s.size() / 2];
    const ComparisonSummary* best = nullptr;
    bool thesis = false, naive = false;
    for (const ComparisonSummary& summary : comparison.summaries) {
        thesis = thesis || summary.predictor == "thesis";
        naive = naive || summary.predictor == "naive";
        if (summary.lead_s == middle_s && !summary.baseline && !summary.external &&
            (best == nullptr || summary.error.position.rms() < best->error.position.rms()))
            best = &summary;
    }
    std::vector<std::string> names;
    if (thesis) names.emplace_back("thesis");
    if (best != nullptr && best->predictor != "thesis") names.push_back(best->predictor);
    if (naive) names.emplace_back("naive");
    return names;
}

}  // namespace

bool tells_how_far(const std::string& predictor) {
    const std::string family = family_of(predictor.substr(0, predictor.find('*')));
    return predictor == "naive" || predictor == "thesis" || family == "auto" || family == "learned" ||
           family == "arbitrated";
}

std::optional<double> LeadCurve::passes(double rms) const {
    return crossing_s(rms_mm, [rms](const double& value) { return value - rms; });
}

std::optional<double> LeadCurve::falls_below(double f1) const {
    return crossing_s(hits, [f1](const HitScore& score) { return f1 - score.f1(); });
}

std::vector<LeadCurve> lead_curves(const Field& field, const std::vector<Entrant>& entrants,
                                   const ComparisonOptions& options) {
    std::vector<double> leads_s;
    for (int k = 0; k * kStepS < kLongestS + kStepS / 2; ++k) leads_s.push_back(k * kStepS);
    const std::vector<SensedStick> sticks = sense_all(field.recordings, options.sensor, leads_s);
    std::vector<LeadCurve> curves(entrants.size());
    parallel_for(entrants.size(), options.threads, [&](std::size_t i) {
        if (entrants[i].external) return;
        curves[i] = curve_of(entrants[i], sticks, options.leads_s);
        if (options.surface.kind != StrikeSurface::Kind::none && tells_how_far(entrants[i].name))
            curves[i].hits = hits_over_lead(entrants[i], field, options);
    });
    std::erase_if(curves, [](const LeadCurve& curve) { return curve.predictor.empty(); });
    return curves;
}

StickFigure stick_figure(const Field& field, const std::vector<Entrant>& entrants,
                         const Comparison& comparison) {
    const SensedStick& stick = field.sticks.front();
    const tracking::Trace& trace = field.recordings.front().trace;
    const std::vector<tracking::PoseSample>& recorded = trace.sticks.front().samples;
    StickFigure figure;
    figure.trace = trace.file;
    figure.stick = stick.name;
    figure.from_s = liveliest(recorded, recorded.front().t_s + kSettlingS, recorded.back().t_s, kWindowS);
    figure.to_s = figure.from_s + kWindowS;
    figure.zoom_from_s = liveliest(recorded, figure.from_s, figure.to_s, kZoomS);
    figure.zoom_to_s = figure.zoom_from_s + kZoomS;
    for (const tracking::PoseSample& sample : recorded)
        if (sample.t_s >= figure.from_s && sample.t_s <= figure.to_s)
            figure.recorded_m.emplace_back(sample.t_s, sample.position.y());
    for (const std::string& name : drawn_predictors(comparison)) {
        const Entrant& entrant = *std::ranges::find(entrants, name, &Entrant::name);
        for (std::size_t lead = 0; lead < stick.leads_s.size(); ++lead)
            figure.paths.push_back(path_of(entrant, stick, lead, figure));
    }
    return figure;
}

}  // namespace app
