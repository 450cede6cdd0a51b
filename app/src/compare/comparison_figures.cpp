#include "compare/comparison_figures.h"

#include <algorithm>
#include <cmath>

#include "compare/prediction_error.h"
#include "process/parallel.h"
#include "sticks/predictors.h"

namespace app {
namespace {

constexpr double kLongestS = 0.150, kStepS = 0.010;
constexpr double kWindowS = 3, kZoomS = 0.6;

std::vector<double> curve_leads() {
    std::vector<double> leads_s;
    for (int k = 0; k * kStepS < kLongestS + kStepS / 2; ++k) leads_s.push_back(k * kStepS);
    return leads_s;
}

/// Of the leads asked for, the one nearest to `lead_s`.
std::size_t nearest(const std::vector<double>& asked_s, double lead_s) {
    const auto closer = [&](double a, double b) { return std::abs(a - lead_s) < std::abs(b - lead_s); };
    return static_cast<std::size_t>(std::min_element(asked_s.begin(), asked_s.end(), closer) -
                                    asked_s.begin());
}

LeadCurve curve_of(const Entrant& entrant, std::span<const SensedStick> sticks,
                   const std::vector<double>& asked_s) {
    const std::vector<double>& leads_s = sticks.front().leads_s;
    std::vector<SquareSum> sums(leads_s.size());
    for (const SensedStick& stick : sticks) {
        const std::vector<std::string>& used = entrant.used[stick.recording];
        std::vector<std::string> done;
        for (const std::string& specification : used) {
            if (std::find(done.begin(), done.end(), specification) != done.end()) continue;
            done.push_back(specification);
            const auto predictor = make_any_predictor(specification, leads_s, stick.name);
            const std::vector<SquareSum> scored = score_positions(stick, *predictor);
            for (std::size_t lead = 0; lead < leads_s.size(); ++lead)
                if (used[nearest(asked_s, leads_s[lead])] == specification) sums[lead].add(scored[lead]);
        }
    }
    LeadCurve curve{entrant.name, {}};
    for (std::size_t lead = 0; lead < leads_s.size(); ++lead)
        if (sums[lead].count > 0) curve.rms_mm.emplace_back(leads_s[lead], sums[lead].rms_mm());
    return curve;
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
    const auto predictor = make_entrant(entrant, stick, 0, lead);
    replay(*predictor, stick.samples, [&](const ReplayedSample& now) {
        const double t_s = predictor->time_s() + now.behind_s + path.lead_s;
        if (t_s >= figure.from_s && t_s <= figure.to_s)
            path.height_m.emplace_back(t_s, predictor->predict(path.lead_s + now.behind_s).position.y());
    });
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
            (best == nullptr || summary.error.rms_mm < best->error.rms_mm))
            best = &summary;
    }
    std::vector<std::string> names;
    if (thesis) names.emplace_back("thesis");
    if (best != nullptr && best->predictor != "thesis") names.push_back(best->predictor);
    if (naive) names.emplace_back("naive");
    return names;
}

}  // namespace

std::vector<LeadCurve> lead_curves(std::span<const Recording> recordings,
                                   const std::vector<Entrant>& entrants, const ComparisonOptions& options) {
    const std::vector<SensedStick> sticks = sense_all(recordings, options.sensor, curve_leads());
    std::vector<const Entrant*> internal;
    for (const Entrant& entrant : entrants)
        if (!entrant.external) internal.push_back(&entrant);
    std::vector<LeadCurve> curves(internal.size());
    parallel_for(internal.size(), options.threads,
                 [&](std::size_t i) { curves[i] = curve_of(*internal[i], sticks, options.leads_s); });
    return curves;
}

StickFigure stick_figure(std::span<const Recording> recordings, std::span<const SensedStick> sticks,
                         const std::vector<Entrant>& entrants, const Comparison& comparison) {
    const SensedStick& stick = sticks.front();
    const std::vector<tracking::PoseSample>& recorded = recordings.front().trace.sticks.front().samples;
    StickFigure figure;
    figure.trace = recordings.front().file;
    figure.stick = stick.name;
    figure.from_s = liveliest(recorded, recorded.front().t_s + kSettlingS, recorded.back().t_s, kWindowS);
    figure.to_s = figure.from_s + kWindowS;
    figure.zoom_from_s = liveliest(recorded, figure.from_s, figure.to_s, kZoomS);
    figure.zoom_to_s = figure.zoom_from_s + kZoomS;
    for (const tracking::PoseSample& sample : recorded)
        if (sample.t_s >= figure.from_s && sample.t_s <= figure.to_s)
            figure.recorded_m.emplace_back(sample.t_s, sample.position.y());
    for (const std::string& name : drawn_predictors(comparison)) {
        const auto entrant =
            std::find_if(entrants.begin(), entrants.end(), [&](const Entrant& e) { return e.name == name; });
        for (std::size_t lead = 0; lead < stick.leads_s.size(); ++lead)
            figure.paths.push_back(path_of(*entrant, stick, lead, figure));
    }
    return figure;
}

}  // namespace app
