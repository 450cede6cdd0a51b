#include "play/pedals.h"

#include <audio/samples.h>
#include <fmt/format.h>
#include <tracking/input.h>

#include <algorithm>
#include <charconv>
#include <cmath>

#include "files/bad_input.h"

namespace app {
namespace {

constexpr double kClosed = 0.1, kOpen = 0.15;  // a foot that trembles between them opens and closes nothing
constexpr double kStepS = 0.015, kTogetherS = 0.1;  // moves of one fall follow each other that soon
constexpr double kOneSoundS = 0.05;
constexpr double kTravelM = 0.03, kSlowestMps = 0.2, kFastestMps = 4;
constexpr double kChokes = 0.5;  // of a hand's value, from 0 to 1
constexpr double kBeaterPlace = 0.2;
constexpr int kMiddle = 64;       // of MIDI's 0 to 127
constexpr double kLatestS = 1e7;  // as of traces

/// Speed of a stroke of that MIDI velocity, as a share of 127: the inverse of audio::stroke_velocity.
double speed_of(double velocity) {
    return 8 * std::pow(velocity, 1 / 0.7);
}

int same_bass_drum(int note) {
    return note == 35 ? 36 : note;
}

bool has_note(const Instrument& instrument, int note) {
    const auto is = [&](const ZoneSound& zone) {
        return same_bass_drum(zone.midi_note) == same_bass_drum(note);
    };
    return std::ranges::any_of(instrument.zones, is) || instrument.pedal.midi_note == note;
}

/// The fields of a line and where each begins (from 1).
struct Field {
    std::string_view text;
    std::size_t column;
};
std::vector<Field> fields_of(std::string_view line) {
    std::vector<Field> fields;
    for (std::size_t begin = 0;;) {
        const std::size_t comma = std::min(line.find(',', begin), line.size());
        fields.push_back({line.substr(begin, comma - begin), begin + 1});
        if (comma == line.size()) return fields;
        begin = comma + 1;
    }
}

class Schedule {
public:
    Schedule(const std::string& file, const Kit& kit) : file_(file), kit_(kit) {}

    std::vector<PedalMove> read(std::string_view text) {
        if (text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);
        while (!text.empty()) {
            const std::size_t end = std::min(text.find('\n'), text.size());
            std::string_view line = text.substr(0, end);
            text.remove_prefix(std::min(end + 1, text.size()));
            if (line.ends_with('\r')) line.remove_suffix(1);
            ++line_;
            if (line.empty() || line.starts_with('#')) continue;
            if (!headed_) {
                if (line != "t,pedal,value") fail(1, line, "the header t,pedal,value");
                headed_ = true;
                continue;
            }
            row(line);
        }
        if (!headed_) fail(1, "no header", "t,pedal,value");
        return std::move(moves_);
    }

private:
    [[noreturn]] void fail(std::size_t column, std::string_view found, const std::string& expected) const {
        throw BadInput(fmt::format("{}:{}:{}: error: found {}, expected {}", one_line(file_),
                                   std::max(line_, 1), column, one_line(found), expected));
    }
    double number(const Field& field, double low, double high, const char* what) const {
        double value = 0;
        const auto [end, error] =
            std::from_chars(field.text.data(), field.text.data() + field.text.size(), value);
        if (error != std::errc() || end != field.text.data() + field.text.size() ||
            !(value >= low && value <= high))
            fail(field.column, fmt::format("`{}`", field.text),
                 fmt::format("{}, {:g} to {:g}", what, low, high));
        return value;
    }
    void row(std::string_view line) {
        const std::vector<Field> fields = fields_of(line);
        if (fields.size() != 3) fail(1, fmt::format("{} fields", fields.size()), "t,pedal,value");
        const double t = number(fields[0], -kLatestS, kLatestS, "a time in s");
        if (!moves_.empty() && t < moves_.back().t_s)
            fail(1, fmt::format("t {:g}, before {:g} of the row above", t, moves_.back().t_s),
                 "rows by time");
        const auto found = std::ranges::find(kit_.instruments, fields[1].text, &Instrument::name);
        if (found == kit_.instruments.end()) {
            std::vector<std::string> names;
            for (const Instrument& each : kit_.instruments) names.push_back(each.name);
            fail(fields[1].column, fmt::format("pedal `{}`", fields[1].text),
                 fmt::format("an instrument of the kit{}", nearest_hint(std::string(fields[1].text), names)));
        }
        const double value = number(fields[2], 0, 1, "a value");
        if (moves_.size() == kMostPedalMoves)
            fail(1, fmt::format("more than {} rows", kMostPedalMoves), "fewer");
        const auto instrument = static_cast<std::uint32_t>(found - kit_.instruments.begin());
        using Kind = PedalMove::Kind;
        switch (found->pedal.kind) {
            case Pedal::Kind::beater:
                if (value > 0) moves_.push_back({Kind::stroke, t, instrument, speed_of(value)});
                break;
            case Pedal::Kind::none:
                if (value >= kChokes) moves_.push_back({Kind::choke, t, instrument, value});
                break;
            default:
                moves_.push_back({Kind::place, t, instrument, value});
        }
    }

