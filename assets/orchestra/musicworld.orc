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

; The blow: 1 at the note's first sample, 0 elsewhere.
opcode Blow, a, 0
  ablow linseg 1, 1 / sr, 0, 1, 0
  xout ablow
endop

; One mode: the blow's answer is iamp r^n sin(theta (n + 1)), exact in pitch and decay (poles at r e^(+-i theta)).
opcode Mode, a, aiii
  ablow, ifrequency, it60, iamp xin
  itheta = 2 * $M_PI * ifrequency / sr
  ir = exp(log(0.001) / (it60 * sr))
  amode biquad ablow, iamp * sin(itheta), 0, 0, 1, -2 * ir * cos(itheta), ir * ir
  xout amode
endop

; A tick that starts at its largest sample, has no DC and is gone within 0.3 ms.
opcode Tick, a, ai
  ablow, iamp xin
  atick biquad ablow, iamp, -iamp, 0, 1, -0.6, 0
  xout atick
endop

; Noise that rises from 0 in irise seconds and falls by 60 dB in it60; the stroke chooses where the table is read.
opcode Burst, a, iiii
  ispeed, iplace, irise, it60 xin
  iphase = frac(7.3137 * ispeed + 3.7711 * iplace + 0.6180339887 * it60 * 100)
  aenv expseg 1, it60, 0.001, it60, 0.000001, 1, 0.000001
  arise linseg 0, irise, 1, 1, 1
  anoise oscil 1, sr / 65536, giNoise, iphase
  xout anoise * arise * aenv
endop

; Ends a note: fades to 0 over its last 50 ms, fades within 15 ms from the sample at which it is choked, notes its end.
opcode Close, a, aiiii
  asound, iduration, ionset, igroup, ichoke xin
  ipast tab_i 0, giEnds
  tabw_i max(ipast, ionset + iduration * sr + 2 * ksmps), 0, giEnds
  afade linseg 1, iduration - 0.05, 1, 0.05, 0, 1, 0
  asample linseg 0, 1000, 1000 * sr
  asound = asound * afade
  kchoke init (ichoke < 0 ? -1 : ichoke - ionset)
  if kchoke < 0 && igroup >= 0 then
    klatest tab igroup, giChokes
    kchoke = (klatest > ionset ? klatest - ionset : -1)
  endif
  if kchoke >= 0 then
    aleft limit 1 - (asample - kchoke) / (0.015 * sr), 0, 1
    asound = asound * aleft * aleft * (3 - 2 * aleft)
    if k(asample) > kchoke + 0.015 * sr + ksmps then
      turnoff
    endif
  endif
  xout asound
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

; Membrane modes iindex...11, struck at radius iradius of 1; kbend multiplies their frequencies. Also the sum of squared weights.
opcode Membrane, ai, akiiiiiii
  ablow, kbend, iindex, ifrequency, it60, idamping, icorner, ikettle, iradius xin
  iroot tab_i iindex, giRoots
  im tab_i iindex, giDiameters
  ipeak tab_i iindex, giPeaks
  iair tab_i iindex, giKettle
  iratio = (iroot / 2.404826)^(1 - ikettle) * iair^ikettle
  if (im == 0) then
    iaxial = ikettle
  else
    iaxial = 0
  endif
  ishape Bessel im, iroot * iradius
  iweight = ishape / ipeak / sqrt(iratio) / (1 + (ifrequency * iratio / icorner)^2) * 0.35^iaxial
  imode_t60 = it60 * limit(iratio, 1, 100)^(-idamping) * 0.3^iaxial
  itheta = 2 * $M_PI * ifrequency * iratio / sr
  ir = exp(log(0.001) / (imode_t60 * sr))
  kcos = cos(limit(itheta * kbend, 0, 3))
  amodes biquad ablow, iweight * sin(itheta), 0, 0, 1, -2 * ir * kcos, ir * ir
  isquares = iweight * iweight
  if (iindex < 11) then
    arest, irest Membrane ablow, kbend, iindex + 1, ifrequency, it60, idamping, icorner, ikettle, iradius
    amodes = amodes + arest
    isquares = isquares + irest
  endif
  xout amodes, isquares
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
  ablow Blow
  ; The pitch follows the membrane's tension, which grows with the stroke.
  kfall expon 1, p17, exp(-1)
  kbend = cent(p16 * limit(ispeed, 0, 16) / 8 * kfall)
  ahead, isquares Membrane ablow, kbend, 0, p12, p13, p14, icorner, p18, 0.04 + 0.8 * (irim == 1 ? 1 : iplace)
  asound = ahead * (irim == 1 ? 0.3 : 0.62) / sqrt(isquares)
  if p19 > 0 then
    aburst Burst ispeed, iplace, 0.0002, 0.012 + 0.02 * (1 - ihardness)
    aburst butterlp aburst, limit(2.5 * icorner, 300, 15000)
    asound = asound + aburst * p19 * 0.9
  endif
  if isnare > 0 then
    awires Burst ispeed, 1 - iplace, 0.0015, isnare_t60
    awires butterhp awires, 700
    awires butterlp awires, limit(4500 * sqrt(ispeed / 2), 1500, 16000)
    asound = asound + awires * isnare * 0.75
  endif
  if irim == 1 then
    arim1 Mode ablow, p22, 0.09, 0.4
    arim2 Mode ablow, p22 * 1.72, 0.07, 0.3
    arim3 Mode ablow, p22 * 2.61, 0.05, 0.4 * limit(sqrt(ispeed / 8), 0, 1)
    asound = asound + arim1 + arim2 + arim3
  endif
  atick Tick ablow, 0.2
  iduration Duration ilevel, max(p13, isnare > 0 ? isnare_t60 : 0, 0.1)
  p3 = iduration
  asound Close (asound + atick) * ilevel, iduration, p4, p10, p11
  outs asound * p5, asound * p6
