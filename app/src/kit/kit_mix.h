#pragma once
#include <audio/performance.h>

#include <string>
#include <vector>

#include "files/fields.h"
#include "kit/kit.h"

namespace app {

/// Table `mix` of a kit.
struct KitMix {
    audio::Mix mix;
    std::string room_impulse{};  ///< name of a file; empty: none
};
extern const TableKind<KitMix> kMix;
/// A table of `bus`.
extern const TableKind<Bus> kBus;

/// Puts the instrument on its bus.
void mix_in(Fields& at, Instrument& instrument, const std::vector<Bus>& buses);

}  // namespace app
