#include "trace/xror_reader.h"

#include <bson/bson.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <set>

#include "trace/binary_place.h"
#include "trace/fpzip_block.h"
#include "trace/orientation_forms.h"
#include "trace/replay_frames.h"
#include "trace/stick_names.h"
#include "trace/text_cursor.h"
#include "trace/trace_limits.h"

namespace tracking {
namespace {

constexpr std::size_t kMostDevices = 1000;

/// As a member of a class it keeps its alignment, as an argument of a template (std::optional) it would not.
struct Member {
    bson_iter_t at;
};

/// A document, or a part of one, in a file.
class Document {
public:
    Document(std::string_view file, const std::string& name) : file_(file), name_(&name) {
        bson_t whole;
        if (!bson_init_static(&whole, reinterpret_cast<const std::uint8_t*>(file.data()), file.size()) ||
            !bson_iter_init(&begin_, &whole))
            fail(0, "a document of another length than the file's " + std::to_string(file.size()) + " bytes",
                 "a whole BSON document");
    }

    [[noreturn]] void fail(std::size_t at, const std::string& found, const std::string& expected) const {
        fail_at_byte(*name_, at, found, expected, "check that the recording is complete");
    }

    /// Calls take(key, iterator) for each member.
    template <class Take>
    void each(Take take) const {
        bson_iter_t at = begin_;
        while (bson_iter_next(&at)) take(std::string_view(bson_iter_key(&at)), at);
        if (at.err_off != 0)  // at.raw is null then
            fail(std::min(place(begin_.raw) + at.err_off, file_.size()), "a broken member of a BSON document",
                 "one with its type, key and value");
    }

    /// The member of this name; none if there is none.
    [[nodiscard]] std::optional<Member> find(std::string_view name) const {
        std::optional<Member> found;
        each([&](std::string_view key, const bson_iter_t& at) {
            if (key == name && !found) found = Member{at};
        });
        return found;
    }
    /// The document or array of this name; none if there is none.
    [[nodiscard]] std::optional<Document> part(std::string_view name) const {
        const std::optional<Member> found = find(name);
        return found ? inside(found->at) : std::nullopt;
    }
    [[nodiscard]] std::optional<Document> inside(const bson_iter_t& at) const {
        Document part = *this;
        if (!(BSON_ITER_HOLDS_DOCUMENT(&at) || BSON_ITER_HOLDS_ARRAY(&at)) ||
            !bson_iter_recurse(&at, &part.begin_))
            return std::nullopt;
        return part;
    }
    [[nodiscard]] static std::string text(const bson_iter_t& at) {
        std::uint32_t length = 0;
        if (!BSON_ITER_HOLDS_UTF8(&at)) return {};
        const char* text = bson_iter_utf8(&at, &length);
        return text == nullptr ? std::string() : std::string(text, length);
    }
    [[nodiscard]] std::string text(std::string_view name) const {
        const std::optional<Member> found = find(name);
        return found ? text(found->at) : std::string();
    }
    /// The table in a member of bytes.
    [[nodiscard]] FloatTable table(const bson_iter_t& at) const {
        const std::size_t from = place(at.raw) + at.off;
        bson_subtype_t kind = BSON_SUBTYPE_BINARY;
        std::uint32_t length = 0;
        const std::uint8_t* bytes = nullptr;
        if (BSON_ITER_HOLDS_BINARY(&at)) bson_iter_binary(&at, &kind, &length, &bytes);
        if (bytes == nullptr) fail(from, "no bytes", "a table that fpzip compressed");
        FloatTable table = decompress_floats(file_.substr(place(bytes), length), *name_, place(bytes));
        // fpzip cannot write a table of few values: two rows of -1 make it longer.
        const auto filler = [&table](std::size_t row) {
            const auto begin = table.values.begin() + static_cast<std::ptrdiff_t>(row * table.columns);
            return std::all_of(begin, begin + static_cast<std::ptrdiff_t>(table.columns),
                               [](float value) { return value == -1; });
        };
        if (table.rows >= 2 && filler(table.rows - 1) && filler(table.rows - 2)) table.rows -= 2;
        return table;
    }

private:
    [[nodiscard]] std::size_t place(const std::uint8_t* byte) const {
        return static_cast<std::size_t>(reinterpret_cast<const char*>(byte) - file_.data());
    }

    std::string_view file_;
    const std::string* name_;
    bson_iter_t begin_;
};

struct Device {
    std::string name, type, joint;
    std::array<std::size_t, 3> position{};     ///< columns of x, y, z; 0: none
    std::array<std::size_t, 4> orientation{};  ///< of i, j, k, 1

