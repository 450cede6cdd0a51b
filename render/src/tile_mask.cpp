#include "tile_mask.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace render {
namespace {

/// A box may take in this much more for a run of tiles [pixels]: drawing it costs as much as one more pass
/// over an object's triangles.
constexpr int kMostWaste = 2048;

float cross(const Eigen::Vector2f& o, const Eigen::Vector2f& a, const Eigen::Vector2f& b) {
    return (a.x() - o.x()) * (b.y() - o.y()) - (a.y() - o.y()) * (b.x() - o.x());
}

}  // namespace

bool PixelBox::meets(const PixelBox& other) const {
    return left < other.right && other.left < right && bottom < other.top && other.bottom < top;
}

void PixelBox::include(const PixelBox& other) {
    if (other.empty()) return;
    if (empty()) {
        *this = other;
        return;
    }
    left = std::min(left, other.left), bottom = std::min(bottom, other.bottom);
    right = std::max(right, other.right), top = std::max(top, other.top);
}

// Andrew's monotone chain.
std::vector<Eigen::Vector2f> convex_hull(std::vector<Eigen::Vector2f> points) {
    std::sort(points.begin(), points.end(), [](const Eigen::Vector2f& a, const Eigen::Vector2f& b) {
        return a.x() < b.x() || (a.x() == b.x() && a.y() < b.y());
    });
    if (points.size() < 3) return points;
    std::vector<Eigen::Vector2f> hull;
    const auto extend = [&hull](const Eigen::Vector2f& point, std::size_t keep) {
        while (hull.size() > keep && cross(hull[hull.size() - 2], hull.back(), point) <= 0) hull.pop_back();
        hull.push_back(point);
    };
    for (const Eigen::Vector2f& point : points) extend(point, 1);
    const std::size_t lower = hull.size();
    for (auto point = points.rbegin() + 1; point != points.rend(); ++point) extend(*point, lower);
    hull.pop_back();
    return hull;
}

TileMask::TileMask(int width, int height)
    : width_(width),
      height_(height),
      columns_((width + kTile - 1) / kTile),
      rows_((height + kTile - 1) / kTile),
      marked_(static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_)) {}

void TileMask::clear() {
    std::fill(marked_.begin(), marked_.end(), std::uint8_t{0});
}

void TileMask::fill() {
    std::fill(marked_.begin(), marked_.end(), std::uint8_t{1});
}

bool TileMask::empty() const {
    return std::find(marked_.begin(), marked_.end(), std::uint8_t{1}) == marked_.end();
}

/// The first and the last row of tiles that the polygon may touch.
std::pair<int, int> TileMask::rows(std::span<const Eigen::Vector2f> hull) const {
    if (hull.empty()) return {0, -1};
    const auto [lowest, highest] = std::minmax_element(
        hull.begin(), hull.end(), [](const auto& a, const auto& b) { return a.y() < b.y(); });
    const auto row = [&](float y) {
        return static_cast<int>(std::clamp(std::floor(y / kTile), -1.0f, static_cast<float>(rows_)));
    };
    return {std::max(row(lowest->y() - kGrown) - 1, 0), std::min(row(highest->y() + kGrown) + 1, rows_ - 1)};
}

/// Columns of tiles that the polygon touches in rows of tiles: the range of x of its part in each row's band.
std::vector<TileMask::Columns> TileMask::columns(std::span<const Eigen::Vector2f> hull, int first_row,
                                                 int last_row) const {
    struct Range {
        float least = std::numeric_limits<float>::infinity(), most = -least;
    };
    std::vector<Range> ranges(static_cast<std::size_t>(std::max(last_row - first_row + 1, 0)));
    const auto row_of = [&](float y) {
        return static_cast<int>(std::clamp(std::floor(y / kTile), static_cast<float>(first_row - 1),
                                           static_cast<float>(last_row + 1)));
    };
    for (std::size_t i = 0; i < hull.size(); ++i) {
        const Eigen::Vector2f &a = hull[i], &b = hull[i + 1 < hull.size() ? i + 1 : 0];
        const float rise = b.y() - a.y(), slope = rise == 0 ? 0 : (b.x() - a.x()) / rise;
        const float lowest = std::min(a.y(), b.y()), highest = std::max(a.y(), b.y());
        const float left = std::min(a.x(), b.x()), right = std::max(a.x(), b.x());
        const int from = std::max(first_row, row_of(lowest - kGrown) - 1),
                  to = std::min(last_row, row_of(highest + kGrown) + 1);
        for (int row = from; row <= to; ++row) {
            const float low = static_cast<float>(row * kTile) - kGrown,
                        high = static_cast<float>((row + 1) * kTile) + kGrown;
            if (highest < low || lowest > high) continue;
            Range& range = ranges[static_cast<std::size_t>(row - first_row)];
            if (rise == 0) {
                range = {std::min(range.least, left), std::max(range.most, right)};
                continue;
            }
            for (const float y : {std::max(low, lowest), std::min(high, highest)}) {
                const float x = std::clamp(a.x() + (y - a.y()) * slope, left, right);
                range = {std::min(range.least, x), std::max(range.most, x)};
            }
        }
    }
    const auto column = [&](float x) {
        return static_cast<int>(std::clamp(std::floor(x / kTile), -1.0f, static_cast<float>(columns_)));
    };
    std::vector<Columns> found;
    found.reserve(ranges.size());
    for (const Range& range : ranges) {
        if (range.least <= range.most)
            found.push_back({std::max(column(range.least - kGrown), 0),
                             std::min(column(range.most + kGrown), columns_ - 1)});
        else
            found.push_back({0, -1});
    }
    return found;
}

