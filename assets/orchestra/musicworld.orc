; MusicWorld's orchestra: drum, bell, string and cymbal, all synthesised (no recordings).
;
; What the host passes (see audio/README.md): one event a note,
;   p4  onset [samples from the start of the performance]; sample-accurate, so the note's first sample is this one
;   p5  left gain    p6  right gain  (pan and voice gain, already multiplied)
;   p7  strike speed [m/s]           p8  place, 0 centre of the struck zone ... 1 its edge
;   p9  zone, 0 head or body, 1 and above: rim, cup, shoulder (see each instrument)
;   p10 choke group (index into table 901, -1: none)
;   p11 onset [samples] of a choking note within this note's own first block (-1: none)
;   p12 and on: the instrument's parameters, in the order of the lines below.
; Tables shared with the host:
;   901 one entry a choke group: onset [samples] of the group's latest choking note, written before its block
;   902 entry 0: the sample by which every note so far has ended, written by the notes
;
; Each line `;@ instrument parameter default minimum maximum text` declares a parameter; the host reads these lines.
;
;@ drum   frequency_hz     180    20   2000  pitch: lowest mode of the membrane (with kettle = 1: the (1,1) mode) [Hz]
;@ drum   decay_s          0.9    0.03 20    time in which that mode falls by 60 dB [s]
;@ drum   damping          0.8    0    3     how much faster high modes decay: decay_s / ratio^damping
;@ drum   hardness         0.4    0    1     of stick and head: 0 felt ... 1 wood on a tight head; brightness
;@ drum   bend_cents       40     0    2400  how far an 8 m/s stroke starts above the pitch [cents], in proportion to the speed
;@ drum   bend_s           0.06   0.005 1    time constant with which the bend dies [s]
;@ drum   kettle           0      0    1     0 membrane in air (tom, snare, kick) ... 1 kettledrum (nearly harmonic modes)
;@ drum   attack           0.35   0    1     noise of the stick's impact
;@ drum   snare            0      0    1     snare wires
;@ drum   snare_decay_s    0.22   0.02 3     time in which the wires fall by 60 dB [s]
;@ drum   rim_frequency_hz 850    100  6000  lowest mode of rim and shell, heard in zone 1 [Hz]
;@ bell   frequency_hz     600    30   8000  pitch: the partial of ratio 1 [Hz]
;@ bell   decay_s          4      0.03 60    time in which the slowest partial falls by 60 dB [s]
;@ bell   partials         0      0    3     0 minor-third bell, 1 free bar (glockenspiel), 2 tuned bar (vibraphone), 3 cowbell
;@ bell   damping          1      0    3     how much faster high partials decay
;@ bell   hardness         0.6    0    1     of the mallet; brightness
;@ bell   warble_hz        0      0    20    beating of each partial's two halves, split evenly about its pitch [Hz]
;@ bell   attack           0.15   0    1     noise of the impact
;@ string frequency_hz     220    25   4000  pitch: first partial [Hz]
;@ string decay_s          3      0.05 40    time in which the first partial falls by 60 dB [s]
;@ string damping          0.7    0    3     how much faster high partials decay: decay_s / n^damping
;@ string hardness         0.55   0    1     of the hammer; brightness
;@ string inharmonicity    0.0001 0    0.01  stiffness B: partial n lies at n f sqrt((1 + B n^2) / (1 + B))
;@ string strike_point     0.23   0.02 0.5   where place = 0 strikes, as a fraction of the length from the bridge
;@ string pluck            0      0    1     0 hammered ... 1 plucked (partials fall by a further 1/n)
;@ string attack           0.12   0    1     noise of the impact
;@ cymbal frequency_hz     340    60   3000  lowest partial [Hz]
;@ cymbal decay_s          3      0.02 30    time in which the plate falls by 60 dB at 1 kHz [s]: crash 3, ride 4, closed hi-hat 0.12
;@ cymbal damping          0.45   0    2     how much faster high frequencies decay: (1 kHz / f)^damping
;@ cymbal hardness         0.75   0    1     of the stick; brightness
;@ cymbal noise            0.5    0    1     share of dense noise against single partials: crash 0.6, ride 0.3
;@ cymbal spread           1      0.3  1.5   width of the partials' range: 1 reaches 36 times frequency_hz, at most 15 kHz