    const std::string& file_;
    const Kit& kit_;
    int line_ = 0;
    bool headed_ = false;
    std::vector<PedalMove> moves_;
};

}  // namespace

std::vector<PedalMove> parse_pedals(std::string_view text, const std::string& file, const Kit& kit) {
    return Schedule(file, kit).read(text);
}

std::vector<PedalMove> read_pedals(const std::filesystem::path& file, const Kit& kit, double t0_s) {
    const std::string bytes = tracking::read_bytes(file.string(), "pedals (CSV or MIDI)");
    if (!bytes.starts_with("MThd")) return parse_pedals(bytes, file.string(), kit);
    std::vector<PedalMove> moves;
    const auto messages = [&] {
        try {
            return audio::parse_midi(bytes, file.string());
        } catch (const std::runtime_error& wrong) {
            throw BadInput(wrong.what());
        }
    }();
    for (audio::MidiMessage message : messages) {
        message.t_s += t0_s;
        for (const PedalMove& move : moves_of(message, kit)) moves.push_back(move);
        if (moves.size() > kMostPedalMoves)
            throw BadInput(fmt::format("{}: error: found more than {} moves of pedals, expected fewer",
                                       file.string(), kMostPedalMoves));
    }
    return moves;
}

std::size_t leave_out(std::vector<PedalMove>& moves, double t0_s, double t_end_s) {
    return std::erase_if(moves, [&](const PedalMove& move) {
        const bool only_sets = move.kind == PedalMove::Kind::place;
        return move.t_s > t_end_s || (move.t_s < t0_s && !only_sets);
    });
}

std::vector<PedalMove> moves_of(const audio::MidiMessage& message, const Kit& kit) {
    using Kind = PedalMove::Kind;
    std::vector<PedalMove> moves;
    const double share = message.data2 / 127.0;
    for (std::uint32_t i = 0; i < kit.instruments.size(); ++i) {
        const Instrument& instrument = kit.instruments[i];
        const auto add = [&](Kind kind, double value) { moves.push_back({kind, message.t_s, i, value}); };
        const bool hi_hat = instrument.pedal.kind == Pedal::Kind::hi_hat,
                   strikes = message.kind() == audio::kMidiNoteOn && message.data2 > 0;
        if (message.kind() == audio::kMidiController && message.data1 == 4 && hi_hat)
            add(Kind::place, 1 - share);
        if (message.kind() == audio::kMidiController && message.data1 == 64 &&
            instrument.pedal.kind == Pedal::Kind::damper)
            add(Kind::place, share);
        if (strikes && instrument.pedal.kind == Pedal::Kind::beater && has_note(instrument, message.data1))
            add(Kind::stroke, speed_of(share));
        if (strikes && hi_hat && message.data1 == instrument.pedal.foot_note)
            add(Kind::foot, speed_of(share));
        if (message.kind() == audio::kMidiAftertouch && message.data2 >= kMiddle &&
            has_note(instrument, message.data1))
            add(Kind::choke, share);
    }
    return moves;
}

Pedals::Pedals(const Kit& kit, double t0_s) : t0_s_(t0_s) {
    for (std::uint32_t i = 0; i < kit.instruments.size(); ++i) {
        const Instrument& instrument = kit.instruments[i];
        Foot& foot = feet_.emplace_back();
        foot.pedal = instrument.pedal;
        foot.rest = foot.place = instrument.pedal.kind == Pedal::Kind::damper ? 1 : 0;
        foot.closed = foot.rest <= kClosed;
        foot.stroke.voice = i;
        foot.stroke.midi_note = instrument.zones.front().midi_note;
    }
}

void Pedals::add(const audio::Note& note, const PedalMove& move) {
    notes_.push_back({note, move.kind, move.t_s, move.stick});
    notes_.back().note.id = kFirstPedalId + notes_.size() - 1;
}

void Pedals::sound(Foot& foot, const PedalMove& move, std::int64_t sample, double speed_mps) {
    const bool closes = foot.pedal.kind == Pedal::Kind::hi_hat;
    if (closes && move.t_s - foot.sounded_s < kOneSoundS) return;
    if (closes) foot.sounded_s = move.t_s;
    audio::Note note = foot.stroke;
    note.onset_sample = sample;
    note.speed_mps = speed_mps;
    note.midi_velocity = audio::stroke_velocity(speed_mps);
    note.place = closes ? 1 : kBeaterPlace;
    if (closes) note.midi_note = foot.pedal.foot_note;
    add(note, move);
}

void Pedals::end(Foot& foot, const PedalMove& move, std::int64_t sample) {
    // What tells of a closing a second time must not end the sound of the first.
    const bool by_foot = move.kind == PedalMove::Kind::place || move.kind == PedalMove::Kind::foot;
    if (by_foot && foot.pedal.kind == Pedal::Kind::hi_hat && move.t_s - foot.sounded_s < kOneSoundS) return;
    if (std::exchange(foot.ended, sample) == sample) return;
    audio::Note note = foot.stroke;
    note.onset_sample = sample;
    note.speed_mps = 0;
    note.midi_velocity = 1;
    note.kind = audio::Note::Kind::choke;
    add(note, move);
}

/// A move that came late was put behind what a lap's end sets later.
void Pedals::step(Foot& foot, std::int64_t sample) {
    const auto later = std::ranges::upper_bound(foot.steps, sample, {}, &Step::sample);
    foot.steps.insert(later, {sample, foot.place});
    audio::Note place = foot.stroke;
    place.id = kFirstPlaceId + places_.size();
    place.kind = audio::Note::Kind::pedal;
    place.onset_sample = std::max<std::int64_t>(sample, 0);
    place.pedal = std::abs(foot.place - foot.rest);
    places_.push_back(place);
}

void Pedals::move_to(Foot& foot, const PedalMove& move, std::int64_t sample) {
    const double before = std::exchange(foot.place, move.value);
    const bool goes_on = foot.falling && move.t_s - foot.last_s <= kTogetherS;
    foot.falling = foot.place < before;
    if (foot.falling && !goes_on) {
        foot.fall_began_s = std::max(move.t_s - kStepS, foot.steps.empty() ? -kLatestS : foot.last_s);
        foot.fell_from = before;
    }
    foot.last_s = move.t_s;
    step(foot, sample);
    const bool was_closed = std::exchange(foot.closed, foot.place <= (foot.closed ? kOpen : kClosed));
    if (was_closed || !foot.closed || sample < 0) return;
    end(foot, move, sample);
    const double fall_s = std::max(move.t_s - foot.fall_began_s, kStepS / 3);
    const double speed = std::min(kTravelM * (foot.fell_from - foot.place) / fall_s, kFastestMps);
    if (foot.pedal.kind == Pedal::Kind::hi_hat && speed >= kSlowestMps) sound(foot, move, sample, speed);
}

void Pedals::take(const PedalMove& move, std::int64_t earliest) {
    Foot& foot = feet_.at(move.instrument);
    if (move.kind != PedalMove::Kind::tip) ++moves_;
    const std::int64_t at = std::llround((move.t_s - t0_s_) * audio::kSampleRate),
                       sample = std::max(at, earliest);
    const bool before_all = at < 0;
    switch (move.kind) {
        case PedalMove::Kind::place:
            move_to(foot, move, before_all ? at : sample);
            break;
        case PedalMove::Kind::stroke:
            if (!before_all && move.value >= kSlowestMps) sound(foot, move, sample, move.value);
            break;
        case PedalMove::Kind::foot:
            if (before_all) break;
            end(foot, move, sample);
            if (move.value >= kSlowestMps) sound(foot, move, sample, move.value);
            break;
        case PedalMove::Kind::choke:
        case PedalMove::Kind::tip:
            if (!before_all) end(foot, move, sample);
            break;
    }
}

void Pedals::rest(std::int64_t sample) {
    for (Foot& foot : feet_) {
        if (foot.place == foot.rest) continue;
        foot.place = foot.rest;
        foot.falling = false;
        foot.closed = foot.rest <= kClosed;
        step(foot, sample);
    }
}

void Pedals::end_at(std::int64_t sample) {
    for (Foot& foot : feet_)
        foot.steps.erase(std::ranges::upper_bound(foot.steps, sample, {}, &Step::sample), foot.steps.end());
    std::erase_if(places_, [&](const audio::Note& place) { return place.onset_sample > sample; });
}

void Pedals::put_on(audio::Note& note) const {
    if (note.voice >= feet_.size()) return;
    const Foot& foot = feet_[note.voice];
    const auto later = std::ranges::upper_bound(foot.steps, note.onset_sample, {}, &Step::sample);
    const double place = later == foot.steps.begin() ? foot.rest : std::prev(later)->place;
    note.pedal = std::abs(place - foot.rest);
    if (note.pedal > kClosed && foot.pedal.midi_note) note.midi_note = *foot.pedal.midi_note;
}

std::vector<audio::MidiControl> Pedals::controls() const {
    std::vector<audio::MidiControl> all;
    for (const Foot& foot : feet_) {
        if (foot.pedal.kind == Pedal::Kind::none || foot.pedal.kind == Pedal::Kind::beater) continue;
        const bool hi_hat = foot.pedal.kind == Pedal::Kind::hi_hat;
        for (const Step& step : foot.steps) {
            const double value = 127 * (hi_hat ? 1 - step.place : step.place);
            all.push_back({std::max<std::int64_t>(step.sample, 0), hi_hat ? 4 : 64,
                           static_cast<int>(std::lround(value))});
        }
    }
    return all;
}

}  // namespace app