TileMask::Cover TileMask::cover(std::span<const Eigen::Vector2f> hull) const {
    const auto [first, last] = rows(hull);
    return {first, columns(hull, first, last)};
}

void TileMask::add(const Cover& cover) {
    for (std::size_t row = 0; row < cover.rows.size(); ++row) {
        const auto [first, last] = cover.rows[row];
        const int start = (cover.first_row + static_cast<int>(row)) * columns_ + first;
        if (first <= last) std::fill_n(marked_.begin() + start, last - first + 1, 1);
    }
}

void TileMask::add_common(std::span<const Eigen::Vector2f> hull, const Cover& cover) {
    const auto [first, last] = rows(hull);
    const int first_row = std::max(first, cover.first_row),
              last_row = std::min(last, cover.first_row + static_cast<int>(cover.rows.size()) - 1);
    if (first_row > last_row) return;
    Cover common{first_row, columns(hull, first_row, last_row)};
    for (std::size_t row = 0; row < common.rows.size(); ++row) {
        const Columns& other = cover.rows[row + static_cast<std::size_t>(first_row - cover.first_row)];
        common.rows[row] = {std::max(common.rows[row].first, other.first),
                            std::min(common.rows[row].last, other.last)};
    }
    add(common);
}

void TileMask::add(const TileMask& other) {
    for (std::size_t i = 0; i < marked_.size(); ++i) marked_[i] |= other.marked_[i];
}

void TileMask::keep(const TileMask& other, bool marked) {
    const std::uint8_t kept = marked ? 1 : 0;
    for (std::size_t i = 0; i < marked_.size(); ++i)
        marked_[i] = static_cast<std::uint8_t>(marked_[i] & (other.marked_[i] == kept ? 1 : 0));
}

PixelBox TileMask::box(int first, int last, int row) const {
    return {first * kTile, row * kTile, std::min((last + 1) * kTile, width_),
            std::min((row + 1) * kTile, height_)};
}

/// Boxes of neighbouring marked tiles of a row.
void TileMask::add_runs(int row, Columns within, std::vector<PixelBox>& found) const {
    const auto marks = marked_.begin() + row * columns_;
    for (int first = within.first; first <= within.last; ++first) {
        if (marks[first] == 0) continue;
        int last = first;
        while (last < within.last && marks[last + 1] != 0) ++last;
        found.push_back(box(first, last, row));
        first = last;
    }
}

std::vector<PixelBox> TileMask::touched(const Cover& cover) const {
    std::vector<PixelBox> boxes, runs;
    for (std::size_t row = 0; row < cover.rows.size(); ++row) {
        runs.clear();
        add_runs(cover.first_row + static_cast<int>(row), cover.rows[row], runs);
        for (const PixelBox& run : runs) {
            PixelBox* best = nullptr;
            int least = kMostWaste + 1;
            for (PixelBox& box : boxes) {
                PixelBox both = box;
                both.include(run);
                const int waste = both.area() - box.area() - run.area();
                if (waste < least) best = &box, least = waste;
            }
            if (best == nullptr)
                boxes.push_back(run);
            else
                best->include(run);
        }
    }
    return boxes;
}

PixelBox TileMask::bounds() const {
    PixelBox all;
    for (const PixelBox& run : runs()) all.include(run);
    return all;
}

std::vector<PixelBox> TileMask::runs() const {
    std::vector<PixelBox> found, row_runs;
    std::vector<std::size_t> below, here;  // boxes that end with the row before, and with this one
    for (int row = 0; row < rows_; ++row) {
        row_runs.clear(), here.clear();
        add_runs(row, {0, columns_ - 1}, row_runs);
        for (const PixelBox& run : row_runs) {
            const auto same = std::ranges::find_if(below, [&](std::size_t i) {
                return found[i].left == run.left && found[i].right == run.right;
            });
            here.push_back(same == below.end() ? found.size() : *same);
            if (same == below.end())
                found.push_back(run);
            else
                found[*same].top = run.top;
        }
        std::swap(below, here);
    }
    return found;
}

}  // namespace render