endin

; Partials iindex...9 of set iset; place 1 brings out the high ones. Each is two modes iwarble apart.
opcode Partials, ai, aiiiiiiii
  ablow, iindex, iset, ifrequency, it60, idamping, icorner, iplace, iwarble xin
  iratio tab_i iset * 10 + iindex, giRatios
  iweight tab_i iset * 10 + iindex, giWeights
  ilasting tab_i iset * 10 + iindex, giLasting
  iat = ifrequency * iratio
  iweight = iweight * iratio^(0.6 * iplace - 0.2) / (1 + (iat / icorner)^2)
  iweight = (iat < 18000 ? iweight : 0)
  iat = (iat < 18000 ? iat : 18000)
  ipartial_t60 = it60 * ilasting * limit(iratio / (iset == 0 ? 0.5 : 1), 1, 100)^(-idamping)
  if iwarble > 0 then
    alow Mode ablow, iat - iwarble / 2, ipartial_t60, iweight * 0.55
    ahigh Mode ablow, iat + iwarble / 2, ipartial_t60, iweight * 0.45
    apartials = alow + ahigh
  else
    apartials Mode ablow, iat, ipartial_t60, iweight
  endif
  isquares = iweight * iweight
  inext = 0
  if iindex < 9 then
    inext tab_i iset * 10 + iindex + 1, giWeights
  endif
  if inext > 0 then
    arest, irest Partials ablow, iindex + 1, iset, ifrequency, it60, idamping, icorner, iplace, iwarble
    apartials = apartials + arest
    isquares = isquares + irest
  endif
  xout apartials, isquares
endop

; Zone 0: body. Zone 1: shoulder (brighter, as place 1, and half as loud).
instr bell
  ispeed = p7
  ishoulder = (p9 >= 1 ? 1 : 0)
  iplace = (ishoulder == 1 ? 1 : p8)
  iset = int(p14 + 0.5)
  ilevel Level ispeed
  icorner Corner p16, ispeed
  ablow Blow
  asound, isquares Partials ablow, 0, iset, p12, p13, p15, max(icorner, p12), iplace, p17
  asound = asound * 0.58 / sqrt(isquares) * (ishoulder == 1 ? 0.5 : 1)
  if p18 > 0 then
    aburst Burst ispeed, iplace, 0.0002, 0.02
    aburst butterlp aburst, limit(2 * icorner, 500, 16000)
    asound = asound + aburst * p18 * 0.8
  endif
  atick Tick ablow, 0.2
  iduration Duration ilevel, max(p13, 0.05)
  p3 = iduration
  asound Close (asound + atick) * ilevel, iduration, p4, p10, p11
  outs asound * p5, asound * p6
endin

