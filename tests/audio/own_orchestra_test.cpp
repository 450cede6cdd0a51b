#include "audio/own_orchestra.h"

#include <algorithm>
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

TEST(CheckedOrchestra, FaultsAreOneLineOfPlainTextWhateverByteStandsWhere) {
    const std::string line = "aX vcomb aIn, (p4 + 1), 1, 0.1, 1";
    for (std::size_t at = 0; at <= line.size(); ++at)
        for (int byte = 0; byte < 256; ++byte) {
            std::string text = "instr gong\n" + line + "\nendin\n";
            text.insert(11 + at, 1, static_cast<char>(byte));
            try {
                (void)audio::checked_own_orchestra(text, "mine.orc", kTaken);
            } catch (const audio::SampleError& fault) {
                EXPECT_TRUE(std::ranges::all_of(std::string_view(fault.what()),
                                                [](char c) { return c >= 0x20 && c < 0x7f; }))
                    << "byte " << byte << " at " << at << ": " << fault.what();
            }
        }
}

/// 1e9 s of delay are 400 TB a note.
TEST(CheckedOrchestra, WhatSetsAnOpcodesMemoryIsBounded) {
    const auto checked = [](const std::string& line) {
        return audio::checked_own_orchestra("instr gong\n" + line + "\nendin\n", "mine.orc", kTaken);
    };
    EXPECT_EQ(checked("aX delay aIn, 1e9"), "instr gong\naX delay aIn, limit( 1e9, 0, 10)\nendin\n");
    EXPECT_EQ(checked("aX vcomb aIn, min(1, 2), kT, iMost, 1"),
              "instr gong\naX vcomb aIn, min(1, 2), kT, limit( iMost, 0, 10), 1\nendin\n");
    EXPECT_EQ(checked("aX pluck 1, 100, 1/1e9, 0, 1"),
              "instr gong\naX pluck 1, 100, limit( 1/abs(1e9), 0.1, 1e6), 0, 1\nendin\n");
    for (const std::string line :
         {"aX = delay(aIn, 1e9)", "aX = 1 + delay:a(aIn, 1e9)", "aX delay (aIn), 1e9", "aX delay(aIn), 1e9",
          "aX delay -aIn, 1e9", "delay aIn, 1"})
        EXPECT_EQ(fault("instr gong\n" + line + "\nendin\n").find("mine.orc:2:"), 0u) << line;
    std::string many = "instr gong\n", instruments;
    for (int i = 0; i < 65; ++i) many += "aX delay aIn, 1\n";
    EXPECT_NE(fault(many + "endin\n").find("mine.orc:66:4: error: found more than 64"), std::string::npos);
    for (int i = 0; i < 257; ++i) instruments += "instr i" + std::to_string(i) + "\nendin\n";
    EXPECT_NE(fault(instruments).find("mine.orc:513:1: error: found more than 256"), std::string::npos);
}

TEST(CheckedOrchestra, WhatIsBoundedCompiles) {
    const SampleFolder folder;
    const auto file =
        folder.text("mine.orc",
                    "instr gong\n$STROKE(0.4'0'0.01'0.05'1e9)\niLong = 1e9\n"
                    "aA delay aforce, iLong\naB comb aA, 1, 0.02\naC alpass aB, 1, iLong * 2, 0\n"
                    "aD vcomb aC, 1, 0.01, (iLong > 2 ? 3 : 4)\naE valpass aD, 1, 0.01, 1\n"
                    "aF vco 1, 100, 1, 0.5, 1, iLong\naG pluck 1, 100, 1 / iLong, 0, 1\n"
                    "aH wgbow 1, 100, 3, 0.1, 0, 0, 1, 1e-9\naI tonex aE, 100, iLong\n"
                    "aJ atonex aI, 100, 2\namid resonx aJ, 100, 10, iLong\n"
                    "aside = 0\niwidth = 0\niduration = 1\n$CLOSE\nendin\n");
    EXPECT_NO_THROW(audio::check_own_orchestra(rendering::kOrchestra, file));
}

/// Csound crashes where it computes an infinite number when it compiles, and where a line is endless.
TEST(CheckedOrchestra, NumbersThatCannotBeAndEndlessLinesDoNotReachCsound) {
    EXPECT_EQ(audio::checked_own_orchestra("instr gong\niA = 1/0 + (2) - exp(3) ^ $M_PI/1e-9\niB = -4 > 5 ? "
                                           "p12 * 6 : limit(7, 8, 9)\nendin\n",
                                           "mine.orc", kTaken),
              "instr gong\niA = 1/abs(0) + (abs(2)) - exp(3) ^ abs($M_PI)/abs(1e-9)\n"
              "iB = -abs(4) > 5 ? p12 * abs(6) : limit(7, 8, 9)\nendin\n");
    const SampleFolder folder;
    for (const std::string value :
         {"1/0", "(1)/(0)", "0^(-1)", "1e308*10", "1e308+1e308", "2^9999", "-(0/0)", "1 / (1 - 1)",
          "-(1e309-1e309)", "1/!1", "exp(1/0)", "abs(0/0)", "$M_PI / 0"}) {
        const auto file = folder.text(
            "mine.orc",
            "instr gong\n$STROKE(0.4'0'0.01'0.05'1e9)\niA = " + value +
                "\namid mode 0.02 * aforce, 440, 400\naside = 0\niwidth = 0\niduration = 1\n$CLOSE\nendin\n");
        try {
            audio::check_own_orchestra(rendering::kOrchestra, file);
        } catch (const audio::SampleError& refused) {
            EXPECT_NE(std::string(refused.what()).find("mine.orc:3:"), std::string::npos) << refused.what();
        }
    }
    std::string sum = "iA = 1";
    for (int i = 0; i < 3000; ++i) sum += "+1";
    EXPECT_EQ(fault("instr gong\n" + sum + "\nendin\n").find("mine.orc:2:4097: error: found more than 4096"),
              0u);
    std::string chain = "instr gong\nif p12 > 1 then\n";
    for (int i = 0; i < 1001; ++i) chain += "elseif p12 > 2 then\n";
    EXPECT_EQ(fault(chain + "endif\nendin\n").find("mine.orc:1003:1: error: found more than 1000 elseif"),
              0u);
}

TEST(CheckedOrchestra, WhatIsDeclaredOrBegunIsThereOrEnds) {
    EXPECT_EQ(fault("instr gong\nendin\n;@ gong f 1 0 2 pitch\n\n;@ tam f 1 0 2 pitch\n"),
              "mine.orc:5:1: error: found parameters of tam, expected instr tam in the file");
    EXPECT_EQ(fault("instr gong\nendin\n/* instr tam\nendin\n"),
              "mine.orc:5:1: error: found the end of the file, expected */");
    EXPECT_EQ(fault("instr gong\nendin\n;@\n;@ drum f 1 0 2 of the bundled one\n"), "");
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
              "$STROKE(abs(0)'abs(0)'abs(0)'abs(0)' abs(1e10))\n\n"
              "amid reson aforce, p12, 5\naside = 0\niduration = (p12 > 2 ? p12 : 2.5)\n$OWN_CLOSE\nendin\n");
}

}  // namespace
