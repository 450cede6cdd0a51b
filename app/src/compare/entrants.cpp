#include "compare/entrants.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "compare/tuning.h"
#include "files/assets.h"
#include "files/bad_input.h"
#include "sticks/predictors.h"

namespace app {
namespace {

constexpr const char* kFromFiles = "predictions made elsewhere; their cost is not known";
constexpr const char* kAuto = "auto";
constexpr const char* kParabola = "least-squares:degree=2,n=4";

bool is_known(const std::string& specification) {
    const std::vector<std::string>& known = tracking::predictor_names();
    return std::find(known.begin(), known.end(), family_of(specification)) != known.end();
}

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

Entrant named(const std::string& specification, std::size_t recordings, std::size_t leads) {
    Entrant entrant;
    entrant.name = specification;
    entrant.description = description_of(specification);
    entrant.baseline = is_baseline(specification);
    entrant.external = is_external(specification);
    entrant.used.assign(recordings, std::vector<std::string>(leads, picture_specification(specification)));
    if (specification == kAuto) {
        entrant.strikes_by = sound_specification(specification);
        entrant.confirmed_by = confirming_specification(specification);
        entrant.learns_advance = true;
    }
    return entrant;
}

/// Which of `field` may tune for `scored`: others only.
std::vector<bool> allowed_for(const Recording& scored, std::span<const Recording> field, Tuning tuning) {
    std::vector<bool> allowed;
    for (const Recording& recording : field)
        allowed.push_back(!same_samples(recording, scored) &&
                          (tuning != Tuning::other_persons || recording.person != scored.person));
    return allowed;
}

/// The tuned entrant of a family; without specifications where some recording has nothing to be tuned on.
Entrant tuned(const std::string& family, Tuning tuning, const TuningTable& table,
              std::span<const Recording> scored, std::span<const Recording> field, std::size_t leads) {
    Entrant entrant;
    const bool persons = tuning == Tuning::other_persons;
    entrant.name = family + (persons ? "**" : "*");
    entrant.baseline = is_baseline(family);
    entrant.tuning = tuning;
    entrant.description = fmt::format("{}tuned on {}", entrant.baseline ? "baseline, " : "",
                                      persons ? "recordings of other persons" : "other recordings");
    for (const Recording& recording : scored) {
        const std::vector<bool> allowed = allowed_for(recording, field, tuning);
        std::vector<std::string> by_lead;
        for (std::size_t lead = 0; lead < leads; ++lead) {
            const std::size_t best = table.best(family, lead, allowed);
            if (best == TuningTable::npos) return Entrant{};
            by_lead.push_back(table.specification(best));
        }
        entrant.used.push_back(std::move(by_lead));
    }
    return entrant;
}

std::vector<std::string> tunable_families(const std::vector<std::string>& specifications) {
    std::vector<std::string> families;
    for (const std::string& specification : specifications) {
        const std::string family = family_of(specification);
        if (!tuning_grid(family).empty() &&
            std::find(families.begin(), families.end(), family) == families.end())
            families.push_back(family);
    }
    return families;
}

std::size_t count_persons(std::span<const Recording> a, std::span<const Recording> b) {
    std::set<std::string> persons;
    for (const std::span<const Recording> recordings : {a, b})
        for (const Recording& recording : recordings) persons.insert(recording.person);
    return persons.size();
}

/// `named`: recordings of --tune, none where the `others` that are compared serve.
std::string tuned_sentence(std::size_t named, std::size_t others, bool by_person) {
    const std::size_t count = named > 0 ? named : others;
    return fmt::format(
        "tuned by RMS at each lead on {}{} recording{}{}, never on the recording that is scored{}",
        named > 0 ? "" : "the other ", count, count == 1 ? "" : "s", named > 0 ? " named by --tune" : "",
        by_person ? "; ** on recordings of other persons only" : "");
}

void enter_tuned(EntrantList& list, const std::vector<std::string>& families,
                 const ComparisonOptions& options, const Field& scored, const Field& named) {
    const Field& field = named.recordings.empty() ? scored : named;
    if (named.recordings.empty() && scored.recordings.size() < 2) {
        list.tuned_on = "nothing is tuned: one recording, and no others by --tune";
        return;
    }
    const TuningTable table(candidates_of(families, 1e3 * options.sensor.noise_m), field.sticks,
                            field.recordings.size(), options.threads);
    std::vector<Tuning> splits = {Tuning::other_recordings};
    if (count_persons(scored.recordings, field.recordings) >= 2) splits.push_back(Tuning::other_persons);
    bool any = false, by_person = false;
    for (const Tuning split : splits)
        for (const std::string& family : families) {
            Entrant entrant =
                tuned(family, split, table, scored.recordings, field.recordings, options.leads_s.size());
            if (entrant.used.empty()) continue;
            any = true;
            by_person = by_person || split == Tuning::other_persons;
            list.entrants.push_back(std::move(entrant));
        }
    list.tuned_on = any ? tuned_sentence(named.recordings.size(), scored.recordings.size() - 1, by_person)
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

/// The sticks of one recording as a file answers them; nothing where it does not fit.
using Answers = std::vector<std::pair<std::size_t, StickPredictions>>;  // place among all sticks
Answers answers_of(const PredictionFile& file, std::span<const SensedStick> sticks, std::size_t recording) {
    Answers answers;
    for (std::size_t place = 0; place < sticks.size(); ++place)
        if (sticks[place].recording == recording)
            answers.emplace_back(place, match_predictions(file, sticks[place].name, sticks[place].samples));
    return answers;
}

/// FILE or FILE@TRACE: the file, and the recording that is named (all: none).
std::pair<std::string, std::size_t> split_file(const std::string& text,
                                               std::span<const Recording> recordings) {
    const std::size_t at = text.rfind('@');
    for (std::size_t r = 0; at != std::string::npos && r < recordings.size(); ++r)
        if (recordings[r].file == find_trace(text.substr(at + 1))) return {text.substr(0, at), r};
    return {text, recordings.size()};
}

/// The recordings whose samples a file answers; recordings sampled at the same times cannot be told apart.
std::size_t find_recording(const PredictionFile& file, std::span<const SensedStick> sticks,
                           std::span<const Recording> recordings) {
    std::vector<std::size_t> fitting;
    for (std::size_t recording = 0; recording < recordings.size(); ++recording) {
        try {
            (void)answers_of(file, sticks, recording);
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
        file.rows.file, recordings[fitting[0]].file, recordings[fitting[1]].file));
}

void add_file(Entrant& entrant, const std::string& text, std::span<const SensedStick> sticks,
              std::span<const Recording> recordings, std::span<const double> leads_s) {
    const auto [file, named_recording] = split_file(text, recordings);
    const PredictionFile predictions = read_prediction_file(file);
    // With one recording its misfit is told in full.
    const std::size_t recording = named_recording < recordings.size() ? named_recording
                                  : recordings.size() == 1            ? 0
                                                           : find_recording(predictions, sticks, recordings);
    for (const auto& [place, answer] : answers_of(predictions, sticks, recording)) {
        const std::size_t lead = lead_of(answer, file, leads_s);
        entrant.used[recording][lead] = file;
        StickPredictions exact = answer;
        exact.lead_s = leads_s[lead];
        if (!entrant.replays.emplace(std::pair{place, lead}, std::move(exact)).second)
            throw BadInput(fmt::format(
                "{}: error: found predictions of {} {} s ahead a second time, expected one file a trace "
                "and lead",
                file, entrant.name, leads_s[lead]));
    }
}

/// The entrant of a name that stands for files: the one there, or a new one.
Entrant& file_entrant(EntrantList& list, const std::string& name, std::size_t recordings, std::size_t leads) {
    for (Entrant& entrant : list.entrants) {
        if (entrant.name != name) continue;
        if (entrant.description == kFromFiles) return entrant;
        throw BadInput(
            fmt::format("error: found --predictions {}=..., expected a name that no predictor has", name));
    }
    Entrant entrant = named("", recordings, leads);
    entrant.name = name;
    entrant.description = kFromFiles;
    entrant.external = true;
    list.entrants.push_back(std::move(entrant));
    return list.entrants.back();
}

void enter_files(EntrantList& list, const ComparisonOptions& options, std::span<const SensedStick> sticks,
                 std::span<const Recording> recordings) {
    for (const auto& [name, file] : options.predictions)
        add_file(file_entrant(list, name, recordings.size(), options.leads_s.size()), file, sticks,
                 recordings, options.leads_s);
}

}  // namespace

std::unique_ptr<tracking::Predictor> make_entrant(const Entrant& entrant, const SensedStick& stick,
                                                  std::size_t place, std::size_t lead) {
    if (const auto replay = entrant.replays.find({place, lead}); replay != entrant.replays.end())
        return make_replay(replay->second);
    return make_any_predictor(entrant.used[stick.recording][lead], stick.leads_s, stick.name);
}

std::unique_ptr<tracking::Predictor> make_striker(const Entrant& entrant, const SensedStick& stick,
                                                  std::size_t place, std::size_t lead,
                                                  std::span<const double> leads_s) {
    if (entrant.replays.contains({place, lead})) return make_entrant(entrant, stick, place, lead);
    const std::string& named = entrant.used[stick.recording][lead];
    return make_any_predictor(entrant.strikes_by.empty() ? named : entrant.strikes_by, leads_s, stick.name);
}

std::vector<std::string> specifications_of(const ComparisonOptions& options) {
    std::vector<std::string> all;
    const auto add = [&](const std::string& specification) {
        if (std::find(all.begin(), all.end(), specification) == all.end()) all.push_back(specification);
    };
    for (const std::string& specification : options.predictors) add(specification);
    for (const char* baseline : {"naive", "difference", kParabola})
        if (is_known(baseline)) add(baseline);
    return all;
}

EntrantList enter(const ComparisonOptions& options, const Field& scored, const Field& tuning) {
    EntrantList list;
    const std::vector<std::string> specifications = specifications_of(options);
    for (const std::string& specification : specifications) {
        check_specification(specification);
        list.entrants.push_back(named(specification, scored.recordings.size(), options.leads_s.size()));
    }
    if (options.tuning)
        enter_tuned(list, tunable_families(specifications), options, scored, tuning);
    else
        list.tuned_on = "nothing is tuned, as asked";
    enter_files(list, options, scored.sticks, scored.recordings);
    return list;
}

}  // namespace app
