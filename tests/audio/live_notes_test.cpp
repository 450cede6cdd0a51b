#include "live_notes.h"

#include <gtest/gtest.h>

#include "rendering.h"

namespace {

using audio::LiveNotes;
using rendering::note;

std::vector<audio::TakenNote> room(std::size_t capacity) {
    std::vector<audio::TakenNote> taken;
    taken.reserve(capacity);
    return taken;
}

std::vector<std::uint64_t> ids(const std::vector<audio::TakenNote>& taken) {
    std::vector<std::uint64_t> all;
    for (const audio::TakenNote& each : taken) all.push_back(each.note.id);
    return all;
}

TEST(LiveNotes, AreTakenInOrderOfOnsetThenIdWhateverTheirOrderOfArrival) {
    LiveNotes notes(8);
    for (const auto& each : {note(4, 200), note(3, 100), note(1, 200), note(2, 150), note(5, 64)}) {
        EXPECT_EQ(notes.put(each), LiveNotes::Answer::accepted);
    }
    auto taken = room(8);
    notes.take_before(200, 64, taken);
    EXPECT_EQ(ids(taken), (std::vector<std::uint64_t>{5, 3, 2}));
    notes.take_before(201, 200, taken);
    EXPECT_EQ(ids(taken), (std::vector<std::uint64_t>{1, 4}));
    notes.take_before(1000, 256, taken);
    EXPECT_TRUE(taken.empty());
}

TEST(LiveNotes, ThatComeTooLateSoundAtTheBeginOfTheBlockAndKeepTheirPlan) {
    LiveNotes notes(8);
    for (const auto& each : {note(9, 10), note(7, 64), note(8, 30), note(6, 70)}) (void)notes.put(each);
    auto taken = room(8);
    notes.take_before(128, 64, taken);
    EXPECT_EQ(ids(taken), (std::vector<std::uint64_t>{7, 8, 9, 6})) << "by onset that sounds, then id";
    EXPECT_EQ(taken[2].note.onset_sample, 64);
    EXPECT_EQ(taken[2].planned_sample, 10);
    EXPECT_EQ(taken[3].note.onset_sample, 70);
}

TEST(LiveNotes, AreMovedAndCancelledUntilTheyAreTaken) {
    LiveNotes notes(8);
    (void)notes.put(note(1, 100));
    EXPECT_EQ(notes.put(note(1, 300)), LiveNotes::Answer::accepted);
    (void)notes.put(note(2, 100));
    (void)notes.put(note(3, 110));
    EXPECT_EQ(notes.cancel(2), LiveNotes::Answer::accepted);
    EXPECT_EQ(notes.cancel(2), LiveNotes::Answer::too_late) << "it is unknown now";
    auto taken = room(8);
    notes.take_before(128, 64, taken);
    EXPECT_EQ(ids(taken), std::vector<std::uint64_t>{3});
    EXPECT_EQ(notes.put(note(3, 500)), LiveNotes::Answer::too_late);
    EXPECT_EQ(notes.cancel(3), LiveNotes::Answer::too_late);
    EXPECT_EQ(notes.put(note(2, 400)), LiveNotes::Answer::accepted) << "a cancelled id may come again";
    notes.take_before(1000, 128, taken);
    EXPECT_EQ(ids(taken), (std::vector<std::uint64_t>{1, 2}));
}

TEST(LiveNotes, BeyondTheRoomAreRefusedAndThoseThereStay) {
    LiveNotes notes(2);
    (void)notes.put(note(1, 100));
    (void)notes.put(note(2, 200));
    EXPECT_EQ(notes.put(note(3, 150)), LiveNotes::Answer::full);
    EXPECT_EQ(notes.put(note(2, 150)), LiveNotes::Answer::accepted) << "a move needs no room";
    auto taken = room(1);
    notes.take_before(1000, 64, taken);
    EXPECT_EQ(ids(taken), std::vector<std::uint64_t>{1}) << "as many as there is room for";
    notes.take_before(1000, 64, taken);
    EXPECT_EQ(ids(taken), std::vector<std::uint64_t>{2}) << "the others next time";
}

}  // namespace
