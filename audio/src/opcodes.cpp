#include "opcodes.h"

#include <csdl.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <span>
#include <stdexcept>
#include <string>

#include "modal_bank.h"

namespace audio {
namespace {

// Csound gives an opcode its memory cleared, then the arguments' addresses in the order of their types.

/// The samples of this block that belong to the note.
struct Part {
    std::size_t begin = 0, end = 0;
};

Part part_of(const OPDS& opcode) {
    const INSDS& note = *opcode.insdshead;
    return {note.ksmps_offset, note.ksmps - note.ksmps_no_end};
}

void clear_around(MYFLT* out, const OPDS& opcode) {
    const Part part = part_of(opcode);
    std::fill(out, out + part.begin, 0.0);
    std::fill(out + part.end, out + opcode.insdshead->ksmps, 0.0);
}

struct ContactForce {
    OPDS h;
    MYFLT *force, *duration_s;
    double samples;
    std::int64_t sample;

    static int start(CSOUND* csound, void* memory) {
        auto& self = *static_cast<ContactForce*>(memory);
        self.samples = *self.duration_s * csound->GetSr(csound);
        self.sample = 0;
        return OK;
    }
    static int run(CSOUND*, void* memory) {
        auto& self = *static_cast<ContactForce*>(memory);
        clear_around(self.force, self.h);
        const Part part = part_of(self.h);
        for (std::size_t n = part.begin; n < part.end; ++n) {
            const double at = static_cast<double>(self.sample++) + 0.5;
            self.force[n] = at < self.samples ? std::sin(std::numbers::pi * at / self.samples) : 0;
        }
        return OK;
    }
};

struct NoiseBurst {
    OPDS h;
    MYFLT *noise, *seed, *rise_s, *t60_s;
    std::uint64_t random;
    double rise_per_sample, risen, fall_per_sample, fallen;

    static int start(CSOUND* csound, void* memory) {
        auto& self = *static_cast<NoiseBurst*>(memory);
        const double rate = csound->GetSr(csound);
        self.random = std::bit_cast<std::uint64_t>(*self.seed) * 0x9E3779B97F4A7C15U | 1U;
        self.rise_per_sample = 1 / std::max(1.0, *self.rise_s * rate);
        self.risen = 0;
        self.fall_per_sample = std::exp(std::log(0.001) / (std::max(*self.t60_s, 0.001) * rate));
        self.fallen = 1;
        return OK;
    }
    /// Uniform in [-1, 1): xorshift64* (Vigna, An experimental exploration of Marsaglia's xorshift
    /// generators, scrambled, 2016).
    double next() {
        random ^= random >> 12;
        random ^= random << 25;
        random ^= random >> 27;
        return static_cast<double>(static_cast<std::int64_t>(random * 0x2545F4914F6CDD1DU)) * 0x1p-63;
    }
    static int run(CSOUND*, void* memory) {
        auto& self = *static_cast<NoiseBurst*>(memory);
        clear_around(self.noise, self.h);
        const Part part = part_of(self.h);
        double risen = self.risen, fallen = self.fallen;
        for (std::size_t n = part.begin; n < part.end; ++n) {
            risen = std::min(1.0, risen + self.rise_per_sample);
            self.noise[n] = fallen < 1e-4 ? 0 : self.next() * risen * fallen;
            fallen *= self.fall_per_sample;
        }
        self.risen = risen, self.fallen = fallen;
        return OK;
    }
};

struct Bank {
    OPDS h;
    MYFLT *mid, *side, *force, *drive, *bend, *modes, *count, *rest, *ring;
    ModalBank bank;

