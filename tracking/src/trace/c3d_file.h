#pragma once
#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace tracking {

/// The 3D points of a C3D file (c3d.org, "The C3D File Format User Guide"): integer or floating-point frames
/// written by Intel, DEC or MIPS processors. Analog channels are skipped. Of the parameters it reads
/// POINT:USED, SCALE, RATE, UNITS, FRAMES, LONG_FRAMES, LABELS, LABELS2 .., DATA_START, X_SCREEN and
/// Y_SCREEN, and TRIAL:ACTUAL_START_FIELD and ACTUAL_END_FIELD; where there are none, the header's values.
///
/// `bytes` and `name` must outlive it. Throws TraceError with the byte of the fault. Memory is bounded by the
/// file's size; points are read where they lie.
class C3dFile {
public:
    C3dFile(std::string_view bytes, const std::string& name);

    [[nodiscard]] const std::vector<std::string>& labels() const { return labels_; }  ///< one a point
    [[nodiscard]] std::size_t frames() const { return frames_; }
    [[nodiscard]] double rate_hz() const { return rate_hz_; }
    /// Of coordinates; none where UNITS names no length.
    [[nodiscard]] std::optional<double> metres_per_unit() const { return metres_per_unit_; }
    /// Takes the file's coordinates to ours: the axis that Y_SCREEN names points up, z where it names
    /// none, and that of X_SCREEN to the right; their signs do not count.
    [[nodiscard]] const Eigen::Matrix3d& axes() const { return axes_; }

    /// As the file has it, in its units and axes; none where it was not seen (a residual below zero, or NaN).
    [[nodiscard]] std::optional<Eigen::Vector3d> point(std::size_t frame, std::size_t which) const;
    /// Where the point lies, for messages.
    [[nodiscard]] std::size_t byte_of(std::size_t frame, std::size_t which) const;

private:
    enum class Processor { intel = 84, dec = 85, mips = 86 };
    /// The values of a parameter: `count` of `type` (-1 text, 1 byte, 2 integer, 4 real) from byte `at` on.
    struct Parameter {
        int type = 0;
        std::array<std::size_t, 2> size{1, 1};  ///< first dimension, product of the others
        std::size_t at = 0;
    };

    [[nodiscard]] unsigned byte(std::size_t at) const { return static_cast<std::uint8_t>(bytes_[at]); }
    [[nodiscard]] unsigned word(std::size_t at) const;
    [[nodiscard]] int integer(std::size_t at) const { return static_cast<std::int16_t>(word(at)); }
    [[nodiscard]] double real(std::size_t at) const;
    void require(std::size_t at, std::size_t count, const char* what) const;
    void read_parameters(std::size_t at);
    Parameter read_parameter(std::size_t at) const;
    [[nodiscard]] const Parameter* find(const std::string& name) const;
    /// The i-th number of a parameter (integers unsigned).
    [[nodiscard]] std::optional<double> number(const std::string& name, std::size_t i = 0) const;
    /// Where the first number of a parameter lies; `header` where there is none.
    [[nodiscard]] std::size_t place_of(const std::string& name, std::size_t header) const;
    [[nodiscard]] std::string text(const std::string& name, std::size_t i = 0) const;
    void read_points();
    void read_labels();
    void read_axes();
    [[nodiscard]] double count_of_frames() const;

    std::string_view bytes_;
    const std::string& name_;
    Processor processor_ = Processor::intel;
    std::map<std::string, Parameter> parameters_;
    std::vector<std::string> labels_;
    std::size_t points_ = 0, frames_ = 0, data_at_ = 0, frame_bytes_ = 0, word_bytes_ = 2;
    double rate_hz_ = 0, scale_ = 1;
    std::optional<double> metres_per_unit_;
    Eigen::Matrix3d axes_ = Eigen::Matrix3d::Identity();
};

}  // namespace tracking
