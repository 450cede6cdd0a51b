#include <audio/own_orchestra.h>
#include <audio/performance.h>
#include <audio/samples.h>
#include <gtest/gtest.h>
#include <render/mesh.h>
#include <sndfile.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <map>
#include <set>

#include "audio/written_sound_font.h"
#include "files/bad_input.h"
#include "kit/kit.h"
#include "kit/kit_copy.h"
#include "play/audition.h"
#include "temporary_folder.h"

// A kit of every kind of file, each of them spoilt in turn: what is wrong is said in one line, at its place.

namespace app {
namespace {

namespace fs = std::filesystem;

constexpr const char* kKit = R"(name = "all"
[[instrument]]
name = "a"
kind = "drum"
size = [0.3, 0.1, 0.3]
position = [0, 0.7, -0.4]
shape = "mesh"
mesh = "mesh.obj"
midi_note = 38
sound = { samples = "set.sfz", keyswitch = 24 }
[[instrument]]
name = "b"
kind = "drum"
size = [0.3, 0.1, 0.3]
position = [0.4, 0.7, -0.4]
sound = { samples = "font.sf2" }
[[instrument]]
name = "c"
kind = "drum"
size = [0.3, 0.1, 0.3]
position = [0.8, 0.7, -0.4]
sound = { samples = "gizmo.xml" }
[[instrument]]
name = "d"
kind = "drum"
size = [0.3, 0.1, 0.3]
position = [1.2, 0.7, -0.4]
sound = { samples = "hit.flac" }
[[instrument]]
name = "e"
kind = "bell"
size = [0.3, 0.1, 0.3]
position = [-0.4, 0.7, -0.4]
sound = { orchestra = "mine.orc", instrument = "gong", frequency_hz = 90 }
)";
constexpr const char* kObj = R"(v -1 -1 -1
v 1 -1 -1
v 1 1 -1
v -1 1 -1
v -1 -1 1
v 1 -1 1
v 1 1 1
v -1 1 1
vn 0 0 -1
vn 0 0 1
vn 0 -1 0
vn 0 1 0
vn -1 0 0
vn 1 0 0
usemtl shell
f 1//1 3//1 2//1
f 1//1 4//1 3//1
f 5//2 6//2 7//2
f 5//2 7//2 8//2
f 1//3 2//3 6//3
f 1//3 6//3 5//3
f 4//4 8//4 7//4
f 4//4 7//4 3//4
f 1//5 5//5 8//5
f 1//5 8//5 4//5
f 2//6 3//6 7//6
f 2//6 7//6 6//6
)";
constexpr const char* kSfz = R"(#define $KEY 38
<control> default_path=./
<global> sw_default=24
<group> key=$KEY seq_length=2 lovel=1 hivel=127
<region> sample=hit.wav seq_position=1 sw_last=24
<region> sample=hit.wav seq_position=2 sw_last=24 loop_mode=loop_continuous loop_start=10 loop_end=90 ampeg_decay=0.1 ampeg_sustain=0
)";
constexpr const char* kGizmo = R"(<?xml version="1.0"?>
<instrument version="2.0" name="snare"><samples>
<sample name="one" power="1"><audiofile channel="left" file="hit.wav" filechannel="1"/></sample>
</samples></instrument>
)";
constexpr const char* kOrchestra = R"(;@ gong frequency_hz 100 20 2000 pitch [Hz]

instr gong
  $STROKE(0.4'0'0.01'0.05'1e9)
  if p12 > 50 then
    amid mode 0.02 * aforce, p12, 400
  else
    amid mode 0.02 * aforce, p12, 200
  endif
  aside = 0
  iwidth = 0
  iduration = 3
  $CLOSE
endin
)";

