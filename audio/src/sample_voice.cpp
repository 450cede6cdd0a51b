#include "sample_voice.h"

#include <utility>

namespace audio {

int SampleTables::number(CsoundEngine& engine, const std::vector<float>& wave) {
    const auto [known, is_new] = numbers_.try_emplace(&wave, next_);
    if (is_new) engine.make_table(next_++, wave);
    return known->second;
}

SampleVoice::SampleVoice(CsoundEngine& engine, std::shared_ptr<const SampleSet> set, SampleTables& tables)
    : set_(std::move(set)), counts_(set_->regions.size(), 0) {
    for (const auto& wave : set_->waves) tables_.push_back(tables.number(engine, *wave));
    events_.reserve(set_->regions.size());
    first_ = event(set_->regions.at(0), 1).fields;
}

SampleVoice::Event SampleVoice::event(const SampleRegion& region, double gain) const {
    return {{static_cast<double>(tables_[region.wave]), static_cast<double>(region.frames), gain},
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
