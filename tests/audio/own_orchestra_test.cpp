#include "audio/own_orchestra.h"

#include <vector>

#include "audio/samples.h"
#include "rendering.h"
#include "sample_folder.h"

namespace {

const std::vector<std::string> kTaken = {"drum", "bell", "string", "cymbal", "sample"};

std::string fault(const std::string& text) {
    try {
        (void)audio::checked_own_orchestra(text, "mine.orc", kTaken);
    } catch (const audio::SampleError& wrong) {
        return wrong.what();
    }
    return "";
}

TEST(CheckedOrchestra, WhatReachesBeyondTheSoundIsRefusedAtItsPlace) {
    for (const std::string line : {"ires system_i 1, \"rm -rf /\"",
                                   "system 1, Scommand",
                                   "a1 diskin2 3",
                                   "fout 1, 2, a1",
                                   "a1 soundin 2",
                                   "gi ftgen 0, 0, 0, 1, 3, 0, 0, 0",
                                   "gi ftgen 0, 0, 0, -1, 3, 0, 0, 0",
                                   "gi ftgen 0, 0, 0, ix, 3, 0, 0, 0",
                                   "gi = ftgen(0, 0, 0, 23, 3)",
                                   "exitnow",
                                   "#include \"/etc/passwd\"",
                                   "#define S #system#",
                                   "k1 $SYS.tem 1",
                                   "OSCsend 1, 2, 3",
                                   "ires compilestr 3",
                                   "k1 {{ x }}",
                                   "socksend a1, 3, 4, 5",
                                   "remoteport 40000",
                                   "prints \"hello\"",
                                   "sr = 44100",
                                   "ksmps = 1",
                                   "0dbfs = 32768",
                                   "instr drum",
                                   "instr 1",
                                   "instr gong, sample",
                                   "ihandle fiopen 3, 1",
                                   "Sx pwd",
                                   "Sx nstrstr nstrnum(1)",
                                   "iX ftgentmp ftgen:i(0,0,0,1,3,0,0,0), 0, 1024, 10, 1",
                                   "iX ftgen 901, 0, -2, -2, 0",
                                   "ftfree 901, 0",
                                   "tabw_i 1, 5000, 930",
                                   "giModes = 1",
                                   "opcode Level, i, i",
                                   "seed 0",
                                   "kX rand 1, 2",
                                   "kX sensekey",
                                   "event_i 3",
                                   "aX (1",
                                   "a1 = 1) + (2",
                                   "$STROKE(0'0'0'0'system(1))",
                                   "goto end"}) {
        const std::string found = fault("instr gong\n" + line + "\nendin\n");
        EXPECT_EQ(found.find("mine.orc:2:"), 0u) << line << ": " << found;
        EXPECT_NE(found.find("error: found "), std::string::npos) << found;
    }
}

TEST(CheckedOrchestra, WhatSoundsIsAllowedAndItsCommentsDoNotReachCsound) {
    EXPECT_EQ(audio::checked_own_orchestra(
                  ";@ gong frequency_hz 100 20 2000 pitch \xc3\xa9\r; system \"in a comment\" \xc3\xa9\xff\n"
                  "/* fout\n#define */\ninstr gong ; x\rsystem 1\n"
                  "$STROKE(0'0'0'0'/*'system_i(1, 2)*/1e10)\n;@ no line of a parameter\n"
                  "amid reson aforce, p12, 5\naside = 0\niduration = (p12 > 2 ? p12 : 2.5)\n$CLOSE\nendin\n",
                  "mine.orc", kTaken),
              ";@ gong frequency_hz 100 20 2000 pitch    ; system  in a comment     \n"
              " \n \ninstr gong \n"
              "$STROKE(0'0'0'0' 1e10)\n\n"
              "amid reson aforce, p12, 5\naside = 0\niduration = (p12 > 2 ? p12 : 2.5)\n$OWN_CLOSE\nendin\n");
}

}  // namespace
