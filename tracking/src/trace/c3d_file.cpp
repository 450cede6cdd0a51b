#include "trace/c3d_file.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdio>

#include "trace/binary_place.h"
#include "trace/text_cursor.h"
#include "tracking/import.h"

namespace tracking {
namespace {

constexpr std::size_t kBlock = 512;
constexpr unsigned kKey = 80;
constexpr std::size_t kMostDimensions = 7;
constexpr double kMostPoints = 65535, kMostBlocks = 65535;

/// Whatever number a file may hold: "70001", "-1", "1e+30", "nan".
std::string in_digits(double number) {
    char text[32];
    std::snprintf(text, sizeof text, "%.15g", number);
    return text;
}

std::size_t parameters_at(std::string_view bytes) {
    const std::size_t block = static_cast<std::uint8_t>(bytes[0]);
    return block == 0 ? 0 : (block - 1) * kBlock;
}

std::string upper(std::string text) {
    std::transform(text.begin(), text.end(), text.begin(),
                   [](char c) { return c >= 'a' && c <= 'z' ? static_cast<char>(c - 'a' + 'A') : c; });
    return text;
}

/// "+X", "-Z" or "Y": which axis; -1 if it is none.
int axis_of(std::string text) {
    text = upper(std::move(text));
    if (text.starts_with('-') || text.starts_with('+')) text.erase(0, 1);
    return text.size() == 1 && text[0] >= 'X' && text[0] <= 'Z' ? text[0] - 'X' : -1;
}

}  // namespace

bool is_c3d(std::string_view bytes) {
    if (bytes.size() < kBlock || static_cast<std::uint8_t>(bytes[1]) != kKey) return false;
    const std::size_t at = parameters_at(bytes);
    if (at == 0 || at + 4 > bytes.size()) return false;
    const int processor = static_cast<std::uint8_t>(bytes[at + 3]);
    return processor >= 84 && processor <= 86;
}

C3dFile::C3dFile(std::string_view bytes, const std::string& name) : bytes_(bytes), name_(name) {
    if (!is_c3d(bytes)) fail_at_byte(name, 0, "another beginning", "a C3D file");
    const std::size_t at = parameters_at(bytes);
    processor_ = static_cast<Processor>(byte(at + 3));
    read_parameters(at + 4);
    read_points();
    read_labels();
    read_axes();
    const std::string units = upper(text("POINT:UNITS"));
    if (units == "MM" || units == "MILLIMETERS") metres_per_unit_ = 1e-3;
    if (units == "CM" || units == "CENTIMETERS") metres_per_unit_ = 1e-2;
    if (units == "M" || units == "METERS") metres_per_unit_ = 1;
}

void C3dFile::require(std::size_t at, std::size_t count, const char* what) const {
    if (at > bytes_.size() || count > bytes_.size() - at)
        fail_at_byte(name_, bytes_.size(), std::string("the end of the file within ") + what,
                     "the rest of it");
}

unsigned C3dFile::word(std::size_t at) const {
    return processor_ == Processor::mips ? byte(at) << 8 | byte(at + 1) : byte(at + 1) << 8 | byte(at);
}

/// DEC's F format holds the words the other way round, with an exponent greater by two.
double C3dFile::real(std::size_t at) const {
    const unsigned low = word(at), high = word(at + 2);
    if (processor_ == Processor::intel) return std::bit_cast<float>(high << 16 | low);
    if (processor_ == Processor::mips) return std::bit_cast<float>(low << 16 | high);
    if ((low & 0x7F80u) == 0) return 0;
    const double mantissa = 0.5 + std::ldexp((low & 0x7Fu) << 16 | high, -24);
    return std::ldexp((low & 0x8000u) != 0 ? -mantissa : mantissa, static_cast<int>(low >> 7 & 0xFFu) - 128);
}

/// Groups (a negative number) and parameters (that of their group) in any order, each with its distance to the next.
void C3dFile::read_parameters(std::size_t at) {
    std::map<int, std::string> groups;
    std::vector<std::tuple<int, std::string, Parameter>> found;
    for (;;) {
        require(at, 2, "the parameters");
        const auto length = static_cast<std::size_t>(std::abs(static_cast<std::int8_t>(byte(at))));
        const int group = static_cast<std::int8_t>(byte(at + 1));
        if (length == 0) break;
        require(at, 2 + length + 2, "the parameters");
        const std::string parameter = upper(std::string(bytes_.substr(at + 2, length)));
        const std::size_t link = at + 2 + length;
        if (group < 0) groups.emplace(-group, parameter);
        if (group > 0) found.emplace_back(group, parameter, read_parameter(link + 2));
        const unsigned step = word(link);
        if (step == 0) break;
        if (step < 2) fail_at_byte(name_, link, "a step of " + std::to_string(step), "2 bytes or more");
        at = link + step;
    }
    for (const auto& [group, parameter, value] : found)
        if (const auto owner = groups.find(group); owner != groups.end())
            parameters_.emplace(owner->second + ":" + parameter, value);
}

C3dFile::Parameter C3dFile::read_parameter(std::size_t at) const {
    require(at, 2, "a parameter");
    Parameter parameter;
    parameter.type = static_cast<std::int8_t>(byte(at));
    const std::size_t dimensions = byte(at + 1);
    if (parameter.type != -1 && parameter.type != 1 && parameter.type != 2 && parameter.type != 4)
        fail_at_byte(name_, at, "values of type " + std::to_string(parameter.type), "-1, 1, 2 or 4");
    if (dimensions > kMostDimensions)
        fail_at_byte(name_, at + 1, std::to_string(dimensions) + " dimensions", "at most 7");
    require(at + 2, dimensions, "a parameter");
    parameter.at = at + 2 + dimensions;
    std::size_t count = 1;
    for (std::size_t i = 0; i < dimensions; ++i) {
        const std::size_t extent = byte(at + 2 + i);
        if (i == 0) parameter.size[0] = extent;
        if (i > 0) parameter.size[1] = std::min(parameter.size[1] * extent, bytes_.size());
        count = std::min(count * extent, bytes_.size());
    }
    require(parameter.at, count * static_cast<std::size_t>(std::abs(parameter.type)), "a parameter");
    return parameter;
}

const C3dFile::Parameter* C3dFile::find(const std::string& name) const {
    const auto found = parameters_.find(name);
    return found == parameters_.end() ? nullptr : &found->second;
}

std::optional<double> C3dFile::number(const std::string& name, std::size_t i) const {
    const Parameter* parameter = find(name);
    if (parameter == nullptr || i >= parameter->size[0] * parameter->size[1]) return std::nullopt;
    if (parameter->type == 1) return byte(parameter->at + i);
    if (parameter->type == 2) return word(parameter->at + 2 * i);
    if (parameter->type == 4) return real(parameter->at + 4 * i);
    return std::nullopt;
}

std::size_t C3dFile::place_of(const std::string& name, std::size_t header) const {
    return number(name) ? find(name)->at : header;
}

std::string C3dFile::text(const std::string& name, std::size_t i) const {
    const Parameter* parameter = find(name);
    if (parameter == nullptr || parameter->type != -1 || i >= parameter->size[1]) return {};
    std::string_view text = bytes_.substr(parameter->at + i * parameter->size[0], parameter->size[0]);
    text = trimmed(text.substr(0, text.find('\0')));
    return std::string(text);
}

double C3dFile::count_of_frames() const {
    if (const std::optional<double> frames = number("POINT:LONG_FRAMES")) return *frames;
    const std::optional<double> first = number("TRIAL:ACTUAL_START_FIELD"),
                                last = number("TRIAL:ACTUAL_END_FIELD");
    if (first && last)
        return *last + 65536 * number("TRIAL:ACTUAL_END_FIELD", 1).value_or(0) - *first -
               65536 * number("TRIAL:ACTUAL_START_FIELD", 1).value_or(0) + 1;
    if (const std::optional<double> frames = number("POINT:FRAMES")) return *frames;
    return static_cast<double>(word(8)) - word(6) + 1;
}

void C3dFile::read_points() {
    const double used = number("POINT:USED").value_or(word(2));
    if (!(used >= 1 && used <= kMostPoints))
        fail_at_byte(name_, place_of("POINT:USED", 2), in_digits(used) + " points", "1 to 65535");
    points_ = static_cast<std::size_t>(used);
    rate_hz_ = number("POINT:RATE").value_or(real(20));
    scale_ = number("POINT:SCALE").value_or(real(12));
    if (!(rate_hz_ > 0 && rate_hz_ <= 1e5))
        fail_at_byte(name_, place_of("POINT:RATE", 20), "a rate of " + in_digits(rate_hz_),
                     "frames per second, up to 100000");
    if (!std::isfinite(scale_) || scale_ == 0)
        fail_at_byte(name_, place_of("POINT:SCALE", 12), "a scale of " + in_digits(scale_),
                     "a number that is not zero");
    word_bytes_ = scale_ < 0 ? 4 : 2;
    frame_bytes_ = word_bytes_ * (4 * points_ + word(4));
    const double said = number("POINT:DATA_START").value_or(0), block = said >= 2 ? said : word(16);
    data_at_ = block >= 1 && block <= kMostBlocks ? (static_cast<std::size_t>(block) - 1) * kBlock : 0;
    if (data_at_ < kBlock || data_at_ > bytes_.size())
        fail_at_byte(name_, said >= 2 ? place_of("POINT:DATA_START", 16) : 16,
                     "data in block " + in_digits(block), "a block of the file");
    const double frames = count_of_frames();
    const std::size_t room = (bytes_.size() - data_at_) / frame_bytes_;
    if (!(frames >= 0 && frames <= static_cast<double>(room)))
        fail_at_byte(name_, data_at_, in_digits(frames) + " frames",
                     "at most the " + std::to_string(room) + " that the file has room for");
    frames_ = static_cast<std::size_t>(frames);
}

/// Beyond 255 labels they go on in LABELS2, LABELS3, ...
void C3dFile::read_labels() {
    labels_.reserve(points_);
    std::string parameter = "POINT:LABELS";
    for (std::size_t more = 2; labels_.size() < points_; ++more) {
        const Parameter* labels = find(parameter);
        if (labels == nullptr || labels->type != -1) break;
        for (std::size_t i = 0; i < labels->size[1] && labels_.size() < points_; ++i)
            labels_.push_back(text(parameter, i));
        parameter = "POINT:LABELS" + std::to_string(more);
    }
    labels_.resize(points_);
    for (std::size_t i = 0; i < points_; ++i)
        if (labels_[i].empty()) labels_[i] = "point" + std::to_string(i + 1);
}

/// Programs write -Z where z points up (Visual3D): only the letter counts.
void C3dFile::read_axes() {
    const int said = axis_of(text("POINT:Y_SCREEN")), across = axis_of(text("POINT:X_SCREEN"));
    const int up = said < 0 ? 2 : said;
    const int right = across >= 0 && across != up ? across : up == 0 ? 1 : 0;
    axes_.row(0) = Eigen::RowVector3d::Unit(right);
    axes_.row(1) = Eigen::RowVector3d::Unit(up);
    axes_.row(2) = Eigen::Vector3d::Unit(right).cross(Eigen::Vector3d::Unit(up));
}

std::size_t C3dFile::byte_of(std::size_t frame, std::size_t which) const {
    return data_at_ + frame * frame_bytes_ + 4 * word_bytes_ * which;
}

std::optional<Eigen::Vector3d> C3dFile::point(std::size_t frame, std::size_t which) const {
    const std::size_t at = byte_of(frame, which);
    Eigen::Vector3d p;
    if (scale_ < 0) {
        for (std::size_t i = 0; i < 3; ++i) p[static_cast<Eigen::Index>(i)] = real(at + 4 * i);
        if (real(at + 12) <= -0.5 || p.hasNaN()) return std::nullopt;
    } else {
        for (std::size_t i = 0; i < 3; ++i) p[static_cast<Eigen::Index>(i)] = scale_ * integer(at + 2 * i);
        if (integer(at + 6) < 0) return std::nullopt;
    }
    return p;
}

}  // namespace tracking
