#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <unordered_map>

#include "trace/column_finder.h"
#include "trace/iso_time.h"
#include "trace/orientation_forms.h"
#include "trace/stick_names.h"
#include "trace/table_lines.h"
#include "trace/trace_limits.h"
#include "tracking/import.h"

namespace tracking {
namespace {

constexpr double kLargest = 1e19;  // of a time or frame as the file has it

/// One stick while tables are read.
struct Reading {
    StickTrace trace;
    std::size_t not_seen = 0;
    std::size_t last_line = 0;
    const std::string* last_file = nullptr;
};

bool is_empty(std::string_view text) {
    return text.empty() || text == "NaN" || text == "nan" || text == "NAN";
}

double metres_per_unit(const ColumnMap& map) {
    return map.metres_per_unit.value_or(map.frame == "unreal" ? 1e-2 : 1);
}

class TablesReader {
public:
    explicit TablesReader(const ColumnMap& map)
        : map_(map), axes_(map.frame.empty() ? std::nullopt : axes_of(map.frame)) {}

    void read(const Table& table) {
        table_ = &table;
        std::string_view text = table.text;
        if (text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);
        LineReader lines(text, table.name);
        const TableHead head = read_head(lines, map_, table.name);
        columns_ = find_columns(map_, head.names, head.header);
        scale_ = head.metres_per_unit.value_or(metres_per_unit(map_));
        rate_ = map_.rate_hz > 0 ? map_.rate_hz : head.rate_hz.value_or(0);
        if (columns_.time == TableColumns::kNone && !(rate_ > 0))
            head.header.fail(0, "neither a column of times nor a rate", "one of them",
                             "say the rate with --rate HZ, or map t=COLUMN");
        read_rows(lines);
    }

    Trace finish(const std::vector<Table>& tables) {
        Trace trace;
        trace.file = tables.front().name;
        trace.rate_hz = rate_;
        trace.tip = map_.tip;
        trace.shaft = map_.shaft;
        for (Reading& stick : sticks_) {
            if (stick.not_seen > 0)
                trace.remarks.push_back("left out " + std::to_string(stick.not_seen) + " rows in which " +
                                        stick.trace.name + " was not seen");
            if (stick.trace.samples.size() < 2)
                Line(trace.file, 1, "")
                    .fail(0,
                          std::to_string(stick.trace.samples.size()) + " samples of stick " +
                              in_quotes(stick.trace.name),
                          "at least two samples a stick", "leave the stick out of the map");
            trace.sticks.push_back(std::move(stick.trace));
        }
        if (trace.sticks.empty())
            Line(trace.file, 1, "").fail(0, "no rows", "at least two", "check that the table is complete");
        return trace;
    }

private:
    void read_rows(LineReader& lines) {
        std::size_t row = 0;
        while (!lines.at_end()) {
            const Line line = lines.next();
            const std::string_view text = trimmed(line.text());
            if (text.empty() && lines.only_blank_left()) break;
            if (!text.empty() && map_.comment != 0 && text.front() == map_.comment) continue;
            line.require_text();
            cells_.clear();
            split_cells(line, map_.separator, cells_);
            if (cells_.size() < columns_.count)
                line.fail(line.text().size(), std::to_string(cells_.size()) + " columns",
                          "at least " + std::to_string(columns_.count), "complete or delete the line");
            read_row(line, row++);
        }
    }

    void read_row(const Line& line, std::size_t row) {
        const double t = time_of(line, row);
        for (const StickColumns& columns : columns_.sticks) {
            Reading& stick = stick_of(line, columns);
            PoseSample sample;
            sample.t_s = t;
            if (!read_position(line, columns, sample)) {
                ++stick.not_seen;
                continue;
            }
            require_later(line, stick, t);
            read_orientation(line, columns, stick, sample);
            stick.trace.samples.push_back(sample);
            stick.last_line = line.number();
            stick.last_file = &table_->name;
        }
    }

    double number(const Line& line, SignedColumn column, const char* what, double limit,
                  const char* limit_text) {
        return column.sign * number(line, column.index, what, limit, limit_text);
    }

