#include "compare/entrants.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "compare/tuning.h"
#include "files/assets.h"
#include "files/bad_input.h"
#include "sticks/auto_predictor.h"
#include "sticks/predictors.h"

namespace app {
namespace {

constexpr const char* kFromFiles = "predictions made elsewhere; their cost is not known";
constexpr const char* kAuto = "auto";
constexpr const char* kParabola = "least-squares:degree=2,n=4";

std::string description_of(const std::string& specification) {
    if (specification == kAuto)
        return fmt::format("the program's default: {} draws (errors), {} strikes, {} confirms",
                           picture_specification(specification), sound_specification(specification),
                           confirming_specification(specification));
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
    if (specification == kAuto) {
        entrant.strikes_by = sound_specification(specification);
        entrant.confirmed_by = confirming_specification(specification);
    }
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

/// `named`: recordings of --tune, none where the `others` that are compared serve.
std::string tuned_sentence(std::size_t named, std::size_t others, bool by_person) {
    const std::size_t count = named > 0 ? named : others;
    return fmt::format(
        "tuned by RMS at each lead on {}{} recording{}{}, never on the recording that is scored{}",
        named > 0 ? "" : "the other ", count, count == 1 ? "" : "s", named > 0 ? " named by --tune" : "",
        by_person ? "; ** on recordings of other persons only" : "");
}

/// Adds the tuned entrants; returns what they were tuned on.
std::string enter_tuned(std::vector<Entrant>& entrants, const std::vector<std::string>& families,
                        const ComparisonOptions& options, const Field& scored, const Field& named) {
    const Field& field = named.recordings.empty() ? scored : named;
    if (named.recordings.empty() && scored.recordings.size() < 2)
        return "nothing is tuned: one recording, and no others by --tune";
    const TuningTable table({}, families, 1e3 * options.sensor.noise_m, field.sticks, field.recordings.size(),
                            options.threads);
    std::set<std::string> persons;
    for (const Field* players : {&scored, &field})
        for (const Recording& recording : players->recordings) persons.insert(recording.person);
    bool any = false, by_person = false;
    for (const Tuning split : {Tuning::other_recordings, Tuning::other_persons})
        for (const std::string& family : families) {
            if (split == Tuning::other_persons && persons.size() < 2) continue;
            Entrant entrant = tuned(family, split, table, scored, field, options.leads_s.size());
            if (entrant.used.empty()) continue;
            any = true;
            by_person = by_person || split == Tuning::other_persons;
            entrants.push_back(std::move(entrant));
        }
    return any ? tuned_sentence(named.recordings.size(), scored.recordings.size() - 1, by_person)
               : "nothing is tuned: a recording has no others to be tuned on";
}

/// Leads and the file's own: t is written in digits.
constexpr double kSameLeadS = 1e-6;

std::size_t lead_of(const StickPredictions& predictions, const std::string& file,
                    std::span<const double> leads_s) {
    for (std::size_t lead = 0; lead < leads_s.size(); ++lead)
        if (std::abs(leads_s[lead] - predictions.lead_s) < kSameLeadS) return lead;
    throw BadInput(fmt::format(
        "{}: error: found predictions {} s ahead, expected one of the leads {}; name it in --leads", file,
        predictions.lead_s, fmt::join(leads_s, ", ")));
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
        if (field.recordings[r].trace.file == find_trace(text.substr(at + 1))) return {text.substr(0, at), r};
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
        throw BadInput(fmt::format(
            "{}: error: found predictions that fit none of the {} traces, expected a row for every "
            "sample from the second on of each stick; say NAME=FILE@TRACE to see why",
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
            throw BadInput(fmt::format(
                "{}: error: found predictions of {} {} s ahead a second time, expected one file a trace "
                "and lead",
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

std::unique_ptr<tracking::Predictor> make_entrant(const Entrant& entrant, const SensedStick& stick,
                                                  std::size_t lead, std::span<const double> leads_s,
                                                  const std::string& instead) {
    if (const auto replay = entrant.replays.find({stick.number, lead}); replay != entrant.replays.end())
        return make_replay(replay->second);
    return make_any_predictor(instead.empty() ? entrant.used[stick.recording][lead] : instead, leads_s,
                              stick.name);
}

std::vector<std::string> specifications_of(const ComparisonOptions& options) {
    std::vector<std::string> all;
    const auto add = [&](const std::string& specification) {
        if (std::ranges::find(all, specification) == all.end()) all.push_back(specification);
    };
    std::ranges::for_each(options.predictors, add);
    for (const char* baseline : {"naive", "difference", kParabola}) add(baseline);
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
