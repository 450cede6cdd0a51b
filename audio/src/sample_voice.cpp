#include "sample_voice.h"

#include <utility>

namespace audio {

SampleVoice::SampleVoice(CsoundEngine& engine, std::shared_ptr<const SampleSet> set, int first_table)
    : set_(std::move(set)), first_table_(first_table), counts_(set_->regions.size(), 0) {
    for (std::size_t i = 0; i < set_->waves.size(); ++i)
        engine.make_table(first_table_ + static_cast<int>(i), set_->waves[i]);
    events_.reserve(set_->regions.size());
    first_ = event(set_->regions.at(0), 1).fields;
}

SampleVoice::Event SampleVoice::event(const SampleRegion& region, double gain) const {
    return {{static_cast<double>(first_table_) + region.wave, static_cast<double>(region.frames), gain},
            region.left,
            region.right};
}

const std::vector<SampleVoice::Event>& SampleVoice::strike(const Note& note) {
    events_.clear();
    answer(*set_, note.midi_note, stroke_velocity(note.speed_mps),
           stroke_random(note.onset_sample, note.voice), counts_,
           [this](const SampleRegion& region, double gain) { events_.push_back(event(region, gain)); });
    return events_;
}

}  // namespace audio
