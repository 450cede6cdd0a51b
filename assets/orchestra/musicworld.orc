; MusicWorld's orchestra: drum, bell, string and cymbal, all synthesised (no recordings).
;
; What the host passes (see audio/README.md): one event a note,
;   p4  onset [samples from the start of the performance]; sample-accurate, so the note's first sample is this one
;   p5  left gain    p6  right gain  (pan and voice gain, already multiplied)
;   p7  strike speed [m/s]           p8  place, 0 centre of the struck zone ... 1 its edge
;   p9  zone, 0 head or body, 1 and above: rim, cup, shoulder (see each instrument)
;   p10 voice (index into tables 901 and 903)
;   p11 onset [samples] of a choking note within this note's own first block (-1: none)
;   p12 and on: the instrument's parameters, in the order of the lines below.
; Tables shared with the host:
;   901 one entry a voice: onset [samples] of what has choked it last, written before that one's block
;   902 entry 0: the sample by which every note so far has ended, written by close_note
;   903 one entry a voice: gain of what the room hears of it beyond the voice itself (0: the room hears it as it is)
;   904 two entries a voice that a pedal makes ring longer or shorter: its decay_s as the pedal is now, and the longest (0: no such pedal)
; Opcodes of the host (audio/src/opcodes.h): contact_force, noise_burst, modal_bank, pedal_ring, pedal_gain, close_note, bessel.
;
; Each line `;@ instrument parameter default minimum maximum text` declares a parameter; the host reads these lines.
;
;@ drum   frequency_hz     180    20   2000  pitch: lowest mode of the membrane (with kettle = 1: the (1,1) mode) [Hz]
;@ drum   decay_s          1.2    0.03 20    time in which the (1,1) mode falls by 60 dB [s]; the (0,1) mode, which radiates best, is gone in about 0.4 of it
;@ drum   damping          0.8    0    3     how much faster high modes decay: their losses grow as frequency^damping
;@ drum   hardness         0.4    0    1     of what is struck: 0 felt ... 1 metal, a contact modulus of 1 MPa * 10^(4 hardness); the contact's length, so brightness
;@ drum   bend_cents       40     0    2400  how far an 8 m/s stroke starts above the pitch [cents], in proportion to the speed
;@ drum   bend_s           0.06   0.005 1    time constant with which the bend dies [s]
;@ drum   kettle           0      0    1     0 membrane in air (tom, snare, kick) ... 1 kettledrum (nearly harmonic modes)
;@ drum   attack           0.35   0    1     sound of the contact itself
;@ drum   snare            0      0    1     snare wires
;@ drum   snare_decay_s    0.22   0.02 3     time in which the wires, left to themselves, fall by 60 dB [s]
;@ drum   rim_frequency_hz 850    100  6000  lowest mode of rim and shell, heard in zone 1 [Hz]
;@ drum   air_load         1.2    0    5     air that moves with the head: 2 rho a / sigma (density of air, radius, head's mass an area)
;@ drum   second_head      0      0    1     coupling to a second head by the air between: splits the modes (0,1) and (1,1) into pairs
;@ drum   variation        0.5    0    1     small differences between equal strokes
;@ drum   tip_radius_m     0.006  0.001 0.1  radius of the stick's tip [m]; the kit's [stick] radius unless given
;@ drum   tip_mass_kg      0.05   0.001 5    effective mass of the stick [kg]; the kit's [stick] mass unless given
;@ drum   tip_young_pa     1e10   1e4  1e12  Young's modulus of the tip [Pa]; the kit's [stick] young_pa unless given
;@ bell   frequency_hz     600    30   8000  pitch: the partial of ratio 1 [Hz]
;@ bell   decay_s          4      0.03 60    time in which the slowest partial falls by 60 dB [s]
;@ bell   partials         0      0    3     0 minor-third bell, 1 free bar (glockenspiel), 2 tuned bar (vibraphone), 3 cowbell
;@ bell   damping          1      0    3     how much faster high partials decay
;@ bell   hardness         0.6    0    1     of what is struck: 0 felt ... 1 metal; the contact's length, so brightness
;@ bell   warble_hz        0      0    20    beating of each partial's two halves, split evenly about its pitch [Hz]
;@ bell   attack           0.15   0    1     sound of the contact itself
;@ bell   width            0.3    0    1     how far its partials lie apart, left and right
;@ bell   variation        0.5    0    1     small differences between equal strokes
;@ bell   tip_radius_m     0.006  0.001 0.1  radius of the mallet's tip [m]; the kit's [stick] radius unless given
;@ bell   tip_mass_kg      0.05   0.001 5    effective mass of the mallet [kg]; the kit's [stick] mass unless given
;@ bell   tip_young_pa     1e10   1e4  1e12  Young's modulus of the tip [Pa]; the kit's [stick] young_pa unless given
;@ string frequency_hz     220    25   4000  pitch: first partial [Hz]
;@ string decay_s          3      0.05 40    time in which the first partial falls by 60 dB [s]
;@ string damping          0.7    0    3     how much faster high partials decay: decay_s / n^damping
;@ string hardness         0.55   0    1     of the hammer: 0 felt ... 1 metal; the contact's length, so brightness
;@ string inharmonicity    0.0001 0    0.01  stiffness B: partial n lies at n f sqrt((1 + B n^2) / (1 + B))
;@ string strike_point     0.23   0.02 0.5   where place = 0 strikes, as a fraction of the length from the bridge
;@ string pluck            0      0    1     0 hammered ... 1 plucked (partials fall by a further 1/n)
;@ string attack           0.12   0    1     sound of the contact itself
;@ string width            0.5    0    1     how far its partials lie apart, left and right
;@ string variation        0.5    0    1     small differences between equal strokes
;@ string tip_radius_m     0.006  0.001 0.1  radius of the hammer's tip [m]; the kit's [stick] radius unless given
;@ string tip_mass_kg      0.05   0.001 5    effective mass of the hammer [kg]; the kit's [stick] mass unless given
;@ string tip_young_pa     1e10   1e4  1e12  Young's modulus of the tip [Pa]; the kit's [stick] young_pa unless given
;@ cymbal frequency_hz     340    60   3000  lowest partial [Hz]; another one gives another plate with partials of its own
;@ cymbal decay_s          3      0.02 30    time in which the plate falls by 60 dB at 1 kHz [s]: crash 3, ride 4, closed hi-hat 0.12
;@ cymbal damping          0.45   0    2     how much faster high frequencies decay: (1 kHz / f)^damping
;@ cymbal hardness         0.75   0    1     of the plate against the stick: 0 felt ... 1 metal; the contact's length, so brightness
;@ cymbal noise            0.5    0    1     share of the high partials that large motion of the low ones sets going: crash 0.8, ride 0.3
;@ cymbal build_s          0.025  0.005 0.2  time in which that drive rises [s]; it then dies within about ten times this
;@ cymbal spread           1      0.3  1.5   width of the partials' range: 1 reaches 50 times frequency_hz, at most 18 kHz
;@ cymbal attack           0.1    0    1     sound of the contact itself
;@ cymbal width            0.4    0    1     how far its partials lie apart, left and right
;@ cymbal variation        0.5    0    1     small differences between equal strokes
;@ cymbal tip_radius_m     0.006  0.001 0.1  radius of the stick's tip [m]; the kit's [stick] radius unless given
;@ cymbal tip_mass_kg      0.05   0.001 5    effective mass of the stick [kg]; the kit's [stick] mass unless given
;@ cymbal tip_young_pa     1e10   1e4  1e12  Young's modulus of the tip [Pa]; the kit's [stick] young_pa unless given

sr = 48000
ksmps = 64
; Left and right, and what the room hears of both beyond that.
nchnls = 4
0dbfs = 1

giChokes ftgen 901, 0, -256, -2, 0
giEnds   ftgen 902, 0, -1, -2, 0
giSends  ftgen 903, 0, -256, -2, 0
giDecays ftgen 904, 0, -512, -2, 0

; Membrane modes (m, n) by frequency: nodal diameters m, nodal circles n and the root of the Bessel function J_m (Abramowitz and Stegun, table 9.5),
; and a kettledrum's ratios to its (1,1) mode: 1, 1.50, 1.98, 2.44, 2.90 for one nodal circle and 1 to 5 diameters, drawn
; together by the air outside and in the kettle (Christian, Davis, Tubis, Anderson, Mills and Rossing, Effects of air loading
; on timpani membrane vibrations, JASA 76, 1984; Fletcher and Rossing, The Physics of Musical Instruments, chapter 18).
giDiameters ftgen 910, 0, -32, -2, 0, 1, 2, 0, 3, 1, 4, 2, 0, 5, 3, 6, 1, 4, 7, 2, 0, 8, 5, 3, 1, 9, 6, 4, 10, 2, 7, 0, 11, 5, 8, 3
giCircles   ftgen 912, 0, -32, -2, 1, 1, 1, 2, 1, 2, 1, 2, 3, 1, 2, 1, 3, 2, 1, 3, 4, 1, 2, 3, 4, 1, 2, 3, 1, 4, 2, 5, 1, 3, 2, 4
giRoots     ftgen 911, 0, -32, -2, 2.404826, 3.831706, 5.135622, 5.520078, 6.380162, 7.015587, 7.588342, 8.417244, 8.653728, 8.771484, 9.761023, 9.936110, 10.173468, 11.064709, 11.086370, 11.619841, 11.791534, 12.225092, 12.338604, 13.015201, 13.323692, 13.354300, 13.589290, 14.372537, 14.475501, 14.795952, 14.821269, 14.930918, 15.589848, 15.700174, 16.037774, 16.223466
giKettle    ftgen 913, 0, -32, -2, 0.85, 1, 1.5, 1.68, 1.98, 2.09, 2.44, 2.61, 2.52, 2.9, 3.05, 3.36, 3.19, 3.47, 3.81, 3.64, 3.69, 4.27, 3.86, 4.08, 4.17, 4.72, 4.26, 4.5, 5.17, 4.63, 4.64, 4.68, 5.62, 4.92, 5.02, 5.08

; Bell partials, ten a set: ratio, weight, decay relative to the slowest (before `damping`). Weight 0: no partial.
giRatios  ftgen 920, 0, -40, -2, 0.5, 1, 1.2, 1.5, 2, 2.51, 2.66, 3.01, 4.17, 5.43, 1, 2.756, 5.404, 8.933, 13.345, 18.638, 1, 1, 1, 1, 1, 3.984, 10.668, 17.98, 1, 1, 1, 1, 1, 1, 1, 1.504, 2.32, 3.07, 4.22, 5.5, 6.9, 1, 1, 1
giWeights ftgen 921, 0, -40, -2, 0.45, 0.7, 0.8, 0.25, 1, 0.3, 0.25, 0.5, 0.35, 0.25, 1, 0.6, 0.4, 0.25, 0.15, 0.1, 0, 0, 0, 0, 1, 0.35, 0.12, 0.06, 0, 0, 0, 0, 0, 0, 1, 0.9, 0.35, 0.3, 0.2, 0.12, 0.08, 0, 0, 0
giLasting ftgen 922, 0, -40, -2, 1, 0.75, 0.7, 0.5, 0.6, 0.45, 0.4, 0.45, 0.4, 0.35, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1

; The modes of the note that is being set up, four values each: frequency [Hz], T60 [s], weight, drive. modal_bank reads them as
; it is initialised, at once, so that notes do not meet here.
giModes ftgen 930, 0, -2048, -2, 0

; Onsets within a block: in Csound 6.18 the opcodes of an instrument start at the note's own sample, those of an opcode
; definition (UDO) at the block's first. So whatever runs with time from the onset stands in the instrument itself or in a
; macro; the opcode definitions initialise. Each call of one takes time in every block all the same, so what every note needs is a
; macro, which the opcode of that name wraps for orchestras of one's own.

; Peak amplitude of a stroke: about -9 dBFS at 8 m/s, 40 dB between 0.2 and 8 m/s.
#define LEVEL(SPEED) #(0.355 * (limit($SPEED, 0.001, 16) / 8)^1.33)#
opcode Level, i, i
  ispeed xin
  xout $LEVEL(ispeed)
endop

; Length of the contact [s]: a ball that strikes a plane (Hertz 1882; Johnson, Contact Mechanics, 1985, chapter 11),
;   T = 2.943 (15 m / (16 E sqrt(R)))^(2/5) v^(-1/5),
; with 1 / E = 1 / E_tip + 1 / E_struck. Its force is nearly half a sine (Goldsmith, Impact, 1960). A faster stroke is shorter, so
; it excites higher modes: the stroke's brightness needs no rule of its own.
#define CONTACT(HARDNESS'RADIUS'MASS'YOUNG'SPEED) #limit(2.943 * (15 * ($MASS) * (10^(-6 - 4 * ($HARDNESS)) + 1 / ($YOUNG)) / (16 * sqrt($RADIUS)))^0.4 * limit($SPEED, 0.02, 16)^(-0.2), 0.0001, 0.02)#
opcode Contact, i, iiiii
  ihardness, iradius, imass, iyoung, ispeed xin
  xout $CONTACT(ihardness'iradius'imass'iyoung'ispeed)
endop

; What a mode gets of such a pulse of unit area, up to the zeros of its spectrum.
opcode Reaches, i, ii
  ifrequency, icontact xin
  ix = 2 * ifrequency * icontact
  xout 1 / sqrt(1 + ix^4)
endop

; A stroke's own number in [0, 1), a function of its onset and its instrument alone (fractions of the golden ratio's and the plastic
; number's multiples spread evenly); and values in [-1, 1) made of it.
#define SEED(VARIATION'ONSET'FREQUENCY) #(($VARIATION) > 0 ? frac(($ONSET) * 0.6180339887498949 + ($FREQUENCY) * 0.7548776662466927) : 0.5)#
opcode Seed, i, iii
  ivariation, ionset, ifrequency xin
  xout $SEED(ivariation'ionset'ifrequency)
endop
#define SCATTER(SEED'KEY) #(2 * frac(abs(sin(($SEED) * 127.1 + ($KEY) * 311.7) * 43758.5453)) - 1)#
opcode Scatter, i, ii
  iseed, ikey xin
  xout $SCATTER(iseed'ikey)
endop

; Seconds until a sound of peak ilevel that falls by 60 dB in it60 lies below -100 dBFS.
#define DURATION(LEVEL'T60) #(0.08 + ($T60) * limit(100 + 20 * log10($LEVEL), 20, 120) / 60)#
opcode Duration, i, ii
  ilevel, it60 xin
  xout $DURATION(ilevel'it60)
endop

opcode Put_mode, 0, iiiii
  index, ifrequency, it60, iweight, idrive xin
  tabw_i ifrequency, 4 * index, giModes
  tabw_i it60, 4 * index + 1, giModes
  tabw_i iweight, 4 * index + 2, giModes
  tabw_i idrive, 4 * index + 3, giModes
endop

; What every stroke begins with; p-fields of hardness and of the first of variation, tip_radius_m, tip_mass_kg, tip_young_pa.
; aforce: the contact's, at most 1, of area iarea [samples]; acontact: the sound of the contact itself, as the stick's jolt grows with
; v^(6/5) / T, so with v^(7/5), by v^(2/5) faster than the modes do.
#define STROKE(HARDNESS'VARIATION'RADIUS'MASS'YOUNG) #
  iseed = $SEED($VARIATION'p4'p12)
  ilouder = $SCATTER(iseed'1)
  iaside = $SCATTER(iseed'2)
  iplace = limit(p8 + 0.05 * $VARIATION * iaside, 0, 1)
  ispeed = p7
  ilevel = $LEVEL(ispeed)
  ilevel = ilevel * ampdb(0.8 * $VARIATION * ilouder)
  icontact = $CONTACT($HARDNESS'$RADIUS'$MASS'$YOUNG'ispeed)
  iarea = 2 / $M_PI * icontact * sr
  ktime timeinstk
  if ktime < 0.15 * kr then
    aforce contact_force icontact
    arough noise_burst iseed + 0.1 * iplace + 0.01 * ispeed, 0.0001, 0.1
    acontact butterlp aforce * (0.3 + arough) * (limit(ispeed, 0.02, 16) / 8)^0.4, limit(8 / icontact, 1000, 16000)
  else
    aforce = 0
    acontact = 0
  endif
  asilence init 0
#

; Ends a note of these two sounds, mid and side (at level 1; ilevel, iduration, iwidth): close_note fades to 0 over its last 50 ms, choked, within 15 ms
; from the very sample, and pans, the partials up to iwidth to both sides; table 902 gets the note's end.
#define CLOSE_RINGING(MID'SIDE'RING'LONGEST) #
  p3 = iduration * $LONGEST
  aleft, aright, kover close_note $MID, $SIDE, ilevel * p5, ilevel * p6, iwidth, iduration, p4, p10, p11, giChokes, giEnds, $RING
  outs aleft, aright
  isend tab_i p10, giSends
  if isend != 0 then
    outch 3, isend * aleft, 4, isend * aright
  endif
  if kover == 1 then
    turnoff
  endif
#

; The same for sounds whose decay is their own: a pedal damps them here, outside the instrument.
#define CLOSE #
  adamped pedal_gain p10, giDecays
  adampedmid = amid * adamped
  adampedside = aside * adamped
  $CLOSE_RINGING(adampedmid'adampedside'1'1)
#

; The same in orchestras of one's own, where $CLOSE means it: a note lasts at most a minute.
#define OWN_CLOSE #
  iduration = min(iduration, 60)
  $CLOSE
#

; Puts the membrane's 32 modes, struck at radius iradius of 1, with a second head two more; gives their number, the roots of the sums
; of their squared amplitudes, after the contact's force and after the drive, and the root mean square of their wave numbers
; (of the lowest mode's), weighted by the force's.
; Frequencies in air: a mode of wave number k = root / a moves 2 rho / k of air an area with it (Fletcher and Rossing, chapters 3
; and 18), so f falls by 1 / sqrt(1 + air_load / root). A second head: air and shell couple the heads, (0,1) splits by 1.81,
; (1,1) by 1.23 (Rossing, Bork, Zhao and Fystrom, Acoustics of snare drums, JASA 92, 1992).
; Losses: of the material, growing with frequency, and by radiation, as a monopole for m = 0, a dipole for m = 1, then hardly (Christian
; et al. 1984). So (0,1) dies first of the low ones.
opcode Put_membrane, iiii, iiiiiiiiii
  ifrequency, it60, idamping, icontact, ikettle, iradius, iair_load, isecond, iseed, ivariation xin
  index = 0
  icount = 0
  isquares = 0
  idrives = 0
  icurved = 0
  ilowest = sqrt(1 + iair_load / 2.404826) / 2.404826
  iratio11 = (3.831706 / sqrt(1 + iair_load / 3.831706) * ilowest)^(1 - ikettle)
  while index < 32 do
    iroot tab_i index, giRoots
    im tab_i index, giDiameters
    iair tab_i index, giKettle
    ifree = iroot / sqrt(1 + iair_load / iroot) * ilowest
    iratio = ifree^(1 - ikettle) * iair^ikettle
    icircles tab_i index, giCircles
    iradiates = (im == 0 ? 2.2 : (im == 1 ? 0.25 : 0)) / icircles
    ishape bessel im, iroot * iradius
    inorm bessel im + 1, iroot
    iodd Scatter iseed, 10 + index
    ireaches Reaches ifrequency * iratio, icontact
    ; A kettledrum's axisymmetric modes are weak, and short as above.
    ; Signs alternate: what one side of a nodal line sends, the other takes back, and the modes do not meet in a click.
    iweight = abs(ishape / inorm) * iratio^(-0.25) * (im == 0 ? 0.35^ikettle : 1) * (1 + 0.2 * ivariation * iodd) * (index % 2 == 0 ? 1 : -1)
    imode_t60 = it60 * 1.25 / ((iratio / iratio11)^idamping + iradiates)
    isplit = (isecond > 0 && index == 0 ? 0.81 : (isecond > 0 && index == 1 ? 0.23 : 0)) * isecond
    ihigh = (iratio / 4)^2
    iother Scatter 0.37, index
    idrive = iother * ihigh / (1 + ihigh)
    Put_mode icount, ifrequency * iratio, imode_t60, iweight, idrive
    icount += 1
    if isplit > 0 then
      Put_mode icount, ifrequency * iratio * (1 + isplit), imode_t60, 0.6 * isecond * iweight, 0
      icount += 1
    endif
    isquare = (iweight * ireaches)^2 * (1 + (isplit > 0 ? 0.36 * isecond * isecond : 0))
    isquares += isquare
    icurved += isquare * (iroot / 2.404826)^2
    idrives += idrive * idrive
    index += 1
  od
  xout icount, sqrt(isquares), sqrt(idrives), sqrt(icurved / isquares)
endop

; Zone 0: head. Zone 1: rim shot (the head near its edge, less of it, with rim and shell).
instr drum
  $STROKE(p15'p25'p26'p27'p28)
  kring, ilongest pedal_ring p10, p13, giDecays
  irim = (p9 >= 1 ? 1 : 0)
  isnare = p20
  iwidth = 0
  ; The pitch follows the membrane's tension, which grows with the stroke.
  kfall expon 1, p17, exp(-1)
  kbend = cent(p16 * limit(ispeed, 0, 16) / 8 * kfall)
  icount, inorm, idriven, iwaves Put_membrane p12, p13, p14, icontact, p18, 0.04 + 0.8 * (irim == 1 ? 1 : iplace), p23, p24, iseed, p25
  iscale = (irim == 1 ? 0.16 : 0.36) / (inorm * iarea)
  ; The same stretching hands motion of the low modes on to the high ones, in hard strokes only (Avanzini and Marogna, A modular
  ; physically based approach to the sound synthesis of membrane percussion instruments, 2010; Bilbao 2012): a drive within some ms;
  ; see instr cymbal. A change of tension dT pushes a mode of wave number k and amplitude a with dT k^2 a, that is dT k times its
  ; speed, so the drive is to the stroke's own motion as the bend times the wave numbers' root mean square: near the rim, where a
  ; stroke moves shorter waves, it is larger. What is handed on is taken from the low modes: the energy stays, of which this drive gets
  ; about 0.25 istretch^2 against 1.
  istretch = limit(1.8 * p16 / 100 * (limit(ispeed, 0, 16) / 8)^1.5 * iwaves, 0, 4)
  iscale = iscale / sqrt(1 + 0.25 * istretch * istretch)
  idrive_rms = sqrt(sr * (0.004 / 3 + 0.05 / 13.8) / 3)
  if ktime < 0.15 * kr then
    adrive noise_burst iseed + 0.75 + 0.1 * iplace, 0.004, 0.05
    adrive = adrive * istretch * inorm * iarea / (idriven * idrive_rms) * iscale
    ahead = aforce * iscale
  else
    adrive = 0
    ahead = 0
  endif
  amid, aside modal_bank ahead, adrive, kbend, giModes, icount, 1e-6 / ilevel, kring
  if ktime < 0.15 * kr then
    amid = amid + acontact * p19 * 1.7
  endif
  if isnare > 0 then
    ; The wires leave the head where it moves faster than their tension lets them follow, and rattle until they lie on it again
    ; (Rossing et al. 1992; Bilbao, Time domain simulation and sound synthesis for the snare drum, JASA 131, 2012): noise that follows
    ; the head's motion above a threshold.
    alift limit abs(amid) * ilevel - 0.0006, 0, 10
    arattle follow2 alift / ilevel, 0.001, p21 * 2 / 3
    awires noise_burst iseed + 0.5 + 0.1 * iplace, 0.0005, 1000
    awires butterhp awires, 900
    awires butterlp awires, 13000
    amid = amid + awires * arattle * isnare * 1.3
  endif
  if irim == 1 then
    ireach Reaches p22, icontact
    Put_mode 0, p22, 0.09, 0.22, 0
    Put_mode 1, p22 * 1.72, 0.07, -0.16, 0
    Put_mode 2, p22 * 2.61, 0.05, 0.15, 0
    arim, asiderim modal_bank aforce / (iarea * ireach), asilence, 1, giModes, 3, 1e-6 / ilevel
    amid = amid + arim
  endif
  iduration = $DURATION(ilevel'max(p13, (isnare > 0 ? p21 : 0), 0.1))
  $CLOSE_RINGING(amid'aside'kring'ilongest)
endin

; Puts the partials of set iset; place 1 brings out the high ones. With iwarble each is two modes that far apart.
; Gives the number of modes and the root of the sum of their squared amplitudes.
opcode Put_partials, ii, iiiiiiiii
  iset, ifrequency, it60, idamping, icontact, iplace, iwarble, iseed, ivariation xin
  index = 0
  icount = 0
  isquares = 0
  while index < 10 do
    iratio tab_i iset * 10 + index, giRatios
    iweight tab_i iset * 10 + index, giWeights
    ilasting tab_i iset * 10 + index, giLasting
    iat = ifrequency * iratio
    if iweight > 0 then
      iodd Scatter iseed, 10 + index
      ireaches Reaches iat, icontact
      iweight = iweight * iratio^(0.6 * iplace - 0.2) * (1 + 0.15 * ivariation * iodd)
      isquares += (iweight * ireaches)^2
      ipartial_t60 = it60 * ilasting * limit(iratio / (iset == 0 ? 0.5 : 1), 1, 100)^(-idamping)
      Put_mode icount, max(iat - iwarble / 2, 1), ipartial_t60, (iwarble > 0 ? 0.5 : 1) * iweight, 0
      icount += 1
      if iwarble > 0 then
        Put_mode icount, iat + iwarble / 2, ipartial_t60, 0.45 * iweight, 0
        icount += 1
      endif
    endif
    index += 1
  od
  xout icount, sqrt(isquares)
endop

; Zone 0: body. Zone 1: shoulder (brighter, as place 1, and half as loud).
instr bell
  $STROKE(p16'p20'p21'p22'p23)
  kring, ilongest pedal_ring p10, p13, giDecays
  ishoulder = (p9 >= 1 ? 1 : 0)
  iplace = (ishoulder == 1 ? 1 : iplace)
  iwidth = p19
  icount, inorm Put_partials int(p14 + 0.5), p12, p13, p15, icontact, iplace, p17, iseed, p20
  iscale = 0.48 / (inorm * iarea) * (ishoulder == 1 ? 0.6 : 1)
  amid, aside modal_bank aforce * iscale, asilence, 1, giModes, icount, 1e-6 / ilevel, kring
  if ktime < 0.15 * kr then
    amid = amid + acontact * p18
  endif
  iduration = $DURATION(ilevel'max(p13, 0.05))
  $CLOSE_RINGING(amid'aside'kring'ilongest)
endin

; Puts icount partials of a stiff string struck at ipoint of its length: weight sin(n pi ipoint), the comb of the struck
; place. Gives the root of the sum of their squared amplitudes.
opcode Put_string, i, iiiiiiiiii
  icount, ifrequency, it60, idamping, icontact, iinharmonicity, ipoint, ipluck, iseed, ivariation xin
  index = 1
  isquares = 0
  while index <= icount do
    iat = index * ifrequency * sqrt((1 + iinharmonicity * index * index) / (1 + iinharmonicity))
    iodd Scatter iseed, 10 + index
    ireaches Reaches iat, icontact
    iweight = sin(index * $M_PI * ipoint) * index^(-0.3 - ipluck) * (1 + 0.15 * ivariation * iodd)
    isquares += (iweight * ireaches)^2
    Put_mode index - 1, iat, it60 * index^(-idamping), iweight, 0
    index += 1
  od
  xout sqrt(isquares)
endop

; place 1 strikes a fifth as far from the bridge as place 0. All zones sound alike.
instr string
  $STROKE(p15'p21'p22'p23'p24)
  kring, ilongest pedal_ring p10, p13, giDecays
  iwidth = p20
  icount = limit(int(12000 / p12), 1, 32)
  inorm Put_string icount, p12, p13, p14, icontact, p16, p17 * (1 - 0.8 * iplace), p18, iseed, p21
  iscale = 0.355 / (inorm * iarea)
  amid, aside modal_bank aforce * iscale, asilence, 1, giModes, icount, 1e-6 / ilevel, kring
  if ktime < 0.15 * kr then
    amid = amid + acontact * p19
  endif
  iduration = $DURATION(ilevel'max(p13, 0.05))
  $CLOSE_RINGING(amid'aside'kring'ilongest)
endin

; Puts 448 plate modes: a thin plate has as many modes in one band of a given width as in another (Weyl's law for plates; Fletcher and
; Rossing, chapter 3), here placed evenly in frequency with the irregularity of each cymbal's own (Scatter of its lowest partial), and
; with shapes at the struck point of either sign. The cup rings on every fifth one. Gives the root of the sum of the squared weights,
; for the contact's force and for the drive. Macros, since each call of an opcode definition takes as long as the rest of a mode.
opcode Put_plate, ii, iiiiiiiii
  ifrequency, ihighest, it60, idamping, icontact, iplace, icup, iseed, ivariation xin
  index = 0
  isquares = 0
  idrives = 0
  istep = (ihighest - ifrequency) / 447
  while index < 448 do
    iirregular = $SCATTER(ifrequency * 0.00137'index)
    ishape = $SCATTER(ifrequency * 0.00253'index + 500)
    iother = $SCATTER(ifrequency * 0.00317'index + 1000)
    iodd = 0.3 * ivariation * $SCATTER(iseed'10 + index)
    iat = ifrequency + istep * (index + (index > 0 ? 0.45 * iirregular : 0))
    ix = 2 * iat * icontact
    iweight = (ishape + iodd) * (iat / ifrequency)^(0.3 * iplace - 0.1) * (icup == 1 && index % 5 != 2 ? 0.15 : 1)
    ihigh = (iat / 4000)^2
    idrive = (iother + iodd) * ihigh / (1 + ihigh) / (1 + (iat / 15000)^4)
    isquares += iweight * iweight / (1 + ix^4)
    idrives += idrive * idrive
    tabw_i iat, 4 * index, giModes
    tabw_i it60 * (1000 / iat)^idamping, 4 * index + 1, giModes
    tabw_i iweight, 4 * index + 2, giModes
    tabw_i idrive, 4 * index + 3, giModes
    index += 1
  od
  xout sqrt(isquares), sqrt(idrives)
endop

; Zone 0: bow and edge. Zone 1: cup (clearer, less noise).
; In large motion a cymbal's energy cascades from the low modes, which the stick reaches, to the high ones within tens of milliseconds,
; more with a harder stroke (Rossing and Shepherd, Acoustics of cymbals, 1983; Touze and Chaigne, Lyapunov exponents from experimental
; time series: application to cymbal vibrations, 2000; Ducceschi and Touze, Modal approach for nonlinear vibrations of damped impacted
; plates, JSV 344, 2015). Here the high modes are driven by noise that rises in build_s, and answer as the resonators that they are.
instr cymbal
  $STROKE(p15'p21'p22'p23'p24)
  kring, ilongest pedal_ring p10, p13, giDecays
  icup = (p9 >= 1 ? 1 : 0)
  it60 = p13
  idamping = p14
  iwidth = p20
  ibuild = p17
  icascade = limit(p16 * (icup == 1 ? 0.25 : 1) * (limit(ispeed, 0.05, 16) / 8)^0.35, 0, 1)
  ihighest = limit(p12 * 50^p18, 2 * p12, 18000)
  idirect, idriven Put_plate p12, ihighest, it60, idamping, icontact, iplace, icup, iseed, p21
  iforce = 0.36 * (1 - 0.8 * icascade) / (idirect * iarea)
  ; The drive's root mean square, 1/sqrt(3), over its length: rise / 3 + T60 / 13.8.
  idrive_t60 = 5 * ibuild
  irandom = sqrt(sr * (ibuild / 3 + idrive_t60 / 13.8) / 3)
  idrive = 0.3 * icascade / (idriven * irandom)
  if ktime < (7 * ibuild + 0.01) * kr then
    adrive noise_burst iseed + 0.25 + 0.1 * iplace, ibuild, idrive_t60
    adrive = adrive * idrive
  else
    adrive = 0
  endif
  amid, aside modal_bank aforce * iforce, adrive, 1, giModes, 448, 1e-6 / ilevel, kring
  if ktime < 0.15 * kr then
    amid = amid + acontact * p19
  endif
  iduration = $DURATION(ilevel'max(it60 * (1000 / limit(p12, 60, 1000))^idamping, 0.05))
  $CLOSE_RINGING(amid'aside'kring'ilongest)
endin