std::string bytes_of(const fs::path& file) {
    std::ifstream stream(file, std::ios::binary);
    return {std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
}

std::string sound(const fs::path& file, int format, int channels = 1) {
    SF_INFO info{};
    info.samplerate = 48000, info.channels = channels, info.format = format;
    std::vector<float> wave;
    for (int i = 0; i < 4800 * channels; ++i)
        wave.push_back(0.5F * std::sin(0.05F * static_cast<float>(i * i % 97)));
    SNDFILE* written = sf_open(file.c_str(), SFM_WRITE, &info);
    EXPECT_NE(written, nullptr);
    sf_writef_float(written, wave.data(), 4800);
    sf_close(written);
    return bytes_of(file);
}

/// The files of a whole kit.
class AllFiles {
public:
    AllFiles() {
        const fs::path scratch = folder_.path() / "scratch";
        files_ = {{"kit.toml", kKit},
                  {"mesh.obj", kObj},
                  {"set.sfz", kSfz},
                  {"gizmo.xml", kGizmo},
                  {"mine.orc", kOrchestra},
                  {"hit.wav", sound(scratch, SF_FORMAT_WAV | SF_FORMAT_PCM_16)},
                  {"six.wav", sound(scratch, SF_FORMAT_WAV | SF_FORMAT_PCM_16, 6)},
                  {"float.wav", sound(scratch, SF_FORMAT_WAV | SF_FORMAT_FLOAT)},
                  {"hit.flac", sound(scratch, SF_FORMAT_FLAC | SF_FORMAT_PCM_16)},
                  {"font.sf2", WrittenSoundFont(std::vector<std::int16_t>(100, 1000),
                                                std::vector<std::int16_t>(100, 9000), 48000, 38)
                                   .bytes()}};
        fs::remove(scratch);
        for (const auto& [name, bytes] : files_) write(name, bytes);
    }
    [[nodiscard]] const std::string& whole(const std::string& name) const { return files_.at(name); }
    void write(const std::string& name, const std::string& bytes) const {
        std::ofstream(folder_.path() / name, std::ios::binary) << bytes;
    }
    [[nodiscard]] fs::path folder() const { return folder_.path(); }

    /// What `kit check` and `kit copy` do with it.
    [[nodiscard]] std::string fault() const {
        try {
            const Kit kit = read_kit(folder() / "kit.toml");
            for (const Instrument& instrument : kit.instruments) (void)render::load_mesh(instrument.mesh);
            check_own_orchestras(kit);
        } catch (const BadInput& wrong) {
            return wrong.what();
        } catch (const render::MeshError& wrong) {
            return wrong.what();
        } catch (const audio::SampleError& wrong) {
            return wrong.what();
        }
        return "";
    }

private:
    TemporaryFolder folder_;
    std::map<std::string, std::string> files_;
};

using Change = std::function<std::string(std::string)>;

/// Puts text in the place of the first such text.
Change put(const std::string& from, const std::string& to) {
    return [from, to](std::string text) {
        const std::size_t at = text.find(from);
        EXPECT_NE(at, std::string::npos) << from;
        return text.replace(at, from.size(), to);
    };
}
Change all(const std::string& text) {
    return [text](const std::string&) { return text; };
}
Change add(const std::string& text) {
    return [text](const std::string& whole) { return whole + text; };
}
Change cut(double share) {
    return [share](const std::string& whole) {
        return whole.substr(0, static_cast<std::size_t>(share * static_cast<double>(whole.size())));
    };
}
/// Bytes in the place of others, `skip` behind a mark.
Change at(const std::string& mark, std::size_t skip, const std::string& bytes) {
    return [=](std::string whole) {
        const std::size_t place = whole.find(mark);
        EXPECT_NE(place, std::string::npos) << mark;
        return whole.replace(place + mark.size() + skip, bytes.size(), bytes);
    };
}
std::string times(int count, const std::string& text) {
    std::string all;
    for (int i = 0; i < count; ++i) all += text;
    return all;
}
std::string word(int value) {
    return {static_cast<char>(value & 0xff), static_cast<char>(value >> 8 & 0xff)};
}
std::string dword(std::uint32_t value) {
    return word(static_cast<int>(value & 0xffff)) + word(static_cast<int>(value >> 16));
}

struct Spoilt {
    std::string file;  ///< that is spoilt
    Change change;
    std::string place;       ///< what the message begins with, behind the folder: file and perhaps line
    std::string found = "";  ///< part of it
};

/// Instruments of one kit more than there may be.
std::string crowd() {
    std::string text;
    for (int i = 0; i < 65; ++i)
        text += "[[instrument]]\nname = \"n" + std::to_string(i) +
                "\"\nkind = \"drum\"\nsize = [0.3, 0.1, 0.3]\nposition = [0, 1, 0]\n";
    return text;
}

std::vector<Spoilt> kits() {
    const auto kit = [](const std::string& from, const std::string& to, int line,
                        const std::string& found = "") {
        return Spoilt{"kit.toml", put(from, to), "kit.toml:" + std::to_string(line) + ":", found};
    };
    return {kit("\"all\"", "all", 1),
            kit("name = \"a\"", "name = \"a", 3),
            kit("name = \"a\"\n", "", 2, "name"),
            kit("name = \"a\"", "name = \"\"", 3),
            kit("name = \"b\"", "name = \"a\"", 11),
            kit("name = \"a\"", "name = \"a\\u0007\"", 3),
            kit("name = \"a\"", "name = \"\xff\xfe\"", 3),
            kit("name = \"a\"", std::string("name = \"\0\"", 10), 3),
            kit("kind = \"drum\"", "kind = \"gong\"", 4, "gong"),
            kit("kind = \"drum\"", "kind = 3", 4),
            kit("[0.3, 0.1, 0.3]", "[0.3, 0.1]", 5, "2 entries"),
            kit("[0.3, 0.1, 0.3]", "[0.3, 0.1, 0.3", 6),
            kit("[0.3, 0.1, 0.3]", "[0.3, -0.1, 0.3]", 5, "-0.1"),
            kit("[0.3, 0.1, 0.3]", "[nan, 0.1, 0.3]", 5, "nan"),
            kit("[0.3, 0.1, 0.3]", "[inf, 0.1, 0.3]", 5, "inf"),
            kit("[0.3, 0.1, 0.3]", "[1e9, 0.1, 0.3]", 5),
            kit("[0.3, 0.1, 0.3]", "\"large\"", 5, "large"),
            kit("size = ", "sizes = ", 5, "sizes"),
            kit("midi_note = 38", "midi_note = 128", 9, "128"),
            kit("midi_note = 38", "midi_note = 38.5", 9, "38.5"),
            kit("midi_note = 38", "midi_note = 38\nzones = [3]", 10),
            kit("midi_note = 38", "zones = [{ name = \"z\", radius = [1, 0] }]", 9),
            kit("midi_note = 38", "exponents = [0.1, 2.5]", 9, "2.5"),
            kit("midi_note = 38", "mesh_scale = 0", 9),
            kit("midi_note = 38", "mesh_scale = 100", 8, "0.001 to 10 m"),
            kit("\"mesh\"", "\"cube\"", 7, "cube"),
            kit("mesh.obj", "none.obj", 8, "none.obj"),
            kit("mesh.obj", ".", 8),
            kit("set.sfz", "none.sfz", 10, "none.sfz"),
            kit("keyswitch = 24", "keyswitch = 240", 10, "240"),
            kit("{ samples = \"font.sf2\" }", "3", 16),
            kit("frequency_hz = 90", "frequency_hz = 9", 34, "9"),
            kit("frequency_hz = 90", "frequency = 90", 34, "frequency"),
            kit("instrument = \"gong\"", "instrument = \"bong\"", 34, "bong"),
            kit("name = \"all\"", "include = [\"none.toml\"]", 1, "none.toml"),
            kit("name = \"all\"", "include = [3]", 1),
            kit("name = \"all\"", "remove = [\"z\"]", 1, "remove"),
            kit("name = \"all\"", times(30, "a.") + "b = 1", 1, "parts"),
            kit("name = \"all\"", "name = \"all\"\nname = \"all\"", 2),
            {"kit.toml", all(""), "kit.toml:1:1:", "no [[instrument]]"},
            {"kit.toml", all(crowd()), "kit.toml:1:1:", "65"}};
}

std::vector<Spoilt> meshes() {
    const auto obj = [](const std::string& from, const std::string& to, int line,
                        const std::string& found = "") {
        return Spoilt{"mesh.obj", put(from, to), "mesh.obj:" + (line > 0 ? std::to_string(line) + ":" : ""),
                      found};
    };
    std::vector<Spoilt> spoilt = {obj("v 1 -1 -1", "v nan -1 -1", 2),
                                  obj("v 1 -1 -1", "v 1e999 -1 -1", 2),
                                  obj("v 1 -1 -1", "v 1 -1", 2, "fewer"),
                                  obj("v 1 -1 -1", "v one -1 -1", 2, "one"),
                                  obj("v 1 -1 -1", "v 1e6 -1 -1", 2, "100000"),
                                  obj("vn 0 0 -1", "vn 0 0 0", 9, "length"),
                                  obj("f 1//1", "f 0//1", 16),
                                  obj("f 1//1", "f 9//1", 16),
                                  obj("f 1//1", "f 99999999999//1", 16),
                                  obj("f 1//1", "f 1//7", 16),
                                  {"mesh.obj", all(""), "mesh.obj:"},
                                  {"mesh.obj", all("v 0 0 0\nv 1 0 0\nv 0 1 0\n"), "mesh.obj:"},
                                  {"mesh.obj", all(std::string(200, '\xff')), "mesh.obj:"}};
    const std::string flat = "v -1 0 -1\nv 1 0 -1\nv 1 0 1\nvn 0 1 0\nusemtl shell\nf 1//1 2//1 3//1\n";
    spoilt.push_back({"mesh.obj", all(flat), "kit.toml:8:", "without volume"});
    return spoilt;
}

/// A kit of one instrument whose sound, or mesh, is another file.
std::vector<Spoilt> others() {
    std::vector<Spoilt> spoilt;
    for (const char* mesh : {"glTF\x02", "glTF"}) spoilt.push_back({"bad.glb", all(mesh), "bad.glb"});
    spoilt.push_back({"bad.gltf", all("{\"asset\":{\"version\":\"2.0\"}"), "bad.gltf"});
    spoilt.push_back({"bad.gltf", all(times(2000, "[")), "bad.gltf"});
    spoilt.push_back({"bad.stl", all("solid x\nfacet normal 0 0 1\nouter loop\nvertex 0 0"), "bad.stl"});
    spoilt.push_back({"bad.stl", all(std::string(80, ' ') + dword(0xffffffff)), "bad.stl"});
    spoilt.push_back({"bad.ply", all("ply\nformat ascii 1.0\n"), "bad.ply"});
    return spoilt;
}

std::vector<Spoilt> sounds() {
    const std::string place = "set.sfz:5:";  // where the wave is named
    return {{"hit.wav", all(""), place},
            {"hit.wav", all("no sound at all"), place},
            {"hit.wav", cut(0.5), place, "of 9600 bytes"},
            {"hit.wav", cut(0.001), place},
            {"hit.wav", put("WAVE", "EVAW"), place},
            {"hit.wav", put("fmt ", "tmf "), place},
            {"hit.wav", at("fmt ", 4, word(99)), place},
            {"hit.wav", at("fmt ", 6, word(0)), place},
            {"hit.wav", at("fmt ", 8, dword(0)), place},
            {"hit.wav", at("fmt ", 8, dword(900000)), place, "900000"},
            {"hit.wav", at("data", 0, dword(0)), place},
            {"hit.flac", all(""), "hit.flac"},
            {"hit.flac", put("fLaC", "fLaX"), "hit.flac"},
            {"hit.flac", cut(0.5), "hit.flac", "4800 frames"},
            {"hit.flac", cut(0.002), "hit.flac"}};
}

std::vector<Spoilt> sfz() {
    const auto file = [](const std::string& from, const std::string& to, int line,
                         const std::string& found = "") {
        return Spoilt{"set.sfz", put(from, to), "set.sfz:" + std::to_string(line) + ":", found};
    };
    return {file("<region>", "<region", 5),
            file("seq_position=1", "seq_position", 5),
            file("seq_position=1", "seq_position=3", 5, "seq_position=3"),
            file("seq_length=2", "seq_length=0", 4, "seq_length=0"),
            file("key=$KEY", "key=300", 4, "key=300"),
            file("key=$KEY", "key=h4", 4, "key=h4"),
            file("key=$KEY", "key=$NONE", 4, "$NONE"),
            file("lovel=1", "lovel=128", 4, "lovel=128"),
            file("lovel=1 hivel=127", "lovel=9 hivel=8", 5),
            file("lovel=1", "tune=1e9", 4, "tune"),
            file("lovel=1", "volume=nan", 4, "volume=nan"),
            file("lovel=1", "offset=1.5", 4, "offset=1.5"),
            file("lovel=1", "offset=5000", 5, "offset 5000"),
            file("hit.wav", "*sine", 5, "*sine"),
            file("hit.wav", "none.wav", 5, "none.wav"),
            file("sample=hit.wav ", "", 5, "without sample"),
            file("hit.wav", "../../../../../../etc/passwd", 5),
            file("hit.wav", "six.wav", 5, "6 channels"),
            file("loop_continuous", "often", 6, "often"),
            file("loop_start=10", "loop_start=91", 6, "loop_start=91"),
            file("loop_end=90", "loop_end=9000", 6, "loop"),
            file("sw_last=24", "sw_lolast=24", 5, "sw_lolast"),
            file("sw_default=24", "sw_default=c99", 3, "c99"),
            file("#define $KEY 38", "#define $KEY", 1),
            file("#define $KEY 38", "#include \"none.txt\"", 1, "none.txt"),
            file("#define $KEY 38", "#define $KEY 38\n#include \"set.sfz\"", 2),
            {"set.sfz", all(""), "set.sfz:1:1:", "no <region>"},
            {"set.sfz", all("<region> key=39 sample=hit.wav sw_last=24"), "set.sfz:1:1:", "MIDI note 38"},
            {"set.sfz", all("<region> key=38 sample=hit.wav sw_last=25"), "set.sfz:1:1:", "sw_last=24"},
            {"set.sfz", add(times(5000, "<region> sample=hit.wav\n")), "set.sfz:", "4096"}};
}

std::vector<Spoilt> fonts() {
    const auto font = [](Change change, const std::string& found = "") {
        return Spoilt{"font.sf2", std::move(change), "font.sf2", found};
    };
    std::vector<Spoilt> spoilt = {font(all("")),
                                  font(put("RIFF", "RIFX")),
                                  font(put("sfbk", "sfbl")),
                                  font(cut(0.5), "chunk"),
                                  font(at("phdr", 0, dword(0xffffffff)), "chunk"),
                                  font(at("pgen", 4 + 2, word(7)), "instrument 7"),
                                  font(at("ibag", 4 + 4, word(999)), "out of range"),
                                  font(at("phdr", 4 + 24, word(999)), "out of range"),
                                  font(at("shdr", 4 + 20, dword(5000)), "sample"),
                                  font(at("shdr", 4 + 24, dword(5000000)), "sample"),
                                  font(at("shdr", 4 + 36, dword(0)), "0 Hz"),
                                  font(at("igen", 4 + 8 + 2, word(77)), "sample 77")};
    for (const char* table : {"phdr", "pbag", "pgen", "inst", "ibag", "igen", "shdr"})
        spoilt.push_back(font(put(table, "none"), table));
    return spoilt;
}

std::vector<Spoilt> gizmos() {
    const auto file = [](const std::string& from, const std::string& to,
                         const std::string& place = "gizmo.xml") {
        return Spoilt{"gizmo.xml", put(from, to), place};
    };
    return {{"gizmo.xml", all(""), "gizmo.xml"},
            {"gizmo.xml", all("no XML"), "gizmo.xml"},
            {"gizmo.xml", cut(0.6), "gizmo.xml"},
            {"gizmo.xml", all("<?xml version=\"1.0\"?>\n<other/>"), "gizmo.xml"},
            file("file=\"hit.wav\"", ""),
            file("hit.wav", "none.wav"),
            file("filechannel=\"1\"", "filechannel=\"2\""),
            file("filechannel=\"1\"", "filechannel=\"one\""),
            file("power=\"1\"", "power=\"loud\"")};
}

std::vector<Spoilt> orchestras() {
    const auto file = [](const std::string& from, const std::string& to, int line,
                         const std::string& found = "") {
        return Spoilt{"mine.orc", put(from, to), "mine.orc:" + std::to_string(line) + ":", found};
    };
    return {file("aside = 0", "system 1", 10, "system"),
            file("aside = 0", "while 1 > 0 do", 10, "while"),
            file("aside = 0", "aside = 0 \"text\"", 10),
            file("aside = 0", "p3 = 1000000", 10, "p3"),
            file("aside = 0", "aside = (0", 10),
            file("aside = 0", "aside = iQ", 10, "iQ"),
            file("aside = 0", "aside oscils 1", 10, "oscils"),
            file("aforce, p12, 200", "aforce p12 200", 8),
            {"mine.orc", put("  endif", ""), "mine.orc:", "Csound"},
            file("endin", "", 15),
            file("instr gong", "instr drum", 3, "drum"),
            file("instr gong", "instr bong", 1),
            file(";@ gong frequency_hz 100", ";@ gong frequency_hz", 1),
            file(";@ gong frequency_hz 100", ";@ gong frequency_hz 10", 1),
            file(";@ gong frequency_hz", ";@ gong", 1),
            file("pitch [Hz]\n", "pitch [Hz]\n;@ gong frequency_hz 100 20 2000 again\n", 2, "second"),
            {"mine.orc", all(""), "kit.toml:34:", "gong"}};
}

/// Each message: FILE[:LINE[:COLUMN]]: error: found ..., expected ..., in one line.
void expect_refused(AllFiles& files, const Spoilt& spoilt, const std::string& message) {
    const std::string folder = files.folder().string() + "/";
    EXPECT_EQ(message.find(folder + spoilt.place), 0U) << message;
    EXPECT_NE(message.find(": error: found "), std::string::npos) << message;
    EXPECT_NE(message.find(spoilt.found), std::string::npos) << message;
    EXPECT_NE(message.find("expected "), std::string::npos) << message;
    EXPECT_LT(message.size(), 2000U) << message;
    for (const char c : message) EXPECT_FALSE(is_control(c)) << message;
}

class Malformed : public testing::Test {
protected:
    void refuse_all(const std::vector<Spoilt>& all) {
        ASSERT_EQ(files_.fault(), "") << "the whole kit";
        for (std::size_t i = 0; i < all.size(); ++i) {
            const Spoilt& spoilt = all[i];
            SCOPED_TRACE(spoilt.file + " number " + std::to_string(i));
            files_.write(spoilt.file, spoilt.change(files_.whole(spoilt.file)));
            expect_refused(files_, spoilt, files_.fault());
            files_.write(spoilt.file, files_.whole(spoilt.file));
        }
    }
    AllFiles files_;
};

TEST_F(Malformed, Kits) {
    refuse_all(kits());
}
TEST_F(Malformed, Meshes) {
    refuse_all(meshes());
}
TEST_F(Malformed, SoundFiles) {
    refuse_all(sounds());
}
TEST_F(Malformed, SfzFiles) {
    refuse_all(sfz());
}
TEST_F(Malformed, SoundFonts) {
    refuse_all(fonts());
}
TEST_F(Malformed, DrumGizmoFiles) {
    refuse_all(gizmos());
}
TEST_F(Malformed, Orchestras) {
    refuse_all(orchestras());
}
TEST_F(Malformed, MeshesOfOtherFormats) {
    for (const Spoilt& spoilt : others()) {
        files_.write(spoilt.file, spoilt.change(""));
        files_.write("kit.toml", put("mesh.obj", spoilt.file)(put("shape = \"mesh\"\n", "")(kKit)));
        SCOPED_TRACE(spoilt.file);
        expect_refused(files_, spoilt, files_.fault());
    }
}
TEST_F(Malformed, ThereAreMoreThanAHundred) {
    std::size_t count = others().size();
    for (const auto& list : {kits(), meshes(), sounds(), sfz(), fonts(), gizmos(), orchestras()})
        count += list.size();
    EXPECT_GE(count, 100U);
}

/// A sound with a value that is no number.
TEST_F(Malformed, ASampleThatIsNoNumber) {
    const std::string nan = dword(0x7fc00000);
    files_.write("hit.wav", at("data", 4 + 400, nan)(files_.whole("float.wav")));
    EXPECT_NE(files_.fault().find("no numbers"), std::string::npos) << files_.fault();
}

TEST_F(Malformed, ACopyOfABadKitLeavesNothing) {
    const std::set<std::string> before = [&] {
        std::set<std::string> names;
        for (const auto& entry : fs::directory_iterator(files_.folder()))
            names.insert(entry.path().filename());
        return names;
    }();
    for (const auto& [name, bytes] :
         {std::pair("set.sfz", ""), {"font.sf2", "RIFF"}, {"hit.flac", ""}, {"mine.orc", "x"}}) {
        files_.write(name, bytes);
        EXPECT_THROW(copy_kit(files_.folder() / "kit.toml", files_.folder() / "copy.toml"), BadInput) << name;
        files_.write(name, files_.whole(name));
    }
    for (const auto& entry : fs::directory_iterator(files_.folder()))
        EXPECT_TRUE(before.contains(entry.path().filename())) << entry.path();
}

}  // namespace
}  // namespace app