sr = 48000
ksmps = 64
nchnls = 2
0dbfs = 1

giChokes ftgen 901, 0, -256, -2, 0
giEnds   ftgen 902, 0, -1, -2, 0

; Private noise: a fixed table of uniform noise (Park and Miller's generator), read from a place that depends on the
; stroke alone. Csound's own random opcodes share one state among all notes, so that a note would depend on the others.
giNoise  ftgen 903, 0, 65536, -2, 0
iseed = 19920213
index = 0
while index < 65536 do
  iseed = (iseed * 16807) % 2147483647
  tableiw 2 * iseed / 2147483647 - 1, index, giNoise
  index += 1
od

; Membrane modes (m nodal diameters, root of the Bessel function J_m, largest |J_m|) and the kettledrum's ratios to its
; (1,1) mode, loaded by air (Fletcher and Rossing, The Physics of Musical Instruments, chapter 18).
giDiameters ftgen 910, 0, -12, -2, 0, 1, 2, 0, 3, 1, 4, 2, 0, 5, 3, 6
giRoots     ftgen 911, 0, -12, -2, 2.404826, 3.831706, 5.135622, 5.520078, 6.380162, 7.015587, 7.588342, 8.417244, 8.653728, 8.771484, 9.761023, 9.936110
giPeaks     ftgen 912, 0, -12, -2, 1, 0.5819, 0.4865, 1, 0.4344, 0.5819, 0.3997, 0.4865, 1, 0.3741, 0.4344, 0.3541
giKettle    ftgen 913, 0, -12, -2, 0.85, 1, 1.51, 1.68, 1.99, 2.09, 2.46, 2.61, 2.52, 2.89, 3.05, 3.36

; Bell partials, ten a set: ratio, weight, decay relative to the slowest (before `damping`). Weight 0: no partial.
giRatios  ftgen 920, 0, -40, -2, 0.5, 1, 1.2, 1.5, 2, 2.51, 2.66, 3.01, 4.17, 5.43, 1, 2.756, 5.404, 8.933, 13.345, 18.638, 1, 1, 1, 1, 1, 3.984, 10.668, 17.98, 1, 1, 1, 1, 1, 1, 1, 1.504, 2.32, 3.07, 4.22, 5.5, 6.9, 1, 1, 1
giWeights ftgen 921, 0, -40, -2, 0.45, 0.7, 0.8, 0.25, 1, 0.3, 0.25, 0.5, 0.35, 0.25, 1, 0.6, 0.4, 0.25, 0.15, 0.1, 0, 0, 0, 0, 1, 0.35, 0.12, 0.06, 0, 0, 0, 0, 0, 0, 1, 0.9, 0.35, 0.3, 0.2, 0.12, 0.08, 0, 0, 0
giLasting ftgen 922, 0, -40, -2, 1, 0.75, 0.7, 0.5, 0.6, 0.45, 0.4, 0.45, 0.4, 0.35, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1

; Peak amplitude of a stroke: about -9 dBFS at 8 m/s, 40 dB between 0.2 and 8 m/s.
opcode Level, i, i
  ispeed xin
  xout 0.355 * (limit(ispeed, 0.001, 16) / 8)^1.25
endop

; Corner frequency [Hz] of the contact: a harder and faster blow is shorter, so it excites higher modes.
opcode Corner, i, ii
  ihardness, ispeed xin
  xout 150 * 2^(6.5 * ihardness) * (limit(ispeed, 0.05, 16) / 2)^0.55
endop

; Onsets within a block: in Csound 6.18 the opcodes of an instrument start at the note's own sample, those of an opcode
; definition (UDO) at the block's first. So whatever runs with time from the onset is a macro, which stands in the
; instrument itself; the opcode definitions hold filters and initialisation only.

; ablow: 1 at the note's first sample, 0 elsewhere.
#define BLOW #
  ablow linseg 1, 1 / sr, 0, 1, 0
#

; Noise aN that rises from 0 in RISE seconds and falls by 60 dB in T60; stroke and place choose where the table is read.
#define BURST(N'PLACE'RISE'T60) #
  iphase$N = frac(7.3137 * p7 + 3.7711 * $PLACE + 61.8033989 * $T60)
  aenv$N expseg 1, $T60, 0.001, $T60, 0.000001, 1, 0.000001
  arise$N linseg 0, $RISE, 1, 1, 1
  a$N oscil 1, sr / 65536, giNoise, iphase$N
  a$N = a$N * arise$N * aenv$N
#

; Ends a note's asound (at level 1; ilevel, iduration): fades to 0 over its last 50 ms; choked, fades within 15 ms from
; the very sample; notes its end in table 902; pans.
#define CLOSE #
  p3 = iduration
  ilast tab_i 0, giEnds
  tabw_i max(ilast, p4 + iduration * sr + 2 * ksmps), 0, giEnds
  afade linseg 1, iduration - 0.05, 1, 0.05, 0, 1, 0
  asample linseg 0, 1000, 1000 * sr
  asound = asound * ilevel * afade
  kchoke init (p11 < 0 ? -1 : p11 - p4)
  kover init 0
  if kchoke < 0 && p10 >= 0 then
    klatest tab p10, giChokes
    kchoke = (klatest > p4 ? klatest - p4 : -1)
  endif
  if kchoke >= 0 then
    aleft limit 1 - (asample - kchoke) / (0.015 * sr), 0, 1
    asound = asound * aleft * aleft * (3 - 2 * aleft)
    kover = (k(asample) > kchoke + 0.015 * sr + ksmps ? 1 : 0)
  endif
  outs asound * p5, asound * p6
  if kover == 1 then
    turnoff
  endif
#

; A bank of up to 32 damped modes. Before it, in the same instrument, Put_mode fills the scratch tables; the bank reads them
; as it is initialised, at once, so that notes do not meet there. Each mode answers the blow with
;   weight r^n sin(theta (n + 1)),  theta = 2 pi f / sr,  r = 0.001^(1 / (t60 sr)):
; poles at r e^(+-i theta), exact in pitch and decay. A mode rests once it is 100 dB below full scale.
giFrequency ftgen 930, 0, -32, -2, 0
giT60       ftgen 931, 0, -32, -2, 0
giWeight    ftgen 932, 0, -32, -2, 0

opcode Put_mode, 0, iiii
  index, ifrequency, it60, iweight xin
  tabw_i min(ifrequency, 20000), index, giFrequency
  tabw_i it60, index, giT60
  tabw_i (ifrequency < 20000 ? iweight : 0), index, giWeight
endop

; Blocks until mode index has fallen from ilevel to -100 dBFS; 0 where there is no such mode.
opcode Resting_block, i, iii
  index, icount, ilevel xin
  it60 tab_i index, giT60
  xout (index < icount ? 2 + it60 * limit(105 + 20 * log10(ilevel), 20, 130) / 60 * kr : 0)
endop

#define MODE(I) #
  if$I tab_i $I, giFrequency
  it$I tab_i $I, giT60
  iw$I tab_i $I, giWeight
  io$I = 2 * $M_PI * if$I / sr
  ir$I = exp(log(0.001) / (max(it$I, 0.001) * sr))
  ib$I = iw$I * sin(io$I)
  ic$I = -2 * ir$I * cos(io$I)
  id$I = ir$I * ir$I
  ie$I Resting_block $I, icount, ilevel
  if kblock < ie$I then
    am$I biquad ablow, ib$I, 0, 0, 1, ic$I, id$I
    asum += am$I
  endif
#
#define BENDING_MODE(I) #
  if$I tab_i $I, giFrequency
  it$I tab_i $I, giT60
  iw$I tab_i $I, giWeight
  io$I = 2 * $M_PI * if$I / sr
  ir$I = exp(log(0.001) / (max(it$I, 0.001) * sr))
  ib$I = iw$I * sin(io$I)
  id$I = ir$I * ir$I
  ie$I Resting_block $I, icount, ilevel
  if kblock < ie$I then
    kc$I = -2 * ir$I * cos(min(io$I * kbend, 3))
    am$I biquad ablow, ib$I, 0, 0, 1, kc$I, id$I
    asum += am$I
  endif
#

opcode Bank, a, aii
  ablow, icount, ilevel xin
  kblock init 0
  asum = 0
  $MODE(0)
  $MODE(1)
  $MODE(2)
  $MODE(3)
  $MODE(4)
  $MODE(5)
  $MODE(6)
  $MODE(7)
  $MODE(8)
  $MODE(9)
  $MODE(10)
  $MODE(11)
  $MODE(12)
  $MODE(13)
  $MODE(14)
  $MODE(15)
  $MODE(16)
  $MODE(17)
  $MODE(18)
  $MODE(19)
  $MODE(20)
  $MODE(21)
  $MODE(22)
  $MODE(23)
  $MODE(24)
  $MODE(25)
  $MODE(26)
  $MODE(27)
  $MODE(28)
  $MODE(29)
  $MODE(30)
  $MODE(31)
  kblock += 1
  xout asum
endop

; The same for at most 12 modes, their frequencies multiplied by kbend.
opcode Bending_bank, a, akii
  ablow, kbend, icount, ilevel xin
  kblock init 0
  asum = 0
  $BENDING_MODE(0)
  $BENDING_MODE(1)
  $BENDING_MODE(2)
  $BENDING_MODE(3)
  $BENDING_MODE(4)
  $BENDING_MODE(5)
  $BENDING_MODE(6)
  $BENDING_MODE(7)
  $BENDING_MODE(8)
  $BENDING_MODE(9)
  $BENDING_MODE(10)
  $BENDING_MODE(11)
  kblock += 1
  xout asum
endop

; A tick that starts at its largest sample, has no DC and is gone within 0.3 ms.
opcode Tick, a, ai
  ablow, iamp xin
  atick biquad ablow, iamp, -iamp, 0, 1, -0.6, 0
  xout atick
endop

; Seconds until a sound of peak ilevel that falls by 60 dB in it60 lies below -100 dBFS.
opcode Duration, i, ii
  ilevel, it60 xin
  xout 0.08 + it60 * limit(100 + 20 * log10(ilevel), 20, 120) / 60
endop

; |J_m(x)| by its power series (x below 10: 26 terms reach 1e-9).
opcode Bessel, i, ii
  im, ix xin
  iterm = 1
  ik = 1
  while ik <= im do
    iterm *= ix / (2 * ik)
    ik += 1
  od
  isum = iterm
  ik = 1
  while ik <= 26 do
    iterm *= -ix * ix / (4 * ik * (ik + im))
    isum += iterm
    ik += 1
  od
  xout abs(isum)
endop

; Puts the 12 membrane modes, struck at radius iradius of 1; gives the root of the sum of squared weights.
opcode Put_membrane, i, iiiiii
  ifrequency, it60, idamping, icorner, ikettle, iradius xin
  index = 0
  isquares = 0
  while index < 12 do
    iroot tab_i index, giRoots
    im tab_i index, giDiameters
    ipeak tab_i index, giPeaks
    iair tab_i index, giKettle
    iratio = (iroot / 2.404826)^(1 - ikettle) * iair^ikettle
    ; A kettledrum's axisymmetric modes radiate well: weak and short.
    iaxial = (im == 0 ? ikettle : 0)
    ishape Bessel im, iroot * iradius
    iweight = ishape / ipeak / sqrt(iratio) / (1 + (ifrequency * iratio / icorner)^2) * 0.35^iaxial
    Put_mode index, ifrequency * iratio, it60 * limit(iratio, 1, 100)^(-idamping) * 0.3^iaxial, iweight
    isquares += iweight * iweight
    index += 1
  od
  xout sqrt(isquares)
endop

; Zone 0: head. Zone 1: rim shot (the head near its edge, less of it, with rim and shell).
instr drum
  ispeed = p7
  iplace = p8
  irim = (p9 >= 1 ? 1 : 0)
  ihardness = p15
  isnare = p20
  isnare_t60 = p21
  ilevel Level ispeed
  icorner Corner ihardness, ispeed
  $BLOW
  ; The pitch follows the membrane's tension, which grows with the stroke.
  kfall expon 1, p17, exp(-1)
  kbend = cent(p16 * limit(ispeed, 0, 16) / 8 * kfall)
  inorm Put_membrane p12, p13, p14, icorner, p18, 0.04 + 0.8 * (irim == 1 ? 1 : iplace)
  asound Bending_bank ablow, kbend, 12, ilevel
  asound = asound * (irim == 1 ? 0.2 : 0.39) / inorm
  if p19 > 0 then
    iburst_t60 = 0.012 + 0.02 * (1 - ihardness)
    $BURST(burst'iplace'0.0002'iburst_t60)
    aburst butterlp aburst, limit(4 * icorner, 300, 15000)
    asound = asound + aburst * p19 * 0.55
  endif
  if isnare > 0 then
    $BURST(wires'iplace'0.0015'isnare_t60)
    awires butterhp awires, 700
    awires butterlp awires, limit(4500 * sqrt(ispeed / 2), 1500, 16000)
    asound = asound + awires * isnare * 0.85
  endif
  if irim == 1 then
    Put_mode 0, p22, 0.09, 0.3
    Put_mode 1, p22 * 1.72, 0.07, 0.22
    Put_mode 2, p22 * 2.61, 0.05, 0.3 * limit(sqrt(ispeed / 8), 0, 1)
    arim Bank ablow, 3, ilevel
    asound = asound + arim
  endif
  atick Tick ablow, 0.2
  asound += atick
  iduration Duration ilevel, max(p13, isnare > 0 ? isnare_t60 : 0, 0.1)
  $CLOSE
endin

; Puts the partials of set iset; place 1 brings out the high ones. With iwarble each is two modes that far apart.
; Gives the number of modes and the root of the sum of squared weights.
opcode Put_partials, ii, iiiiiii
  iset, ifrequency, it60, idamping, icorner, iplace, iwarble xin
  index = 0
  icount = 0
  isquares = 0
  while index < 10 do
    iratio tab_i iset * 10 + index, giRatios
    iweight tab_i iset * 10 + index, giWeights
    ilasting tab_i iset * 10 + index, giLasting
    iat = ifrequency * iratio
    if iweight > 0 then
      iweight = iweight * iratio^(0.6 * iplace - 0.2) / (1 + (iat / icorner)^2)
      isquares += iweight * iweight
      ipartial_t60 = it60 * ilasting * limit(iratio / (iset == 0 ? 0.5 : 1), 1, 100)^(-idamping)
      Put_mode icount, max(iat - iwarble / 2, 1), ipartial_t60, (iwarble > 0 ? 0.5 : 1) * iweight
      icount += 1
      if iwarble > 0 then
        Put_mode icount, iat + iwarble / 2, ipartial_t60, 0.45 * iweight
        icount += 1
      endif
    endif
    index += 1
  od
  xout icount, sqrt(isquares)
endop

; Zone 0: body. Zone 1: shoulder (brighter, as place 1, and half as loud).
instr bell
  ispeed = p7
  ishoulder = (p9 >= 1 ? 1 : 0)
  iplace = (ishoulder == 1 ? 1 : p8)
  iset = int(p14 + 0.5)
  ilevel Level ispeed
  icorner Corner p16, ispeed
  $BLOW
  icount, inorm Put_partials iset, p12, p13, p15, max(icorner, p12), iplace, p17
  asound Bank ablow, icount, ilevel
  asound = asound * 0.53 / inorm * (ishoulder == 1 ? 0.5 : 1)
  if p18 > 0 then
    $BURST(burst'iplace'0.0002'0.02)
    aburst butterlp aburst, limit(2 * icorner, 500, 16000)
    asound = asound + aburst * p18 * 0.8
  endif
  atick Tick ablow, 0.2
  asound += atick
  iduration Duration ilevel, max(p13, 0.05)
  $CLOSE
endin

; Puts icount partials of a stiff string struck at ipoint of its length: weight sin(n pi ipoint), the comb of the struck
; place. Gives the root of the sum of squared weights.
opcode Put_string, i, iiiiiiii
  icount, ifrequency, it60, idamping, icorner, iinharmonicity, ipoint, ipluck xin
  index = 1
  isquares = 0
  while index <= icount do
    iat = index * ifrequency * sqrt((1 + iinharmonicity * index * index) / (1 + iinharmonicity))
    iweight = abs(sin(index * $M_PI * ipoint)) * index^(-0.3 - ipluck) / (1 + (iat / icorner)^2)
    isquares += iweight * iweight
    Put_mode index - 1, iat, it60 * index^(-idamping), iweight
    index += 1
  od
  xout sqrt(isquares)
endop

; place 1 strikes a fifth as far from the bridge as place 0. All zones sound alike.
instr string
  ispeed = p7
  ilevel Level ispeed
  icorner Corner p15, ispeed
  $BLOW
  icount = limit(int(12000 / p12), 1, 32)
  inorm Put_string icount, p12, p13, p14, max(icorner, p12), p16, p17 * (1 - 0.8 * p8), p18
  asound Bank ablow, icount, ilevel
  asound = asound * 0.38 / inorm
  if p19 > 0 then
    $BURST(burst'p8'0.0002'0.025)
    aburst butterlp aburst, limit(1.5 * icorner, 300, 12000)
    asound = asound + aburst * p19 * 0.8
  endif
  atick Tick ablow, 0.2
  asound += atick
  iduration Duration ilevel, max(p13, 0.05)
  $CLOSE
endin

; Puts 32 plate modes, spread evenly in log frequency with a fixed irregularity (golden-ratio sequence). The cup rings on
; every fifth one. Signs alternate, or all modes would meet in a click. Gives the root of the sum of squared weights and the sign of the
; modes' first sample, which the tick takes, so that they do not cancel.
opcode Put_plate, ii, iiiiiii
  ifrequency, ispan, it60, idamping, icorner, iplace, icup xin
  index = 0
  isquares = 0
  ifirst = 0
  while index < 32 do
    ijitter = frac(index * 0.6180339887 + 0.37) - 0.5
    iat = ifrequency * ispan^(limit((index + 0.9 * ijitter) / 31, 0, 1))
    iweight = (iat / ifrequency)^(0.35 + 0.3 * iplace) / (1 + (iat / icorner)^2) * (0.6 + 0.8 * frac(index * 0.7548776662))
    iweight = iweight * (icup == 1 && index % 5 != 2 ? 0.15 : 1)
    iweight = (index % 2 == 0 ? iweight : -iweight)
    isquares += iweight * iweight
    ifirst += iweight * sin(2 * $M_PI * iat / sr)
    Put_mode index, iat, it60 * (1000 / iat)^idamping, iweight
    index += 1
  od
  xout sqrt(isquares), (ifirst < 0 ? -1 : 1)
endop

; Zone 0: bow and edge. Zone 1: cup (clearer, less noise).
instr cymbal
  ispeed = p7
  iplace = p8
  icup = (p9 >= 1 ? 1 : 0)
  it60 = p13
  idamping = p14
  inoise = p16 * (icup == 1 ? 0.25 : 1)
  ilevel Level ispeed
  icorner Corner p15, ispeed
  icorner = max(icorner, 2 * p12)
  ispan = limit(36^p17, 2, 15000 / p12)
  $BLOW
  inorm, isign Put_plate p12, ispan, it60, idamping, icorner, iplace, icup
  aplate Bank ablow, 32, ilevel
  asound = aplate * 0.42 / inorm * (1 - 0.8 * inoise)
  if inoise > 0 then
    ; Three bands of noise stand for the modes too dense to tell apart; the high ones come up last and go first.
    ilow_t60 = it60 * (1000 / 1200)^idamping
    $BURST(low'iplace'0.0005'ilow_t60)
    alow butterbp alow, 1200, 1500
    imid_t60 = it60 * (1000 / 4000)^idamping
    $BURST(mid'iplace'0.001'imid_t60)
    amid butterbp amid, 4000, 4000
    ihigh_t60 = it60 * (1000 / 9000)^idamping
    $BURST(high'iplace'0.003'ihigh_t60)
    ahigh butterbp ahigh, 9000, 8000
    ibright = 1 / (1 + (9000 / icorner)^1.5)
    imiddle = 1 / (1 + (4000 / icorner)^1.5)
    asound = asound + inoise * (alow * 0.6 + amid * imiddle * 2 + ahigh * ibright * 3.2) / (0.6 + imiddle + ibright)
  endif
  atick Tick ablow, 0.2 * isign
  asound += atick
  iduration Duration ilevel, max(it60 * (1000 / limit(p12, 60, 1000))^idamping, 0.05)
  $CLOSE
endin
