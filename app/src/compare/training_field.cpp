#include "compare/training_field.h"

#include <fmt/format.h>

#include "files/bad_input.h"

namespace app {
namespace {

constexpr std::size_t kOneIn = 5;
constexpr std::size_t kFewestSamples = 20;  // of a stick, to be parted

tracking::TrainingStick stick_of(const Recording& recording, std::size_t stick, std::size_t number) {
    const MarkedTimes& marks = recording.marks[stick];
    return {recording.trace.sticks[stick],
            recording.geometry.shaft,
            recording.geometry.tip,
            marks.flagged_s,
            marks.flagged_rotations_s,
            number,
            false};
}

}  // namespace

TrainingField training_field(std::span<const Recording> recordings) {
    TrainingField field;
    const bool whole = recordings.size() >= kOneIn;
    for (std::size_t r = 0; r < recordings.size(); ++r)
        for (std::size_t s = 0; s < recordings[r].trace.sticks.size(); ++s) {
            tracking::TrainingStick stick = stick_of(recordings[r], s, r);
            if (whole) {
                stick.held_out = r % kOneIn == kOneIn - 1;
                field.sticks.push_back(std::move(stick));
                continue;
            }
            std::vector<tracking::PoseSample>& samples = stick.stick.samples;
            if (samples.size() < kFewestSamples)
                throw BadInput(fmt::format(
                    "{}: error: found {} samples of stick {}, expected at least {}; give longer recordings",
                    recordings[r].trace.file, samples.size(), stick.stick.name, kFewestSamples));
            tracking::TrainingStick end = stick;
            const auto cut = samples.size() - samples.size() / kOneIn;
            end.held_out = true;
            end.stick.samples.erase(end.stick.samples.begin(),
                                    end.stick.samples.begin() + static_cast<std::ptrdiff_t>(cut));
            samples.resize(cut);
            field.sticks.push_back(std::move(stick));
            field.sticks.push_back(std::move(end));
        }
    field.held_out = whole ? fmt::format("every fifth of {} recordings", recordings.size())
                           : fmt::format("the last fifth of each of {} recordings", recordings.size());
    return field;
}

}  // namespace app
