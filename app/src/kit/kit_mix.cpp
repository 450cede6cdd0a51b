#include "kit/kit_mix.h"

#include <fmt/format.h>

#include <algorithm>

namespace app {
namespace {

void mix_keys(Fields& keys, KitMix& written) {
    audio::Mix& mix = written.mix;
    keys.number("gain_db", mix.gain_db, {-60, 60, "dB"},
                "Gain of the whole kit; offline, the sound is then brought to the loudness asked for.");
    keys.number("room_t60_s", mix.room.t60_s, {0, 20, "s"},
                "Time in which the room's echo falls by 60 dB; below 0.05: no room.");
    keys.number("room_level_db", mix.room.level_db, {-60, 20, "dB"},
                "Energy of the room's echo against the instruments' own.");
    keys.text("room_impulse", written.room_impulse,
              "A recorded room instead of room_t60_s: its impulse response, a sound file beside this one, of "
              "at most 20 s; one channel, two (left, right) or four (left to left, left to right, right to "
              "left, right to right).",
              {.example = "\"hall.wav\""});
}

void bus_keys(Fields& keys, Bus& bus) {
    keys.text("name", bus.name, "Name, as the instruments' `bus` gives it.",
              {.need = Need::given, .example = "\"drums\""});
    keys.number("gain_db", bus.gain_db, {-60, 20, "dB"}, "Gain of its instruments.");
    keys.number("balance", bus.balance, {-1, 1}, "-1 their left sides alone ... 1 their right sides alone.");
    keys.number("room_send_db", bus.room_send_db, {-60, 20, "dB"},
                "Gain of what the room hears of them; -60: nothing.");
}

}  // namespace

const TableKind<KitMix> kMix = {{"mix", "What becomes of the instruments' sum."}, mix_keys};
const TableKind<Bus> kBus = {{"bus", "Instruments that are mixed together."}, bus_keys};

void mix_in(Fields& at, Instrument& instrument, const std::vector<Bus>& buses) {
    if (instrument.bus.empty()) return;
    const auto bus = std::ranges::find(buses, instrument.bus, &Bus::name);
    at.require(bus != buses.end(), "bus", fmt::format("bus = \"{}\"", instrument.bus),
               "the name of a [[bus]]");
    if (bus == buses.end()) return;
    instrument.voice.gain_db += bus->gain_db;
    instrument.voice.balance = bus->balance;
    instrument.voice.room_send_db = bus->room_send_db;
}

}  // namespace app
