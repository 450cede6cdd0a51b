#pragma once

struct CSOUND_;  // Csound's own handle; csound.h stays out of this header

namespace audio {

/// Adds to a Csound instance, before it compiles, what an instrument of the orchestra computes with:
///   aforce       contact_force iduration_s                      sin(pi t / duration), 0 from then on
///   anoise       noise_burst iseed, irise_s, it60_s             white noise, risen in irise_s, down by 60 dB
///                                                               in it60_s, exactly 0 from -80 dB on
///   amid, aside  modal_bank aforce, adrive, kbend, imodes, icount, irest [, kring]
///                                                               see ModalBank; imodes: a table of
///                                                               frequency, T60, weight and drive a mode
///   aleft, aright, kover  close_note amid, aside, ileft, iright, iwidth, iduration_s, ionset, ivoice, ichoke, ichokes,
///                                    iends, kring               the end of a note: gains, fade, choke; kover is 1
///                                                               once it is over. Where it rings kring times as long
///                                                               as when it began (above 1), its end waits, as entry 0
///                                                               of the table iends tells
///   kring, ilongest  pedal_ring ivoice, idecay_s, idecays       how much longer a note rings, as its voice's pedal
///                                                               is now, than with its own decay_s (1 without such a
///                                                               pedal), and at most (1 or more)
///   again        pedal_gain ivoice, idecays                     for a sound with a decay of its own: what makes it
///                                                               fall as with the decay_s of its voice's pedal now
///                                                               instead of that at its onset, where that is longer;
///                                                               it never rises, as nothing is left of the sound
///                                                               that could ring longer, or come back
///   ivalue       bessel iorder, ix                              J_n(x)
/// All begin at the note's own sample, and all memory lies in the instrument's own. At most 64 samples a
/// block and 512 modes; more are left out. Throws std::runtime_error where Csound refuses one.
void add_opcodes(CSOUND_* csound);

}  // namespace audio
