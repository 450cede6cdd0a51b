#include "compare/entrants.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <set>
#include <sstream>

#include "files/assets.h"
#include "files/bad_input.h"
#include "process/parallel.h"
#include "sticks/predictors.h"

namespace app {
namespace {

constexpr double kNoiseMm = 0.25;  // what the filters assume by default

/// What tuning tries of a family: every combination of one of each axis, the last axis fastest. An axis is words
/// with blanks between; a first one that ends in = stands before each of the others; - is the default.
struct Grid {
    const char* family;
    bool takes_noise;  ///< of the sensor
    std::vector<const char*> axes;
};

/// Densities are two values a decade, of Singer's one, from a slow hand to contacts.
const std::vector<Grid> kGrids = {
    {"naive", false, {"n= 1 2 3 4 5 6 8 11 16"}},
    {"least-squares", false, {"degree=1", "n= 2 3 4 5 6 8 12 16"}},
    {"least-squares", false, {"degree=2", "n= 3 4 5 6 8 12 16 24"}},
    {"double-exponential", false, {"a= 0.2 0.3 0.4 0.5 0.6 0.7 0.8 0.9 0.95 0.98"}},
    {"one-euro", false, {"min= 1 2 3 5 10 20 40", "beta= 0 0.01 0.1", "d= 10 30 100 1000"}},
    {"cv",
     true,
     {"q= 1e4 3e4 1e5 3e5 1e6 3e6 1e7 3e7 1e8 3e8 1e9 3e9 1e10 3e10 1e11 3e11 1e12",
      "- decay=2 decay=4 decay=8 decay=16 decay=32"}},
    {"ca", true, {"q= 1e5 3e5 1e6 3e6 1e7 3e7 1e8 3e8 1e9 3e9 1e10 3e10 1e11 3e11 1e12 3e12 1e13 3e13 1e14"}},
    {"singer", true, {"alpha= 3 10 30 100 300", "q= 1e7 1e8 1e9 1e10 1e11 1e12 1e13 1e14"}},
    {"bank", true, {"cv= 1e7 1e8 1e9", "alpha= 10 30 100", "singer= 1e10 1e11 1e12"}},
    {"imm",
     true,
     {"alpha= 10 30 100 300", "q1=1e8,q2=3e9,q3=1e11 q1=1e9,q2=3e10,q3=1e12 q1=1e10,q2=3e11,q3=1e13"}},
    {"surface", true, {"q= 1e6 3e6 1e7 3e7 1e8", "decay= 4 8 16"}}};

/// Each specification with each parameter of an axis.
std::vector<std::string> crossed(const std::vector<std::string>& specifications, const std::string& axis) {
    std::vector<std::string> all;
    for (const std::string& specification : specifications) {
        std::istringstream words(axis);
        std::string name;
        for (std::string word; words >> word;) {
            const char* before = specification.find(':') == std::string::npos ? ":" : ",";
            if (word.ends_with('='))
                name = word;
            else
                all.push_back(word == "-" ? specification
                                          : fmt::format("{}{}{}{}", specification, before, name, word));
        }
    }
    return all;
}

constexpr const char* kFromFiles = "predictions made elsewhere; their cost is not known";
constexpr const char* kParabola = "least-squares:degree=2,n=4";

std::string description_of(const std::string& specification) {
    if (is_auto(specification))
        return fmt::format("{}{} draws (errors), {} strikes, {} confirms{}",
                           specification == "auto" ? "the program's default: " : "",
                           picture_specification(specification), sound_specification(specification),
                           confirming_specification(specification),
                           contact_model(specification) ? ", a network of contacts is heard" : "");
    if (is_external(specification)) return "a child process; its cost is not measured";
    if (specification == "naive") return "baseline: the moving average of 1992, 67 ms";
    if (specification == kParabola) return "baseline: the parabola through four samples";
    return is_baseline(specification) ? "baseline, as named" : "as named";
}

Entrant named(const std::string& specification, const Field& scored, const ComparisonOptions& options) {
    Entrant entrant{specification, description_of(specification), Tuning::none, is_baseline(specification),
                    is_external(specification)};
    entrant.used.assign(
        scored.recordings.size(),
        std::vector<std::string>(options.leads_s.size(), picture_specification(specification)));
    entrant.strikes_by = is_auto(specification) ? sound_specification(specification) : "";
    entrant.confirmed_by = confirming_specification(specification);
    entrant.contacts = contact_model(specification);
    return entrant;
}

/// The tuned entrant of a family; without specifications where some recording has nothing to be tuned on.
Entrant tuned(const std::string& family, Tuning tuning, const TuningTable& table, const Field& scored,
              const Field& field, std::size_t leads) {
    const bool persons = tuning == Tuning::other_persons, baseline = is_baseline(family);
    Entrant entrant{family + (persons ? "**" : "*"),
                    fmt::format("{}tuned on {}", baseline ? "baseline, " : "",
                                persons ? "recordings of other persons" : "other recordings"),
                    tuning, baseline};
    for (const Recording& recording : scored.recordings) {
        std::vector<bool> allowed;
        for (const Recording& other : field.recordings)
            allowed.push_back(!same_samples(other, recording) &&
                              !(persons && other.person == recording.person));
        std::vector<std::string>& by_lead = entrant.used.emplace_back();
        for (std::size_t lead = 0; lead < leads; ++lead) {
            const std::optional<std::size_t> best = table.best(family, lead, allowed);
            if (!best) return {};
            by_lead.push_back(table.specification(*best));
        }
    }
    return entrant;
}

/// `from`: the recordings that tune.
std::string tuned_sentence(const std::string& from, bool by_person) {
    return fmt::format("tuned by RMS at each lead on {}, never on the recording that is scored{}", from,
                       by_person ? "; ** on recordings of other persons only" : "");
}

/// Adds the tuned entrants; returns what they were tuned on.
std::string enter_tuned(std::vector<Entrant>& entrants, const std::vector<std::string>& families,
                        const ComparisonOptions& options, const Field& scored, const Field& named) {
    const Field& field = named.recordings.empty() ? scored : named;
    if (named.recordings.empty() && scored.recordings.size() < 2)
        return "nothing is tuned: one recording, and no others by --tune";
    const TuningTable table({}, families, 1e3 * options.sensor.noise_m, field.sticks, options.threads);
    std::set<std::string> persons;
    for (const Field* players : {&scored, &field})
        for (const Recording& recording : players->recordings) persons.insert(recording.person);
    const std::size_t untuned = entrants.size();
    for (const Tuning split : {Tuning::other_recordings, Tuning::other_persons})
        for (const std::string& family : families) {
            if (split == Tuning::other_persons && persons.size() < 2) continue;
            Entrant entrant = tuned(family, split, table, scored, field, options.leads_s.size());
            if (!entrant.used.empty()) entrants.push_back(std::move(entrant));
        }
    if (entrants.size() == untuned) return "nothing is tuned: a recording has no others to be tuned on";
    const std::size_t others = scored.recordings.size() - 1, given = named.recordings.size();
    return tuned_sentence(given == 0 ? "the other " + counted(others, "recording")
                          : options.transfer.empty()
                              ? counted(given, "recording") + " named by --tune"
                              : "the " + counted(given, "recording") + " of --transfer",
                          entrants.back().tuning == Tuning::other_persons);
}

/// Leads and the file's own: t is written in digits.
constexpr double kSameLeadS = 1e-6;

std::size_t lead_of(const StickPredictions& predictions, const std::string& file,
                    std::span<const double> leads_s) {
    for (std::size_t lead = 0; lead < leads_s.size(); ++lead)
        if (std::abs(leads_s[lead] - predictions.lead_s) < kSameLeadS) return lead;
    throw BadInput(fmt::format(
        "{}: error: found predictions {:.4g} s ahead, expected one of the leads {:.4g}; name it in --leads",
        file, predictions.lead_s, fmt::join(leads_s, ", ")));
}

/// The sticks of one recording as a file answers them, by their numbers. Throws BadInput where it does not fit.
std::map<std::size_t, StickPredictions> answers_of(const PredictionFile& file, const Field& field,
                                                   std::size_t recording) {
    std::map<std::size_t, StickPredictions> answers;
    for (const SensedStick& stick : field.sticks)
        if (stick.recording == recording)
            answers.emplace(stick.number, match_predictions(file, stick.name, stick.samples));
    return answers;
}

/// FILE or FILE@TRACE: the file, and the recording that is named, if one is.
std::pair<std::string, std::optional<std::size_t>> split_file(const std::string& text, const Field& field) {
    const std::size_t at = text.rfind('@');
    for (std::size_t r = 0; at != std::string::npos && r < field.recordings.size(); ++r)
        if (const std::string& file = field.recordings[r].trace.file, named = text.substr(at + 1);
            file == named || file == assets_folder() / "traces" / (named + ".csv"))
            return {text.substr(0, at), r};
    return {text, std::nullopt};
}

/// The recording whose samples a file answers; recordings sampled at the same times cannot be told apart.
std::size_t find_recording(const PredictionFile& file, const Field& field) {
    const std::vector<Recording>& recordings = field.recordings;
    if (recordings.size() == 1) return 0;  // its misfit is stated in full
    std::vector<std::size_t> fitting;
    for (std::size_t recording = 0; recording < recordings.size(); ++recording) {
        try {
            (void)answers_of(file, field, recording);
            fitting.push_back(recording);
        } catch (const BadInput&) {  // the samples of another recording
        }
    }
    if (fitting.size() == 1) return fitting.front();
    if (fitting.empty())
        throw BadInput(
            fmt::format("{}: error: found predictions that fit none of the {} traces, expected a row for "
                        "every sample from the second on of each stick; say NAME=FILE@TRACE to see why",
                        file.rows.file, recordings.size()));
    throw BadInput(fmt::format(
        "{}: error: found predictions that fit {} and {}, expected to know which; say NAME=FILE@TRACE",
        file.rows.file, recordings[fitting[0]].trace.file, recordings[fitting[1]].trace.file));
}

void add_file(Entrant& entrant, const std::string& text, const Field& field,
              std::span<const double> leads_s) {
    const auto [file, named_recording] = split_file(text, field);
    const PredictionFile predictions = read_prediction_file(file);
    const std::size_t recording = named_recording ? *named_recording : find_recording(predictions, field);
    for (auto& [number, answer] : answers_of(predictions, field, recording)) {
        const std::size_t lead = lead_of(answer, file, leads_s);
        entrant.used[recording][lead] = file;
        answer.lead_s = leads_s[lead];
        if (!entrant.replays.emplace(std::pair{number, lead}, std::move(answer)).second)
            throw BadInput(
                fmt::format("{}: error: found predictions of {} {} s ahead a second time, expected one file "
                            "a trace and lead",
                            file, entrant.name, leads_s[lead]));
    }
}

/// The entrant of a name that stands for files: the one there, or a new one.
Entrant& file_entrant(std::vector<Entrant>& entrants, const std::string& name, const Field& scored,
                      const ComparisonOptions& options) {
    const auto found = std::ranges::find(entrants, name, &Entrant::name);
    if (found == entrants.end()) {
        entrants.push_back(named("", scored, options));
        entrants.back().name = name;
        entrants.back().description = kFromFiles;
        entrants.back().external = true;
        return entrants.back();
    }
    if (found->description == kFromFiles) return *found;
    throw BadInput(
        fmt::format("error: found --predictions {}=..., expected a name that no predictor has", name));
}

}  // namespace

std::string family_of(const std::string& specification) {
    return specification.substr(0, specification.find(':'));
}

bool is_baseline(const std::string& specification) {
    const std::string family = family_of(specification);
    return family == "hold" || family == "naive" || family == "difference" || family == "least-squares";
}

std::vector<std::string> tuning_grid(const std::string& family, double noise_mm) {
    std::vector<std::string> all;
    for (const Grid& grid : kGrids) {
        if (grid.family != family) continue;
        std::vector<std::string> specifications = {family};
        for (const char* axis : grid.axes) specifications = crossed(specifications, axis);
        if (grid.takes_noise && noise_mm > 0 && noise_mm != kNoiseMm)
            specifications = crossed(specifications, fmt::format("r={}", noise_mm));
        std::ranges::move(specifications, std::back_inserter(all));
    }
    return all;
}

std::vector<std::string> tunable_families(const std::vector<std::string>& specifications) {
    std::vector<std::string> families;
    for (const std::string& specification : specifications) {
        const std::string family = family_of(specification);
        if (!tuning_grid(family).empty() && std::ranges::find(families, family) == families.end())
            families.push_back(family);
    }
    return families;
}

TuningTable::TuningTable(std::vector<std::string> specifications, const std::vector<std::string>& families,
                         double noise_mm, std::span<const SensedStick> sticks, unsigned threads)
    : specifications_(std::move(specifications)),
      recordings_(sticks.back().recording + 1),
      leads_(sticks.back().leads_s.size()) {
    for (const std::string& family : families)
        std::ranges::move(tuning_grid(family, noise_mm), std::back_inserter(specifications_));
    sums_.resize(specifications_.size() * recordings_ * leads_);
    parallel_for(specifications_.size(), threads, [&](std::size_t candidate) {
        for (const SensedStick& stick : sticks) {
            const auto predictor =
                make_any_predictor(specifications_[candidate], stick.leads_s, {stick.name, stick.shaft});
            const std::vector<SquareSum> scored = score_positions(stick, *predictor);
            for (std::size_t lead = 0; lead < leads_; ++lead)
                sums_[(candidate * recordings_ + stick.recording) * leads_ + lead].add(scored[lead]);
        }
    });
}

std::optional<std::size_t> TuningTable::best(const std::string& family, std::size_t lead,
                                             const std::vector<bool>& allowed) const {
    std::optional<std::size_t> best;
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t candidate = 0; candidate < specifications_.size(); ++candidate) {
        if (family_of(specifications_[candidate]) != family) continue;
        SquareSum pooled;
        for (std::size_t r = 0; r < recordings_; ++r)
            if (allowed[r]) pooled.add(sum(candidate, r, lead));
        if (pooled.count == 0 || !(pooled.rms() < least)) continue;
        least = pooled.rms();
        best = candidate;
    }
    return best;
}