; Partials n = iindex...icount of a stiff string struck at ipoint of its length: weight sin(n pi ipoint), the comb of the
; struck place.
opcode StringPartials, ai, aiiiiiiiii
  ablow, iindex, icount, ifrequency, it60, idamping, icorner, iinharmonicity, ipoint, ipluck xin
  iat = iindex * ifrequency * sqrt((1 + iinharmonicity * iindex * iindex) / (1 + iinharmonicity))
  iweight = sin(iindex * $M_PI * ipoint) * iindex^(-0.3 - ipluck) / (1 + (iat / icorner)^2)
  iweight = (iat < 18000 ? abs(iweight) : 0)
  apartials Mode ablow, min(iat, 18000), it60 * iindex^(-idamping), iweight
  isquares = iweight * iweight
  if iindex < icount then
    arest, irest StringPartials ablow, iindex + 1, icount, ifrequency, it60, idamping, icorner, iinharmonicity, ipoint, ipluck
    apartials = apartials + arest
    isquares = isquares + irest
  endif
  xout apartials, isquares
endop

; place 1 strikes a fifth as far from the bridge as place 0. All zones sound alike.
instr string
  ispeed = p7
  ilevel Level ispeed
  icorner Corner p15, ispeed
  ablow Blow
  icount = limit(int(12000 / p12), 1, 32)
  asound, isquares StringPartials ablow, 1, icount, p12, p13, p14, max(icorner, p12), p16, p17 * (1 - 0.8 * p8), p18
  asound = asound * 0.5 / sqrt(isquares)
  if p19 > 0 then
    aburst Burst ispeed, p8, 0.0002, 0.025
    aburst butterlp aburst, limit(1.5 * icorner, 300, 12000)
    asound = asound + aburst * p19 * 0.8
  endif
  atick Tick ablow, 0.2
  iduration Duration ilevel, max(p13, 0.05)
  p3 = iduration
  asound Close (asound + atick) * ilevel, iduration, p4, p10, p11
  outs asound * p5, asound * p6
endin

; Plate modes iindex...29, spread evenly in log frequency with a fixed irregularity (golden-ratio sequence).
opcode Plate, ai, aiiiiiiii
  ablow, iindex, ifrequency, ispan, it60, idamping, icorner, iplace, icup xin
  ijitter = frac(iindex * 0.6180339887 + 0.37) - 0.5
  iat = ifrequency * ispan^(limit((iindex + 0.9 * ijitter) / 29, 0, 1))
  iweight = (iat / ifrequency)^(0.15 + 0.3 * iplace) / (1 + (iat / icorner)^2) * (0.6 + 0.8 * frac(iindex * 0.7548776662))
  ; The cup rings on every fifth partial, the rest little.
  iweight = iweight * (icup == 1 && iindex % 5 != 2 ? 0.15 : 1)
  aplate Mode ablow, iat, it60 * (1000 / iat)^idamping, iweight
  isquares = iweight * iweight
  if iindex < 29 then
    arest, irest Plate ablow, iindex + 1, ifrequency, ispan, it60, idamping, icorner, iplace, icup
    aplate = aplate + arest
    isquares = isquares + irest
  endif
  xout aplate, isquares
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
  ablow Blow
  aplate, isquares Plate ablow, 0, p12, ispan, it60, idamping, icorner, iplace, icup
  asound = aplate * 0.42 / sqrt(isquares) * (1 - 0.8 * inoise)
  if inoise > 0 then
    ; Three bands of noise stand for the modes too dense to tell apart; the high ones come up last and go first.
    alow Burst ispeed, iplace, 0.0005, it60 * (1000 / 1200)^idamping
    alow butterbp alow, 1200, 1500
    amid Burst ispeed, 1 - iplace, 0.001, it60 * (1000 / 4000)^idamping
    amid butterbp amid, 4000, 4000
    ahigh Burst ispeed, 0.5 * iplace, 0.003, it60 * (1000 / 9000)^idamping
    ahigh butterbp ahigh, 9000, 8000
    ibright = 1 / (1 + (9000 / icorner)^1.5)
    imiddle = 1 / (1 + (4000 / icorner)^1.5)
    asound = asound + inoise * (alow * 0.5 + amid * imiddle * 1.2 + ahigh * ibright * 1.6) / (0.6 + imiddle + ibright)
  endif
  atick Tick ablow, 0.2
  iduration Duration ilevel, max(it60 * (1000 / limit(p12, 60, 1000))^idamping, 0.05)
  p3 = iduration
  asound Close (asound + atick) * ilevel, iduration, p4, p10, p11
  outs asound * p5, asound * p6
endin
