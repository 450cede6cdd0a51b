#include <algorithm>
#include <charconv>
#include <cmath>
#include <map>
#include <optional>
#include <pugixml.hpp>
#include <set>

#include "region_text.h"

namespace audio {
namespace fs = std::filesystem;
namespace {

/// The highest velocity of a range that ends before this share of 127; the next one begins above it.
int velocity_below(double upper) {
    return upper >= 1 ? 127 : static_cast<int>(std::ceil(127 * upper)) - 1;
}

// What of a DrumGizmo kit is followed: instruments, their samples with power (version 2) or velocity ranges (version 1),
// the channels marked `main` (all where none is), left and right by the channels' names. Not followed: bleed into
// other microphones, DrumGizmo's own choice among samples and its humanising.

constexpr int kMostLayers = 12;

class Xml {
public:
    Xml(std::string_view text, const fs::path& file, const char* root) : text_(text), file_(file) {
        const pugi::xml_parse_result read = document_.load_buffer(text.data(), text.size());
        if (!read)
            fail_at(place(read.offset), std::string("XML with a fault: ") + read.description(),
                    "well-formed XML");
        if (!top()) fail_at(place(0), "no element", std::string("<") + root + ">");
    }
    [[nodiscard]] pugi::xml_node top() const { return document_.document_element(); }
    [[nodiscard]] std::string place(pugi::xml_node node) const { return place(node.offset_debug()); }
    [[nodiscard]] std::string place(std::ptrdiff_t offset) const {
        const std::string_view before = text_.substr(
            0, static_cast<std::size_t>(std::clamp<std::ptrdiff_t>(offset, 0, std::ssize(text_))));
        const auto line = 1 + std::ranges::count(before, '\n');
        const std::size_t last = before.rfind('\n');
        const std::size_t column = before.size() - (last == before.npos ? 0 : last + 1) + 1;
        return file_.string() + ":" + std::to_string(line) + ":" + std::to_string(column);
    }
    [[nodiscard]] const fs::path& file() const { return file_; }
    /// A number of an attribute; `otherwise` where it has none.
    [[nodiscard]] double number(pugi::xml_node node, const char* name, double low, double high,
                                std::optional<double> otherwise = {}) const {
        const pugi::xml_attribute attribute = node.attribute(name);
        if (!attribute && otherwise) return *otherwise;
        const std::string_view text = attribute.value();
        double value = 0;
        const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
        if (error != std::errc() || end != text.data() + text.size() || !(value >= low && value <= high))
            fail_at(place(node), std::string(name) + "=\"" + printable(attribute.value()) + "\"",
                    "a number in range");
        return value;
    }

private:
    std::string_view text_;
    fs::path file_;
    pugi::xml_document document_;
};

std::string lower(std::string_view text) {
    std::string result(text);
    for (char& c : result)
        if (c >= 'A' && c <= 'Z') c = static_cast<char>(c + 'a' - 'A');
    return result;
}

ChannelUse use_of(const std::string& channel, int number) {
    const std::string name = lower(channel);
    if (name.find("left") != name.npos || name.ends_with("_l")) return {number, 1, 0};
    if (name.find("right") != name.npos || name.ends_with("_r")) return {number, 0, 1};
    return {number, 1, 1};
}

class DrumGizmo {
public:
    WrittenRegions take() && { return std::move(result_); }
    void add_file(const fs::path& file) { result_.files.push_back(file); }

    /// The samples of an instrument for the keys `low` to `high`; `main`: the channels that are heard, empty: all.
    void add_instrument(const Xml& xml, int low, int high, const std::set<std::string>& main) {
        const pugi::xml_node top = xml.top();
        std::vector<std::pair<double, pugi::xml_node>> samples;
        std::map<std::string, pugi::xml_node> by_name;
        for (const pugi::xml_node sample : top.child("samples").children("sample")) {
            samples.emplace_back(xml.number(sample, "power", 0, 1e12, 0.0), sample);
            by_name[sample.attribute("name").value()] = sample;
            if (samples.size() > kMostRegions) fail_at(xml.place(sample), "more than 4096 samples", "fewer");
        }
        if (samples.empty())
            fail_at(xml.place(top), "an instrument without <samples>", "at least one <sample>");
        if (const pugi::xml_node velocities = top.child("velocities"))
            by_velocity(xml, velocities, by_name, low, high, main);
        else
            by_power(xml, std::move(samples), low, high, main);
    }

private:
    /// Version 2: samples of rising power, in at most 12 layers of equally many; those of a layer take turns. The power
    /// of the strongest is a stroke of velocity 127.
    void by_power(const Xml& xml, std::vector<std::pair<double, pugi::xml_node>> samples, int low, int high,
                  const std::set<std::string>& main) {
        std::ranges::stable_sort(samples, {}, [](const auto& sample) { return sample.first; });
        const int count = static_cast<int>(samples.size()), layers = std::min(kMostLayers, count);
        const double strongest = samples.back().first;
        int lowest = 0;
        for (int layer = 0; layer < layers; ++layer) {
            const int begin = layer * count / layers, end = (layer + 1) * count / layers;
            const double limit = end == count ? strongest
                                              : 0.5 * (samples[static_cast<std::size_t>(end - 1)].first +
                                                       samples[static_cast<std::size_t>(end)].first);
            const double share = strongest > 0 ? limit / strongest : double(layer + 1) / layers;
            const int highest = layer + 1 == layers ? 127 : static_cast<int>(127 * share);
            if (highest < lowest) continue;
            for (int i = begin; i < end; ++i)
                add_sample(xml, samples[static_cast<std::size_t>(i)].second, main,
                           {low, high, lowest, highest, end - begin, i - begin + 1});
            lowest = highest + 1;
        }
    }
    /// Version 1.
    void by_velocity(const Xml& xml, pugi::xml_node velocities,
                     const std::map<std::string, pugi::xml_node>& by_name, int low, int high,
                     const std::set<std::string>& main) {
        for (const pugi::xml_node velocity : velocities.children("velocity")) {
            const int from = static_cast<int>(std::ceil(127 * xml.number(velocity, "lower", 0, 1))),
                      to = velocity_below(xml.number(velocity, "upper", 0, 1));
            const auto refs = velocity.children("sampleref");
            const int count = static_cast<int>(std::distance(refs.begin(), refs.end()));
            int position = 0;
            for (const pugi::xml_node reference : refs) {
                const auto sample = by_name.find(reference.attribute("name").value());
                if (sample == by_name.end())
                    fail_at(xml.place(reference),
                            "sampleref \"" + printable(reference.attribute("name").value()) + "\"",
                            "the name of a <sample>");
                add_sample(xml, sample->second, main, {low, high, from, to, count, ++position});
            }
        }
    }

