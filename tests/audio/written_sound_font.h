#pragma once
#include <cstdint>
#include <string>
#include <vector>

/// A SoundFont of one preset and one instrument, for tests: two velocity layers (0-63 and 64-127) of two samples.
class WrittenSoundFont {
public:
    WrittenSoundFont(const std::vector<std::int16_t>& soft, const std::vector<std::int16_t>& loud,
                     int rate_hz, int key) {
        std::string smpl;
        for (const auto* samples : {&soft, &loud}) {
            for (const std::int16_t value : *samples) word(smpl, value);
            smpl.append(2 * 46, '\0');
        }
        const auto n0 = static_cast<std::uint32_t>(soft.size()), n1 = static_cast<std::uint32_t>(loud.size());
        std::string phdr, pbag, pgen, inst, ibag, igen, shdr;
        preset(phdr, "Drums", 128, 0), preset(phdr, "EOP", 0, 1);
        word(pbag, 0), word(pbag, 0), word(pbag, 1), word(pbag, 0);
        generator(pgen, 41, 0), generator(pgen, 0, 0);
        name(inst, "Snare"), word(inst, 0), name(inst, "EOI"), word(inst, 2);
        word(ibag, 0), word(ibag, 0), word(ibag, 3), word(ibag, 0), word(ibag, 6), word(ibag, 0);
        generator(igen, 43, key | key << 8), generator(igen, 44, 0 | 63 << 8), generator(igen, 53, 0);
        generator(igen, 43, key | key << 8), generator(igen, 44, 64 | 127 << 8), generator(igen, 53, 1);
        generator(igen, 0, 0);
        sample(shdr, 0, n0, rate_hz, key), sample(shdr, n0 + 46, n0 + 46 + n1, rate_hz, key),
            sample(shdr, 0, 0, 0, 0);
        const std::string tables = chunk("phdr", phdr) + chunk("pbag", pbag) + chunk("pgen", pgen) +
                                   chunk("inst", inst) + chunk("ibag", ibag) + chunk("igen", igen) +
                                   chunk("shdr", shdr);
        bytes_ = chunk("RIFF",
                       "sfbk" + chunk("LIST", "sdta" + chunk("smpl", smpl)) + chunk("LIST", "pdta" + tables));
    }
    [[nodiscard]] const std::string& bytes() const { return bytes_; }

private:
    static void word(std::string& bytes, int value) {
        bytes += static_cast<char>(value & 0xff);
        bytes += static_cast<char>(value >> 8 & 0xff);
    }
    static void dword(std::string& bytes, std::uint32_t value) {
        word(bytes, static_cast<int>(value & 0xffff)), word(bytes, static_cast<int>(value >> 16));
    }
    static void name(std::string& bytes, std::string text) {
        text.resize(20);
        bytes += text;
    }
    static void generator(std::string& bytes, int number, int amount) {
        word(bytes, number), word(bytes, amount);
    }
    static void preset(std::string& bytes, const std::string& text, int bank, int bag) {
        name(bytes, text), word(bytes, 0), word(bytes, bank), word(bytes, bag);
        bytes.append(12, '\0');
    }
    static void sample(std::string& bytes, std::uint32_t begin, std::uint32_t end, int rate_hz, int key) {
        name(bytes, "sample"), dword(bytes, begin), dword(bytes, end), dword(bytes, begin), dword(bytes, end);
        dword(bytes, static_cast<std::uint32_t>(rate_hz));
        bytes += static_cast<char>(key), bytes += '\0';
        word(bytes, 0), word(bytes, 1);
    }
    static std::string chunk(const std::string& id, const std::string& inner) {
        std::string bytes = id;
        dword(bytes, static_cast<std::uint32_t>(inner.size()));
        return bytes + inner + std::string(inner.size() % 2, '\0');
    }

    std::string bytes_;
};
