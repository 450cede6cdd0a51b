#pragma once
#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

namespace render {

/// Pixels left <= x < right, bottom <= y < top, counted as OpenGL's windows: y up. Empty by default.
struct PixelBox {
    int left = 0, bottom = 0, right = 0, top = 0;
    [[nodiscard]] bool empty() const { return left >= right || bottom >= top; }
    [[nodiscard]] int area() const { return empty() ? 0 : (right - left) * (top - bottom); }
    [[nodiscard]] bool meets(const PixelBox& other) const;
    void include(const PixelBox& other);
};

/// Corners of the convex hull of points, counter-clockwise.
[[nodiscard]] std::vector<Eigen::Vector2f> convex_hull(std::vector<Eigen::Vector2f> points);

/// Which of a picture's tiles (4 x 4 pixels, as the rasteriser shades them; those at the right and the top
/// cut off by its edges) are meant.
class TileMask {
public:
    static constexpr int kTile = 4;  ///< [pixels]

    TileMask(int width, int height);

    void clear();
    void fill();
    [[nodiscard]] bool empty() const;

    struct Columns {
        int first, last;  ///< none: first > last
    };
    /// Of a mask of one size, the tiles that a convex polygon touches.
    struct Cover {
        int first_row = 0;
        std::vector<Columns> rows = {};
    };
    /// Of the convex polygon (pixels) grown by `kGrown`.
    [[nodiscard]] Cover cover(std::span<const Eigen::Vector2f> hull) const;
    void add(const Cover& cover);
    void add(std::span<const Eigen::Vector2f> hull) { add(cover(hull)); }
    /// Adds what the convex polygon and the cover have in common.
    void add_common(std::span<const Eigen::Vector2f> hull, const Cover& cover);
    void add(const TileMask& other);
    /// Keeps the tiles that the other mask has (or, with false, has not).
    void keep(const TileMask& other, bool marked);

    /// Boxes, few and not much too large, around the mask's tiles of a cover.
    [[nodiscard]] std::vector<PixelBox> touched(const Cover& cover) const;
    [[nodiscard]] PixelBox bounds() const;
    /// The mask as boxes that do not meet: runs of a row, joined with equal ones of the rows above.
    [[nodiscard]] std::vector<PixelBox> runs() const;

    /// Rounding of vertices, and of the rasteriser's places to 1/256 pixel, stays far below it. [pixels]
    static constexpr float kGrown = 0.25f;

private:
    void add_runs(int row, Columns within, std::vector<PixelBox>& found) const;
    [[nodiscard]] std::pair<int, int> rows(std::span<const Eigen::Vector2f> hull) const;
    [[nodiscard]] std::vector<Columns> columns(std::span<const Eigen::Vector2f> hull, int first_row,
                                               int last_row) const;
    [[nodiscard]] PixelBox box(int first, int last, int row) const;

    int width_, height_, columns_, rows_;
    std::vector<std::uint8_t> marked_;  ///< [row * columns + column]
};

}  // namespace render
