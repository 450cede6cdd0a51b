; Recorded sounds, put behind musicworld.orc for kits that have them. One event a channel of a sample: a table of the host
; holds what is heard at 48 kHz, tuned and shaped, so that it is only read, from the note's own first sample on.
;   p12  number of the table, which ends with silence
;   p13  its samples
;   p14  gain of the stroke
instr sample
  ilevel = p14
  iduration = p13 / sr + 0.1
  aplace linseg 0, 1000, 1000 * sr
  ; A quarter of a sample keeps rounding on the right side of the step.
  asound table aplace + 0.25, p12
  amid = asound
  aside = 0 * asound
  iwidth = 0
  $CLOSE
endin