    static int start(CSOUND* csound, void* memory) {
        auto& self = *static_cast<Bank*>(memory);
        MYFLT* table = nullptr;
        const int length = csound->GetTable(csound, &table, static_cast<int>(*self.modes));
        if (length < 0 || self.h.insdshead->ksmps > ModalBank::kMostSamples)
            return csound->InitError(csound, "modal_bank: found no table of modes, or ksmps above 64");
        std::array<ModeParameters, ModalBank::kMostModes> modes{};
        const double most = std::min(static_cast<double>(modes.size()), length / 4.0);
        const auto count = static_cast<std::size_t>(*self.count > 0 ? std::min(*self.count, most) : 0);
        for (std::size_t i = 0; i < count; ++i)
            modes[i] = {table[4 * i], table[4 * i + 1], table[4 * i + 2], table[4 * i + 3]};
        self.bank.set(std::span(modes).first(count), csound->GetSr(csound), *self.rest);
        return OK;
    }
    static int run(CSOUND*, void* memory) {
        auto& self = *static_cast<Bank*>(memory);
        const std::size_t size = self.h.insdshead->ksmps;
        std::array<float, ModalBank::kMostSamples> force, drive, mid, side;
        std::copy_n(self.force, size, force.begin());
        std::copy_n(self.drive, size, drive.begin());
        self.bank.tune(*self.bend, *self.ring);
        self.bank.render(std::span(force).first(size), std::span(drive).first(size),
                         std::span(mid).first(size), std::span(side).first(size));
        std::copy_n(mid.begin(), size, self.mid);
        std::copy_n(side.begin(), size, self.side);
        return OK;
    }
};

struct CloseNote {
    OPDS h;
    MYFLT *left, *right, *over;
    MYFLT *mid, *side, *left_gain, *right_gain, *width, *duration_s, *onset, *voice, *choke_onset,
        *chokes_table, *ends_table, *rings;
    const MYFLT* latest_choke;        // of its voice
    MYFLT* latest_end;                // of all notes
    double choke, sample, remaining;  // samples from the onset, and up to its end; choke below 0: none yet

    static constexpr double kChokedS = 0.015, kFadeS = 0.05;

    static int start(CSOUND* csound, void* memory) {
        auto& self = *static_cast<CloseNote*>(memory);
        MYFLT *chokes = nullptr, *ends = nullptr;
        const int length = csound->GetTable(csound, &chokes, static_cast<int>(*self.chokes_table));
        const auto voice = static_cast<int>(*self.voice);
        if (voice < 0 || voice >= length) return csound->InitError(csound, "close_note: found no such voice");
        if (csound->GetTable(csound, &ends, static_cast<int>(*self.ends_table)) < 1)
            return csound->InitError(csound, "close_note: found no table of ends");
        self.latest_choke = chokes + voice;
        self.latest_end = ends;
        self.choke = *self.choke_onset < 0 ? -1 : *self.choke_onset - *self.onset;
        self.sample = 0;
        self.remaining = *self.duration_s * csound->GetSr(csound);
        self.tell_end(1);
        return OK;
    }
    void tell_end(double ring) {
        const double blocks = 2.0 * h.insdshead->ksmps;
        *latest_end = std::max(*latest_end, *onset + sample + remaining * ring + blocks);
    }
    [[nodiscard]] double gain(double at, double remains, double rate) const {
        double gain = std::clamp(remains / (kFadeS * rate), 0.0, 1.0);
        if (choke >= 0) {
            const double rest = std::clamp(1 - (at - choke) / (kChokedS * rate), 0.0, 1.0);
            gain *= rest * rest * (3 - 2 * rest);
        }
        return gain;
    }
    static int run(CSOUND* csound, void* memory) {
        auto& self = *static_cast<CloseNote*>(memory);
        clear_around(self.left, self.h);
        clear_around(self.right, self.h);
        if (self.choke < 0 && *self.latest_choke > *self.onset) self.choke = *self.latest_choke - *self.onset;
        const double rate = csound->GetSr(csound), width = *self.width, left = *self.left_gain,
                     right = *self.right_gain, block = self.h.insdshead->ksmps,
                     ring = std::max(1.0, *self.rings);
        const bool steady = self.choke < 0 && block < self.remaining - kFadeS * rate;
        const Part part = part_of(self.h);
        double at = self.sample, remains = self.remaining;
        if (steady) {
            for (std::size_t n = part.begin; n < part.end; ++n) {
                const double mid = self.mid[n], side = width * self.side[n];
                self.left[n] = left * (mid + side);
                self.right[n] = right * (mid - side);
            }
            const auto played = static_cast<double>(part.end - part.begin);
            at += played;
            remains -= played / ring;
        }
        for (std::size_t n = steady ? part.end : part.begin; n < part.end; ++n) {
            const double gain = self.gain(at, remains, rate);
            const double mid = gain * self.mid[n], side = gain * width * self.side[n];
            self.left[n] = left * (mid + side);
            self.right[n] = right * (mid - side);
            at += 1;
            remains -= 1 / ring;
        }
        self.sample = at;
        self.remaining = remains;
        if (ring > 1) self.tell_end(ring);
        *self.over = remains <= 0 || (self.choke >= 0 && at > self.choke + kChokedS * rate) ? 1 : 0;
        return OK;
    }
};

/// Of a voice in the table of decays: decay_s now, and the longest; nullptr where there is none.
const MYFLT* decays_of_voice(CSOUND* csound, const MYFLT* table, const MYFLT* voice) {
    MYFLT* decays = nullptr;
    const int length = csound->GetTable(csound, &decays, static_cast<int>(*table));
    const auto place = static_cast<int>(*voice);
    return place < 0 || 2 * place + 1 >= length ? nullptr : decays + 2 * place;
}

struct PedalRing {
    OPDS h;
    MYFLT *ring, *longest;
    MYFLT *voice, *decay_s, *decays_table;
    const MYFLT* decay_now;  // of its voice

