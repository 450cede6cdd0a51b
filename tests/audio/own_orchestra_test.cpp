#include "audio/own_orchestra.h"

#include <vector>

#include "audio/samples.h"
#include "rendering.h"
#include "sample_folder.h"

namespace {

const std::vector<std::string> kTaken = {"drum", "bell", "string", "cymbal", "sample"};

std::string fault(const std::string& text) {
    try {
        audio::check_own_orchestra(text, "mine.orc", kTaken);
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
                                   "Sx pwd"}) {
        const std::string found = fault("instr gong\n" + line + "\nendin\n");
        EXPECT_EQ(found.find("mine.orc:2:"), 0u) << line << ": " << found;
        EXPECT_NE(found.find("error: found "), std::string::npos) << found;
    }
}

TEST(CheckedOrchestra, WhatSoundsIsAllowed) {
    EXPECT_EQ(
        fault("; system \"in a comment\" \xc3\xa9\n/* fout\n#define */\ngiT ftgen 0, 0, 1024, 10, 1, 0.5\n"
              "instr gong\n$BLOW\n$BURST(one'p8'0.0002'0.02)\nasound = ablow + aone\nilevel = 1\n"
              "iduration = (p12 > 2 ? p12 : 2)\n$CLOSE\nendin\n"),
        "");
}

}  // namespace