    [[nodiscard]] bool has_position() const { return std::count(position.begin(), position.end(), 0) == 0; }
    [[nodiscard]] bool has_orientation() const {
        return std::count(orientation.begin(), orientation.end(), 0) == 0;
    }
    [[nodiscard]] bool on_head() const { return type == "HMD" || joint == "HEAD"; }
};

/// The devices with the columns of their axes; `columns` counts all.
std::vector<Device> read_devices(const Document& recording, std::size_t& columns) {
    const std::optional<Document> info = recording.part("info");
    const std::optional<Document> hardware = info ? info->part("hardware") : std::nullopt;
    const std::optional<Document> list = hardware ? hardware->part("devices") : std::nullopt;
    std::vector<Device> devices;
    columns = 1;
    if (!list) return devices;
    list->each([&](std::string_view, const bson_iter_t& at) {
        const std::optional<Document> entry = list->inside(at);
        const std::optional<Document> axes = entry ? entry->part("axes") : std::nullopt;
        if (!axes || devices.size() == kMostDevices) return;
        Device device{entry->text("name"), entry->text("type"), entry->text("joint"), {}, {}};
        axes->each([&](std::string_view, const bson_iter_t& axis) {
            constexpr std::string_view kPosition = "xyz", kOrientation = "ijk1";
            const std::string name = Document::text(axis);
            const std::size_t p = name.size() == 1 ? kPosition.find(name) : std::string_view::npos;
            const std::size_t q = name.size() == 1 ? kOrientation.find(name) : std::string_view::npos;
            if (p < 3) device.position[p] = columns;
            if (q < 4) device.orientation[q] = columns;
            ++columns;
        });
        devices.push_back(std::move(device));
    });
    return devices;
}

/// Those that become sticks, with the sticks' names.
std::vector<std::pair<std::string, Device>> choose_sticks(const std::vector<Device>& devices,
                                                          std::vector<std::string>& remarks) {
    std::vector<std::pair<std::string, Device>> sticks;
    for (const auto& [joint, stick] : {std::pair("HAND_LEFT", "left"), std::pair("HAND_RIGHT", "right")})
        for (const Device& device : devices)
            if (device.joint == joint && device.has_position() &&
                (sticks.empty() || sticks.back().first != stick))
                sticks.emplace_back(stick, device);
    std::set<std::string> names;
    for (const Device& device : devices) {
        if (!sticks.empty() && names.empty()) break;  // there are hands
        if (!device.has_position() || device.on_head() || sticks.size() == kMostSticks) continue;
        const std::string name = stick_word(device.name.empty() ? device.type : device.name);
        sticks.emplace_back(unique_name(name, "device", names.size() + 1, names), device);
    }
    if (devices.size() > sticks.size())
        remarks.push_back("left out " + std::to_string(devices.size() - sticks.size()) + " of " +
                          std::to_string(devices.size()) + " devices");
    return sticks;
}

std::string application_of(const Document& recording) {
    const std::optional<Document> info = recording.part("info");
    const std::optional<Document> software = info ? info->part("software") : std::nullopt;
    const std::optional<Document> app = software ? software->part("app") : std::nullopt;
    return app ? app->text("name") : std::string();
}

void remark_events(const Document& recording, std::vector<std::string>& remarks) {
    const std::optional<Document> events = recording.part("events");
    std::size_t kinds = 0;
    std::string names;
    if (events)
        events->each([&](std::string_view, const bson_iter_t& at) {
            const std::optional<Document> event = events->inside(at);
            if (!event || !event->find("floatData")) return;
            const std::string name = event->text("name");
            if (kinds++ < 8 && !name.empty()) names += (names.empty() ? ": " : ", ") + in_quotes(name);
        });
    if (kinds > 0) remarks.push_back("left out " + std::to_string(kinds) + " kinds of events" + names);
}

class Recording {
public:
    Recording(std::string_view bytes, const std::string& name) : document_(bytes, name) {
        trace_.file = name;
        trace_.shaft = -Eigen::Vector3d::UnitZ();
        const std::string application = application_of(document_);
        if (application == "Beat Saber") trace_.tip = Eigen::Vector3d(0, 0, -0.35);
        trace_.source = "Extended Reality Open Recording";
        if (!application.empty() && application.size() <= 100) trace_.source += ", " + printable(application);
        sticks_ = choose_sticks(read_devices(document_, columns_), trace_.remarks);
        const std::optional<Member> frames = document_.find("frames");
        if (!frames) document_.fail(bytes.size(), "no frames", "a table of them");
        at_ = static_cast<std::size_t>(reinterpret_cast<const char*>(frames->at.raw) - bytes.data()) +
              frames->at.off;
        if (sticks_.empty()) document_.fail(at_, "no device with axes x, y and z", "a hand, or another");
        table_ = document_.table(frames->at);
        if (table_.columns != columns_)
            document_.fail(at_, "frames of " + std::to_string(table_.columns) + " numbers",
                           "the time and the devices' axes, " + std::to_string(columns_));
    }