    static int start(CSOUND* csound, void* memory) {
        auto& self = *static_cast<PedalRing*>(memory);
        self.decay_now = decays_of_voice(csound, self.decays_table, self.voice);
        if (self.decay_now == nullptr) return csound->InitError(csound, "pedal_ring: found no such voice");
        *self.longest = std::max(self.decay_now[1] / *self.decay_s, 1.0);
        return run(csound, memory);
    }
    static int run(CSOUND*, void* memory) {
        auto& self = *static_cast<PedalRing*>(memory);
        *self.ring = *self.decay_now > 0 ? *self.decay_now / *self.decay_s : 1;
        return OK;
    }
};

struct PedalGain {
    OPDS h;
    MYFLT *gain, *voice, *decays_table;
    const MYFLT* decay_now;      // of its voice
    double begun_with, reached;  // decay_s at the onset; the gain

    static int start(CSOUND* csound, void* memory) {
        auto& self = *static_cast<PedalGain*>(memory);
        self.decay_now = decays_of_voice(csound, self.decays_table, self.voice);
        if (self.decay_now == nullptr) return csound->InitError(csound, "pedal_gain: found no such voice");
        self.begun_with = *self.decay_now;
        self.reached = 1;
        return OK;
    }
    static int run(CSOUND* csound, void* memory) {
        auto& self = *static_cast<PedalGain*>(memory);
        clear_around(self.gain, self.h);
        const bool damped = *self.decay_now > 0 && *self.decay_now < self.begun_with;
        const double each = damped ? std::exp(std::log(0.001) * (1 / *self.decay_now - 1 / self.begun_with) /
                                              csound->GetSr(csound))
                                   : 1;
        const Part part = part_of(self.h);
        for (std::size_t n = part.begin; n < part.end; ++n) self.gain[n] = self.reached *= each;
        return OK;
    }
};

struct Bessel {
    OPDS h;
    MYFLT *value, *order, *x;

    static int start(CSOUND*, void* memory) {
        auto& self = *static_cast<Bessel*>(memory);
        *self.value = ::jn(static_cast<int>(*self.order), *self.x);
        return OK;
    }
};

constexpr int kAtInit = 1, kAtInitAndBlock = 3;

template <class Opcode>
void add(CSOUND* csound, const char* name, const char* out, const char* in) {
    int (*run)(CSOUND*, void*) = nullptr;
    if constexpr (requires { &Opcode::run; }) run = &Opcode::run;
    static_assert(sizeof(Opcode) < 65536, "Csound keeps the size in 16 bits");
    if (csound->AppendOpcode(csound, name, static_cast<int>(sizeof(Opcode)), 0,
                             run ? kAtInitAndBlock : kAtInit, out, in, &Opcode::start, run, run) != 0)
        throw std::runtime_error(std::string("Csound refuses the opcode ") + name);
}

}  // namespace

void add_opcodes(CSOUND_* csound) {
    add<ContactForce>(csound, "contact_force", "a", "i");
    add<NoiseBurst>(csound, "noise_burst", "a", "iii");
    add<Bank>(csound, "modal_bank", "aa", "aakiiiP");
    add<CloseNote>(csound, "close_note", "aak", "aaiiiiiiiiik");
    add<PedalRing>(csound, "pedal_ring", "ki", "iii");
    add<PedalGain>(csound, "pedal_gain", "a", "ii");
    add<Bessel>(csound, "bessel", "i", "ii");
}

}  // namespace audio
