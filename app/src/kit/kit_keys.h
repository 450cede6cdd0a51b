#pragma once
#include <audio/orchestra.h>

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "files/fields.h"
#include "files/format_description.h"
#include "kit/kit.h"

namespace app {

// Every key of a kit file is declared in kit_keys.cpp.

/// What each file of a kit says for itself.
struct KitHeader {
    std::string name, description;
    std::vector<std::string> include;
};
void header_keys(Fields& keys, KitHeader& header);

/// An instrument as it is written: `mesh` is a name (empty: KIND.obj).
struct InstrumentDraft {
    Instrument instrument;
    const std::vector<audio::Instrument>* orchestra = nullptr;  ///< the sounds that there are
};

/// A kit as its files say it.
struct KitDraft {
    Kit kit;  ///< without instruments; the stick's `mesh` is a name
    std::vector<audio::Instrument> orchestra;
    std::function<void(Fields& at, StickDefinition&)> take_stick;
    std::function<void(Fields& at, Instrument&)> take_instrument;
};
extern const TableKind<KitDraft> kKitFile;

/// Keys, ranges and defaults of kit files. The defaults of [stick], [camera] and [room] are those of the bundled
/// defaults.toml.
[[nodiscard]] FormatDescription kit_format();

}  // namespace app