    double number(const Line& line, std::size_t column, const char* what, double limit,
                  const char* limit_text) {
        const Field& cell = cells_[column];
        const std::size_t comma = cell.text.find(',');
        if (comma != std::string_view::npos && !map_.decimal_comma)
            line.fail(cell.offset, in_quotes(cell.text), std::string(what) + " with a decimal point",
                      "say that its sign is a comma (--decimal comma)");
        if (comma == std::string_view::npos) return line.number_in(cell, what, limit, limit_text);
        std::string text(cell.text);
        std::replace(text.begin(), text.end(), ',', '.');
        return line.number_in({text, cell.offset}, what, limit, limit_text);
    }

    double time_of(const Line& line, std::size_t row) {
        if (columns_.time == TableColumns::kNone) return frame_time(line, row);
        const Field& cell = cells_[columns_.time];
        if (const std::optional<IsoTime> clock = iso_time(cell.text)) return clock_time(line, cell, *clock);
        if (first_clock_)
            line.fail(cell.offset, in_quotes(cell.text), "an ISO 8601 time, as in the rows before",
                      "write all times in one way");
        const double raw = number(line, columns_.time, "a time", kLargest, "1e19");
        if (!first_raw_) first_raw_ = map_.from_zero ? raw : 0;
        return checked(line, cell.offset, (raw - *first_raw_) * map_.seconds_per_unit);
    }

    double frame_time(const Line& line, std::size_t row) {
        const bool counted = columns_.frame != TableColumns::kNone;
        const double raw = counted ? number(line, columns_.frame, "a frame's number", kLargest, "1e19")
                                   : static_cast<double>(row);
        if (!first_raw_) first_raw_ = raw;
        return checked(line, counted ? cells_[columns_.frame].offset : 0, (raw - *first_raw_) / rate_);
    }

    double clock_time(const Line& line, const Field& cell, const IsoTime& clock) {
        if (first_raw_)
            line.fail(cell.offset, in_quotes(cell.text), "a number, as in the rows before",
                      "write all times in one way");
        if (!first_clock_) first_clock_ = clock;
        if (clock.form != first_clock_->form)
            line.fail(cell.offset, in_quotes(cell.text), "a date and a zone where the rows before have them",
                      "write all times in one way");
        return checked(line, cell.offset, seconds_between(*first_clock_, clock));
    }

    static double checked(const Line& line, std::size_t offset, double t) {
        if (!(std::abs(t) <= kLatest))
            line.fail(offset, "a time of " + std::to_string(t) + " s", "at most 1e7 s in size",
                      "say the unit of time, or let times count from the first row");
        return t;
    }

    Reading& stick_of(const Line& line, const StickColumns& columns) {
        std::string name = stick_word(columns.stick.empty() ? table_->stick : columns.stick);
        std::size_t offset = 0;
        if (columns_.stick != TableColumns::kNone) {
            name = stick_word(cells_[columns_.stick].text);
            offset = cells_[columns_.stick].offset;
        }
        if (name.empty()) line.fail(offset, "no stick name", "a word", "name the stick");
        const auto [place, fresh] = index_.emplace(name, sticks_.size());
        if (fresh) {
            if (sticks_.size() >= kMostSticks)
                line.fail(offset, "more than 64 sticks", "fewer", "check the map's stick column");
            sticks_.push_back({{name, {}}, 0, 0, nullptr});
        }
        return sticks_[place->second];
    }

    void require_later(const Line& line, const Reading& stick, double t) const {
        if (stick.trace.samples.empty() || t > stick.trace.samples.back().t_s) return;
        const std::string where =
            stick.last_file == &table_->name ? "" : " of " + printable(*stick.last_file);
        const std::size_t column = columns_.time != TableColumns::kNone    ? columns_.time
                                   : columns_.frame != TableColumns::kNone ? columns_.frame
                                                                           : TableColumns::kNone;
        line.fail(column == TableColumns::kNone ? 0 : cells_[column].offset,
                  "time " + std::to_string(t) + " s of stick " + in_quotes(stick.trace.name),
                  "later than that of line " + std::to_string(stick.last_line) + where,
                  "sort the table, delete repeated rows, or name the sticks apart");
    }

