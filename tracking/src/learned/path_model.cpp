#include "tracking/path_model.h"

#include <algorithm>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <set>
#include <span>
#include <stdexcept>

#include "learned/contact_view.h"
#include "learned/learned_path.h"
#include "trace/text_cursor.h"
#include "tracking/input.h"
#include "tracking/trace.h"

namespace tracking {
namespace {

static_assert(std::endian::native == std::endian::little, "the file's floats are copied");

constexpr std::string_view kTitle = "MusicWorld path model ";
constexpr std::string_view kSizes = "sizes: ", kContacts = "contacts: ", kTrust = "trust: ",
                           kChecksum = "checksum: ";
constexpr std::size_t kLongestHead = 1 << 20;
constexpr float kGreatestWeight = 1e6F;
constexpr const char* kRemedy = "make it again with `musicworld train`";

std::string titled() {
    std::string title(kTitle);
    return title += std::to_string(PathModel::kVersion);
}

/// FNV-1a (Fowler, Noll, Vo), 64 bits.
std::uint64_t hash(std::string_view bytes, std::uint64_t state = 0xcbf29ce484222325ULL) {
    for (const char byte : bytes) state = (state ^ static_cast<unsigned char>(byte)) * 0x100000001b3ULL;
    return state;
}

std::string checksum_line(std::uint64_t number) {
    std::string line(kChecksum);
    for (int shift = 60; shift >= 0; shift -= 4) line += "0123456789abcdef"[(number >> shift) % 16];
    return line;
}

template <class Model, class Take>
void for_each_block(Model& model, const Take& take) {
    const auto take_layers = [&](auto& layers) {
        for (auto& layer : layers) {
            take(std::span(layer.weights.data(), static_cast<std::size_t>(layer.weights.size())));
            take(std::span(layer.bias.data(), static_cast<std::size_t>(layer.bias.size())));
        }
    };
    take_layers(model.layers);
    if (model.contacts) take_layers(*model.contacts);
}

/// Calls take(number, least, greatest) for the numbers of all sticks' trust, in the file's order.
template <class Model, class Take>
void for_each_number(Model& model, const Take& take) {
    constexpr double kMost = 1e12, kMostLogRadius = Trust::kMostLog;
    for (auto& trust : model.trust)
        for (auto& lead : trust.leads) {
            for (auto* sums : {&lead.position, &lead.shaft}) {
                take(sums->known_s, 0, kMost);
                take(sums->against, -kMost, kMost);
                for (auto* sum :
                     {&sums->square, &sums->filter_recent, &sums->filter_square, &sums->model_square})
                    take(*sum, 0, kMost);
            }
            take(lead.regions.errors, 0, kMost);
            take(lead.regions.mean, 0, kMost);
            take(lead.regions.radii.log_50, -kMostLogRadius, kMostLogRadius);
            take(lead.regions.radii.log_95, -kMostLogRadius, kMostLogRadius);
        }
}

std::string sizes_of(const PathModel::Layers& layers) {
    std::string text = std::to_string(layers[0].weights.cols());
    for (const PathModel::Layer& layer : layers)
        text.append(1, ' ').append(std::to_string(layer.weights.rows()));
    return text;
}

bool is_word(std::string_view text) {
    return !text.empty() && text.find_first_not_of("abcdefghijklmnopqrstuvwxyz0123456789_") == text.npos;
}

bool is_stick(std::string_view name) {
    return !name.empty() && name.find_first_of(" \t") == name.npos && first_unprintable(name) == name.npos;
}

std::string shortest(double number) {
    char text[32];
    return {text, std::to_chars(std::begin(text), std::end(text), number).ptr};
}

/// INPUTS HIDDEN1 HIDDEN2 OUTPUTS behind a key: layers of these sizes, still without weights.
PathModel::Layers parse_sizes(const Line& line, std::string_view key, std::size_t inputs,
                              std::size_t outputs) {
    const std::string expected = "sizes " + std::to_string(inputs) + " N N " + std::to_string(outputs) +
                                 " with N from " + std::to_string(PathModel::kLeastHidden) + " to " +
                                 std::to_string(PathModel::kMostHidden);
    std::array<std::size_t, 4> sizes{};
    const std::string_view text = line.text().substr(key.size());
    const char* at = text.data();
    const char* const end = at + text.size();
    for (std::size_t i = 0; i < sizes.size(); ++i) {
        const auto [stop, failed] = std::from_chars(at, end, sizes[i]);
        const bool last = i + 1 == sizes.size();
        if (failed != std::errc() || (last ? stop != end : stop == end || *stop != ' '))
            line.fail(key.size(), in_quotes(text), expected, kRemedy);
        at = last ? stop : stop + 1;
    }
    const auto within = [](std::size_t n) {
        return n >= PathModel::kLeastHidden && n <= PathModel::kMostHidden;
    };
    if (sizes[0] != inputs || sizes[3] != outputs || !within(sizes[1]) || !within(sizes[2]))
        line.fail(key.size(), in_quotes(text), expected, kRemedy);
    PathModel::Layers layers;
    for (std::size_t i = 0; i < layers.size(); ++i) {
        layers[i].weights.resize(static_cast<Eigen::Index>(sizes[i + 1]),
                                 static_cast<Eigen::Index>(sizes[i]));
        layers[i].bias.resize(static_cast<Eigen::Index>(sizes[i + 1]));
    }
    return layers;
}

[[noreturn]] void fail_at(const std::string& name, std::size_t byte, const std::string& found,
                          const std::string& expected) {
    throw TraceError(name + ":byte " + std::to_string(byte) + ": error: found " + found + ", expected " +
                     expected + "; " + kRemedy);
}

std::string head_of(const Provenance& provenance) {
    std::string head = titled() + "\n";
    for (const auto& [key, value] : provenance) {
        const std::string line = key + ": " + value;
        if (!is_word(key) || line.starts_with(kSizes) || line.starts_with(kContacts) ||
            line.starts_with(kChecksum) || first_unprintable(value) != value.npos ||
            head.size() + line.size() > kLongestHead / 2)
            throw std::invalid_argument("path model: found provenance " + in_quotes(line) +
                                        ", expected a word and one short line of text");
        head += line + "\n";
    }
    return head;
}

}  // namespace

void check_provenance(const Provenance& provenance) {
    (void)head_of(provenance);
}

std::string format_path_model(const PathModel& model) {
    std::string head = head_of(model.provenance);
    head += std::string(kSizes) + sizes_of(model.layers) + "\n";
    if (model.contacts) head += std::string(kContacts) + sizes_of(*model.contacts) + "\n";
    for (const Trust& trust : model.trust) {
        if (!is_stick(trust.stick))
            throw std::invalid_argument("path model: found stick name " + in_quotes(trust.stick) +
                                        ", expected a word");
        head.append(kTrust).append(trust.stick).append("\n");
    }
    std::string weights;
    for_each_block(model, [&](std::span<const float> block) {
        weights.append(reinterpret_cast<const char*>(block.data()), block.size_bytes());
    });
    for_each_number(model, [&](double number, double /*least*/, double /*greatest*/) {
        weights.append(reinterpret_cast<const char*>(&number), sizeof number);
    });
    return head.append(checksum_line(hash(weights, hash(head)))).append("\n\n").append(weights);
}

PathModel parse_path_model(std::string_view bytes, const std::string& name) {
    const std::size_t end = bytes.substr(0, kLongestHead).find("\n\n");
    if (end == bytes.npos)
        throw TraceError(name +
                         ":1:1: error: found no end of a model's head, expected a file that begins with " +
                         in_quotes(titled()) + "; " + kRemedy);
    const std::string_view weights = bytes.substr(end + 2);
    LineReader lines(bytes.substr(0, end + 1), name);
    const Line title = lines.next();
    if (title.text() != titled()) title.fail(0, in_quotes(title.text()), in_quotes(titled()), kRemedy);
    PathModel model;
    while (true) {
        if (lines.at_end()) fail_at(name, end, "the end of the head", "the line \"sizes: ...\"");
        const Line line = lines.next();
        line.require_text(kRemedy);
        if (line.text().starts_with(kSizes)) {
            model.layers = parse_sizes(line, kSizes, StickHistory::kInputs, kPathOutputs);
            break;
        }
        if (line.text().starts_with(kChecksum))
            line.fail(0, in_quotes(line.text()), "the line \"sizes: ...\" before the checksum", kRemedy);
        if (line.text().starts_with(kContacts))
            line.fail(0, in_quotes(line.text()), "the line \"sizes: ...\" before that of contacts", kRemedy);
        const std::size_t colon = line.text().find(": ");
        if (colon == line.text().npos || !is_word(line.text().substr(0, colon)))
            line.fail(0, in_quotes(line.text()), "\"key: value\"", kRemedy);
        model.provenance.emplace_back(line.text().substr(0, colon), line.text().substr(colon + 2));
    }
    std::optional<Line> sum;
    if (!lines.at_end()) sum = lines.next();
    if (sum && sum->text().starts_with(kContacts)) {
        sum->require_text(kRemedy);
        model.contacts = parse_sizes(*sum, kContacts, kContactInputs, kContactOutputs);
        sum.reset();
        if (!lines.at_end()) sum = lines.next();
    }
    std::set<std::string_view> sticks;
    while (sum && sum->text().starts_with(kTrust)) {
        sum->require_text(kRemedy);
        const std::string_view stick = sum->text().substr(kTrust.size());
        if (!is_stick(stick) || !sticks.insert(stick).second)
            sum->fail(kTrust.size(), in_quotes(stick), "the name of another stick", kRemedy);
        model.trust.emplace_back().stick = stick;
        sum.reset();
        if (!lines.at_end()) sum = lines.next();
    }
    std::size_t expected = 0;
    for_each_block(model, [&](std::span<float> block) { expected += block.size_bytes(); });
    for_each_number(model,
                    [&](double number, double /*least*/, double /*greatest*/) { expected += sizeof number; });
    if (weights.size() != expected)
        fail_at(name, end + 2, std::to_string(weights.size()) + " bytes of weights",
                std::to_string(expected) + " for these sizes");
    const std::string_view before = bytes.substr(0, bytes.find("\nchecksum: ") + 1);
    if (!sum) fail_at(name, end, "no checksum", "the line \"checksum: ...\" after the sizes");
    const std::string right = checksum_line(hash(weights, hash(before)));
    if (sum->text() != right) sum->fail(0, in_quotes(sum->text()), in_quotes(right), kRemedy);
    if (!lines.at_end()) {
        const Line more = lines.next();
        more.fail(0, in_quotes(more.text()), "an empty line", kRemedy);
    }
    std::size_t at = 0;
    for_each_block(model, [&](std::span<float> block) {
        std::memcpy(block.data(), weights.data() + at, block.size_bytes());
        for (std::size_t i = 0; i < block.size(); ++i)
            if (!(std::abs(block[i]) <= kGreatestWeight))
                fail_at(name, end + 2 + at + i * sizeof(float), "a weight of " + std::to_string(block[i]),
                        "a finite one of at most 1e6");
        at += block.size_bytes();
    });
    for_each_number(model, [&](double& number, double least, double greatest) {
        std::memcpy(&number, weights.data() + at, sizeof number);
        if (!(number >= least && number <= greatest))
            fail_at(name, end + 2 + at, "a number of trust of " + shortest(number),
                    "one from " + shortest(least) + " to " + shortest(greatest));
        at += sizeof number;
    });
    return model;
}

PathModel read_path_model(const std::filesystem::path& file) {
    const std::string name = file.string();
    return parse_path_model(read_bytes(name, "a model file that can be read"), name);
}

}  // namespace tracking