    struct Turn {
        int low_key, high_key, low_velocity, high_velocity, length, position;
    };
    void add_sample(const Xml& xml, pugi::xml_node sample, const std::set<std::string>& main,
                    const Turn& turn) {
        const auto files = sample.children("audiofile");
        const auto is_main = [&](pugi::xml_node audio) {
            return main.contains(audio.attribute("channel").value());
        };
        const bool any_main = std::any_of(files.begin(), files.end(), is_main);
        for (const pugi::xml_node audio : files)
            if (!any_main || is_main(audio))
                add_channel(xml, audio, audio.attribute("channel").value(), turn);
        if (files.begin() == files.end())
            fail_at(xml.place(sample), "a <sample> without <audiofile>", "at least one");
    }
    void add_channel(const Xml& xml, pugi::xml_node audio, const std::string& channel, const Turn& turn) {
        if (result_.regions.size() >= kMostRegions)
            fail_at(xml.place(audio), "more than 4096 sounds", "fewer");
        WrittenRegion r;
        r.loop_mode = LoopMode::none;
        std::string name = audio.attribute("file").value();
        if (name.empty()) fail_at(xml.place(audio), "an <audiofile> without file", "file=\"NAME.wav\"");
        std::ranges::replace(name, '\\', '/');
        r.sample = xml.file().parent_path() / name;
        r.place = xml.place(audio);
        r.pitch_keytrack = 0;
        r.amp_veltrack = 0;  // the samples have their own loudness
        r.lokey = turn.low_key, r.hikey = turn.high_key;
        r.lovel = turn.low_velocity, r.hivel = turn.high_velocity;
        r.seq_length = turn.length, r.seq_position = turn.position;
        r.channels = {use_of(channel, static_cast<int>(xml.number(audio, "filechannel", 1, 64, 1.0)) - 1)};
        result_.regions.push_back(std::move(r));
    }

    WrittenRegions result_;
};

/// The kit's instruments at the keys of the midimap beside it.
void add_kit(const Xml& kit, DrumGizmo& regions) {
    const fs::path folder = kit.file().parent_path(), map_file = folder / "midimap.xml";
    std::error_code error;
    if (!fs::exists(map_file, error))
        fail_at(kit.place(kit.top()), "a kit without midimap.xml beside it",
                "that file, or an instrument's XML instead of the kit's");
    const std::string map_text = read_region_file(map_file);
    const Xml map(map_text, map_file, "midimap");
    regions.add_file(map_file);
    std::map<std::string, pugi::xml_node> by_name;
    for (const pugi::xml_node one : kit.top().child("instruments").children("instrument"))
        by_name[one.attribute("name").value()] = one;
    constexpr int kMostMaps = 256;
    int maps = 0;
    for (const pugi::xml_node entry : map.top().children("map")) {
        if (++maps > kMostMaps)
            fail_at(map.place(entry), "more than " + std::to_string(kMostMaps) + " maps", "fewer");
        const auto found = by_name.find(entry.attribute("instr").value());
        if (found == by_name.end())
            fail_at(map.place(entry), "instr=\"" + printable(entry.attribute("instr").value()) + "\"",
                    "an instrument of " + printable(kit.file().filename().string()));
        const int key = static_cast<int>(map.number(entry, "note", 0, 127));
        std::set<std::string> main;
        for (const pugi::xml_node channel : found->second.children("channelmap"))
            if (channel.attribute("main").as_bool()) main.insert(channel.attribute("in").value());
        const fs::path file = folder / found->second.attribute("file").value();
        const std::string text = read_region_file(file, kit.place(found->second));
        const Xml instrument(text, file, "instrument");
        regions.add_file(file);
        regions.add_instrument(instrument, key, key, main);
    }
}

}  // namespace

WrittenRegions parse_drumgizmo(std::string_view text, const fs::path& file) {
    const Xml xml(text, file, "drumkit");
    DrumGizmo regions;
    regions.add_file(file);
    const std::string_view root = xml.top().name();
    if (root == "drumkit")
        add_kit(xml, regions);
    else if (root == "instrument")
        regions.add_instrument(xml, 0, 127, {});
    else
        fail_at(xml.place(xml.top()), "<" + printable(root) + ">", "<drumkit> or <instrument> of DrumGizmo");
    WrittenRegions written = std::move(regions).take();
    if (written.regions.empty())
        fail_at(xml.place(xml.top()), "no sound", "at least one <sample> that is mapped");
    return written;
}

}  // namespace audio