std::vector<std::vector<std::size_t>> passes_of(const Entrant& entrant, std::size_t recording) {
    const std::vector<std::string>& used = entrant.used[recording];
    std::vector<std::vector<std::size_t>> passes;
    for (std::size_t lead = 0; lead < used.size(); ++lead) {
        if (used[lead].empty()) continue;
        const auto same =
            std::ranges::find_if(passes, [&](const auto& pass) { return used[pass.front()] == used[lead]; });
        if (same == passes.end() || !entrant.replays.empty())
            passes.push_back({lead});
        else
            same->push_back(lead);
    }
    return passes;
}

std::unique_ptr<tracking::Predictor> make_entrant(const Entrant& entrant, const SensedStick& stick,
                                                  std::size_t lead, std::span<const double> leads_s,
                                                  const std::string& instead) {
    if (const auto replay = entrant.replays.find({stick.number, lead}); replay != entrant.replays.end())
        return make_replay(replay->second);
    return PredictorMaker(instead.empty() ? entrant.used[stick.recording][lead] : instead, entrant.model)
        .make(leads_s, {stick.name, stick.shaft});
}

HitScore strikes_of(const Entrant& entrant, const Field& field, const SensedStick& stick, std::size_t lead,
                    const ComparisonOptions& options, const StrikeTiming& timing) {
    const Recording& recording = field.recordings[stick.recording];
    const auto predictor = make_entrant(entrant, stick, lead, strike_leads(timing), entrant.strikes_by);
    std::unique_ptr<tracking::Predictor> confirming;
    if (!entrant.confirmed_by.empty())
        confirming =
            make_any_predictor(entrant.confirmed_by, path_leads(kConfirmingLeadS), {stick.name, stick.shaft});
    std::optional<ContactForecast> network;
    if (entrant.contacts) network.emplace(entrant.contacts);
    return evaluate_strikes(recording.tracks[stick.stick], stick.samples,
                            {*predictor, confirming.get(), network ? &*network : nullptr, options.false_cost},
                            recording.geometry, options.surface, timing);
}

std::vector<std::string> specifications_of(const ComparisonOptions& options) {
    std::vector<std::string> all;
    const auto add = [&](const std::string& specification) {
        if (std::ranges::find(all, specification) == all.end()) all.push_back(specification);
    };
    std::ranges::for_each(options.predictors, add);
    for (const char* baseline : {"hold", "naive", "difference", kParabola}) add(baseline);
    return all;
}

EntrantList enter(const ComparisonOptions& options, const Field& scored, const Field& tuning) {
    EntrantList list;
    const std::vector<std::string> specifications = specifications_of(options);
    for (const std::string& specification : specifications) {
        check_specification(specification);
        list.entrants.push_back(named(specification, scored, options));
    }
    list.tuned_on =
        options.tuning ? enter_tuned(list.entrants, tunable_families(specifications), options, scored, tuning)
                       : "nothing is tuned, as asked";
    for (const auto& [name, file] : options.predictions)
        add_file(file_entrant(list.entrants, name, scored, options), file, scored, options.leads_s);
    return list;
}

}  // namespace app