    Trace read() {
        std::vector<double> t_s;
        for (std::size_t k = 0; k < table_.rows; ++k) {
            t_s.push_back(table_.at(k, 0));
            if (!(std::abs(t_s.back()) <= kLatest))
                document_.fail(at_, "a time that is no number within 1e7 s in frame " + std::to_string(k),
                               "seconds");
        }
        const std::vector<std::size_t> kept = frames_that_count(
            t_s, sticks_.size(),
            [&](std::size_t k, std::size_t stick) { return position(k, sticks_[stick].second); },
            trace_.remarks);
        for (const auto& [stick, device] : sticks_) read_stick(stick, device, t_s, kept);
        remark_events(document_, trace_.remarks);
        return std::move(trace_);
    }

private:
    [[nodiscard]] Eigen::Vector3d position(std::size_t k, const Device& device) const {
        return {table_.at(k, device.position[0]), table_.at(k, device.position[1]),
                table_.at(k, device.position[2])};
    }

    void read_stick(const std::string& name, const Device& device, const std::vector<double>& t_s,
                    const std::vector<std::size_t>& kept) {
        StickTrace stick{name, {}};
        std::size_t untracked = 0;
        for (const std::size_t k : kept) {
            PoseSample sample;
            sample.t_s = t_s[k];
            sample.position = axes_ * position(k, device);
            if (!(sample.position.cwiseAbs().maxCoeff() <= kFarthest) || !sample.position.allFinite())
                document_.fail(at_,
                               "a position that is no number within 1000 m in frame " + std::to_string(k),
                               "metres");
            if (device.has_orientation() && !read_orientation(k, device, stick, sample)) {
                ++untracked;
                continue;
            }
            stick.samples.push_back(sample);
        }
        if (stick.samples.size() < 2)
            document_.fail(at_, std::to_string(stick.samples.size()) + " poses of " + in_quotes(name),
                           "at least two");
        if (untracked > 0)
            trace_.remarks.push_back("left out " + std::to_string(untracked) + " frames in which " + name +
                                     " was not tracked");
        trace_.sticks.push_back(std::move(stick));
    }

    /// False for four zeros.
    bool read_orientation(std::size_t k, const Device& device, const StickTrace& before, PoseSample& sample) {
        const std::array<std::size_t, 4>& c = device.orientation;
        const Eigen::Quaterniond q(table_.at(k, c[3]), table_.at(k, c[0]), table_.at(k, c[1]),
                                   table_.at(k, c[2]));
        const double norm = q.norm();
        if (norm == 0) return false;
        if (!(std::abs(norm - 1) <= kNormTolerance))
            document_.fail(
                at_, "a quaternion of length " + std::to_string(norm) + " in frame " + std::to_string(k),
                "length 1 within 1 %");
        sample.orientation = from_axes(axes_, q);
        sample.orientation.coeffs() /= norm;
        if (!before.samples.empty() && sample.orientation.dot(before.samples.back().orientation) < 0)
            sample.orientation.coeffs() *= -1;
        sample.has_orientation = true;
        return true;
    }

    Document document_;
    Trace trace_;
    std::vector<std::pair<std::string, Device>> sticks_;
    std::size_t columns_ = 0, at_ = 0;
    FloatTable table_;
    const Eigen::Matrix3d axes_ = *axes_of("unity");
};

}  // namespace

bool is_xror(std::string_view bytes) {
    constexpr std::size_t kBeginning = 4096;
    constexpr std::string_view kInfo("\x03info\0", 6), kSchema("\x02$schema\0", 9);
    if (bytes.size() < 8 || bytes[4] < 1 || bytes[4] > 0x13) return false;
    const std::string_view beginning = bytes.substr(4, kBeginning);
    return beginning.find(kInfo) != std::string_view::npos ||
           beginning.find(kSchema) != std::string_view::npos;
}

Trace parse_xror(std::string_view bytes, const std::string& name) {
    return Recording(bytes, name).read();
}

}  // namespace tracking
