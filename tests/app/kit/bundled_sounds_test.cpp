#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>

#include "files/assets.h"
#include "kit/kit.h"
#include "play/play_run.h"
#include "spectra.h"

namespace app {
namespace {

/// Both channels together of one stroke on an instrument of a kit, without the room.
std::vector<double> strike(const Kit& kit, std::size_t instrument, double speed_mps, double place,
                           std::int64_t samples) {
    audio::Performance performance(orchestra_file(), {voices_of(kit)[instrument]});
    audio::Note note;
    note.id = 1;
    note.speed_mps = speed_mps;
    note.place = place;
    performance.schedule(note);
    const std::vector<float> sound = performance.finish(samples, 0);
    std::vector<double> mono;
    for (std::size_t i = 0; i + 1 < sound.size(); i += 2) mono.push_back(double{sound[i]} + sound[i + 1]);
    return mono;
}

TEST(BundledSounds, EachTomsCentroidAtLeastDoublesFrom0Point5To8MetresASecondWhereverItIsStruck) {
    for (const char* name : {"drums", "rock"}) {
        const Kit kit = read_kit(find_kit(name));
        for (std::size_t i = 0; i < kit.instruments.size(); ++i) {
            const std::string& tom = kit.instruments[i].name;
            if (tom.find("tom") == std::string::npos) continue;
            std::vector<double> growth;
            for (const double place : {0.1, 0.3, 0.5, 0.7, 0.8, 0.9})
                growth.push_back(centroid_hz(strike(kit, i, 8, place, 4800)) /
                                 centroid_hz(strike(kit, i, 0.5, place, 4800)));
            const auto [least, most] = std::ranges::minmax(growth);
            std::printf("%s, %s: the centroid grows %.2f to %.2f times\n", name, tom.c_str(), least, most);
            EXPECT_GE(least, 2) << name << ", " << tom;
        }
    }
}

TEST(BundledSounds, AnOpenCymbalsHighBandPeaks20MsOrLaterAfterTheStroke) {
    for (const char* name : {"drums", "rock"}) {
        const Kit kit = read_kit(find_kit(name));
        for (std::size_t i = 0; i < kit.instruments.size(); ++i) {
            const Instrument& instrument = kit.instruments[i];
            if (instrument.kind != "cymbal" || instrument.pedal.kind == Pedal::Kind::hi_hat) continue;
            const std::vector<double> power = high_band(strike(kit, i, 5, 0.6, 9600), 5000);
            const auto peak = std::ranges::max_element(power) - power.begin();
            const double at_ms = static_cast<double>(peak * 64 + 128) / 48;  // the window's middle
            std::printf("%s, %s: above 5 kHz it peaks at %.0f ms\n", name, instrument.name.c_str(), at_ms);
            EXPECT_GE(at_ms, 20) << name << ", " << instrument.name;
        }
    }
}

}  // namespace
}  // namespace app
