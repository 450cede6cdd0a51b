#include "compare/transfer.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <stdexcept>

#include "compare/training_field.h"
#include "files/assets.h"
#include "files/bad_input.h"

namespace app {

ComparisonOptions parted_for_transfer(ComparisonOptions options) {
    std::set<std::string> persons;
    for (const std::string& trace : options.traces) persons.insert(person_of(trace, options.persons));
    for (const std::string& name : options.transfer) {
        if (!persons.contains(name)) {
            options.tune_traces.push_back(find_trace(name).string());
            continue;
        }
        const auto others = std::stable_partition(
            options.traces.begin(), options.traces.end(),
            [&](const std::string& trace) { return person_of(trace, options.persons) != name; });
        options.tune_traces.insert(options.tune_traces.end(), others, options.traces.end());
        options.traces.erase(others, options.traces.end());
    }
    std::erase_if(options.traces, [&](const std::string& trace) {
        return std::ranges::count(options.tune_traces, trace) > 0;
    });
    if (options.traces.empty())
        throw BadInput(fmt::format(
            "error: found no recording that --transfer {} leaves to be scored, expected some of others",
            fmt::join(options.transfer, " ")));
    return options;
}

std::vector<Entrant> trained_entrants(const ComparisonOptions& options, const Field& scored,
                                      const Field& field) {
    for (const Recording& recording : scored.recordings)
        for (const Recording& other : field.recordings)
            if (same_samples(recording, other))
                throw BadInput(
                    fmt::format("{}: error: found the samples of {}, which --transfer trains on, expected a "
                                "recording to be scored that is not trained on; leave one of them out",
                                recording.trace.file, other.trace.file));
    tracking::TrainingOptions training = options.training;
    training.progress = [&](double share) {
        if (options.progress) options.progress(share);
        return true;
    };
    try {
        const auto model = std::make_shared<const tracking::PathModel>(
            tracking::train_path_model(training_field(field.recordings).sticks, training).model);
        std::vector<Entrant> entrants;
        for (const char* specification : {"learned", "arbitrated"}) {
            Entrant& entrant = entrants.emplace_back();
            entrant.name = fmt::format("{}*", specification);
            entrant.description =
                fmt::format("trained on the {} of --transfer", counted(field.recordings.size(), "recording"));
            entrant.tuning = Tuning::other_recordings;
            entrant.model = model;
            entrant.used.assign(scored.recordings.size(),
                                std::vector<std::string>(options.leads_s.size(), specification));
        }
        return entrants;
    } catch (const std::invalid_argument& wrong) {
        throw BadInput(fmt::format("error: {}", wrong.what()));
    }
}

}  // namespace app