    /// False if the stick was not seen.
    bool read_position(const Line& line, const StickColumns& columns, PoseSample& sample) {
        const auto empty = [this](SignedColumn column) { return is_empty(cells_[column.index].text); };
        if (std::all_of(columns.position.begin(), columns.position.end(), empty)) return false;
        for (std::size_t i = 0; i < 3; ++i) {
            const double value =
                number(line, columns.position[i], "a coordinate", kFarthest / scale_, "1000 m");
            sample.position[static_cast<Eigen::Index>(i)] =
                scale_ < 1 ? value / (1 / scale_) : value * scale_;
        }
        if (map_.zero_is_lost && sample.position.isZero(0)) return false;
        if (map_.z_up) sample.position = from_z_up(sample.position);
        if (axes_) sample.position = *axes_ * sample.position;
        return true;
    }

    void read_orientation(const Line& line, const StickColumns& columns, const Reading& stick,
                          PoseSample& sample) {
        const bool left_out =
            std::all_of(columns.orientation.begin(), columns.orientation.end(),
                        [this](SignedColumn column) { return is_empty(cells_[column.index].text); });
        const std::vector<PoseSample>& before = stick.trace.samples;
        if (left_out) {
            if (!before.empty()) sample.orientation = before.back().orientation;
            return;
        }
        Eigen::Quaterniond q = orientation(line, columns);
        if (map_.z_up) q = from_z_up(q);
        if (axes_) q = from_axes(*axes_, q);
        if (!before.empty() && q.dot(before.back().orientation) < 0) q.coeffs() = -q.coeffs();
        sample.orientation = q;
        sample.has_orientation = true;
    }

    Eigen::Quaterniond orientation(const Line& line, const StickColumns& columns) {
        if (columns.kind == OrientationColumns::quaternion) return quaternion(line, columns.orientation);
        if (columns.kind == OrientationColumns::matrix) return matrix(line, columns.orientation);
        Eigen::Vector3d angles;
        for (std::size_t i = 0; i < 3; ++i)
            angles[static_cast<Eigen::Index>(i)] =
                number(line, columns.orientation[i], "an Euler angle", kLargestAngle, "1e6");
        if (!map_.radians) angles *= std::numbers::pi / 180;
        return from_euler(angles, map_.euler).normalized();
    }

    Eigen::Quaterniond quaternion(const Line& line, const std::vector<SignedColumn>& columns) {
        double c[4];
        for (std::size_t i = 0; i < 4; ++i)
            c[i] = number(line, columns[i], "a component of a unit quaternion", 1 + kNormTolerance, "1.01");
        const Eigen::Quaterniond q(c[0], c[1], c[2], c[3]);
        if (std::abs(q.norm() - 1) > kNormTolerance)
            line.fail(cells_[columns[0].index].offset, "a quaternion of norm " + std::to_string(q.norm()),
                      "norm 1 within 1 %", "check that the map names the four components' columns");
        return q.normalized();
    }

    Eigen::Quaterniond matrix(const Line& line, const std::vector<SignedColumn>& columns) {
        Eigen::Matrix3d m;
        for (std::size_t i = 0; i < 9; ++i)
            m(static_cast<Eigen::Index>(i / 3), static_cast<Eigen::Index>(i % 3)) =
                number(line, columns[i], "a component of a rotation matrix", 1 + kNormTolerance, "1.01");
        const double off = (m.transpose() * m - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff();
        const std::size_t offset = cells_[columns[0].index].offset;
        if (!(off <= kNormTolerance))
            line.fail(offset, "a matrix whose columns are not of length 1 at right angles",
                      "a rotation matrix", "check that the map names its nine columns");
        if (m.determinant() < 0)
            line.fail(offset, "a matrix of determinant -1", "a rotation matrix, determinant 1",
                      "export right-handed axes: this one is mirrored");
        return Eigen::Quaterniond(m).normalized();
    }

    const ColumnMap& map_;
    const std::optional<Eigen::Matrix3d> axes_;
    const Table* table_ = nullptr;
    TableColumns columns_;
    double scale_ = 1, rate_ = 0;
    std::optional<double> first_raw_;
    std::optional<IsoTime> first_clock_;
    std::vector<Field> cells_;
    std::vector<Reading> sticks_;
    std::unordered_map<std::string, std::size_t> index_;
};

}  // namespace

Trace read_tables(const std::vector<Table>& tables, const ColumnMap& map) {
    map.check();
    if (tables.empty()) throw std::invalid_argument("tables: error: found none, expected at least one");
    TablesReader reader(map);
    for (const Table& table : tables) reader.read(table);
    return reader.finish(tables);
}

}  // namespace tracking
