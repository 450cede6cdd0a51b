#include "live_notes.h"

#include <algorithm>
#include <utility>

namespace audio {
namespace {

std::pair<std::int64_t, std::uint64_t> place(const Note& note) {
    return {note.onset_sample, note.id};
}

}  // namespace

bool LiveNotes::was_taken(std::uint64_t id) const noexcept {
    return std::ranges::find(taken_, id) != taken_.end();
}

bool LiveNotes::erase(std::uint64_t id) noexcept {
    const auto found = std::ranges::find(notes_, id, &Note::id);
    if (found == notes_.end()) return false;
    notes_.erase(found);
    return true;
}

LiveNotes::Answer LiveNotes::put(const Note& note) noexcept {
    if (!erase(note.id) && was_taken(note.id)) return Answer::too_late;
    if (notes_.size() == notes_.capacity()) return Answer::full;
    notes_.insert(std::ranges::upper_bound(notes_, place(note), {}, place), note);
    return Answer::accepted;
}

LiveNotes::Answer LiveNotes::cancel(std::uint64_t id) noexcept {
    return erase(id) ? Answer::accepted : Answer::too_late;
}

void LiveNotes::take_before(std::int64_t end, std::int64_t begin, std::vector<TakenNote>& taken) noexcept {
    taken.clear();
    const auto last = std::ranges::lower_bound(notes_, end, {}, &Note::onset_sample);
    for (auto note = notes_.begin(); note != last && taken.size() < taken.capacity(); ++note) {
        taken.push_back({*note, note->onset_sample});
        taken.back().note.onset_sample = std::max(note->onset_sample, begin);
        taken_[taken_count_++ % taken_.size()] = note->id;
    }
    notes_.erase(notes_.begin(), notes_.begin() + static_cast<std::ptrdiff_t>(taken.size()));
    std::ranges::sort(taken, {}, [](const TakenNote& each) { return place(each.note); });
}

}  // namespace audio
