// Standard MIDI Files.
#include <stdexcept>

#include "audio/midi_reader.h"
#include "fuzz_target.h"

void fuzz_midi(std::string_view bytes) {
    try {
        double before = 0;
        for (const audio::MidiMessage& message : audio::parse_midi(bytes, "fuzz")) {
            require(message.t_s >= before && message.t_s < 1e18, "messages out of time");
            require(message.status >= 0x80 && message.status < 0xF0 && message.data1 < 0x80 &&
                        message.data2 < 0x80,
                    "a message that is none");
            before = message.t_s;
        }
    } catch (const std::runtime_error& fault) {
        require_located(fault, "fuzz: ");
    }
}
