#include "compare/sample_errors.h"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <cerrno>
#include <cstring>
#include <numbers>
#include <stdexcept>

#include "report/table.h"

namespace app {

SampleRows::SampleRows(const SensedStick& stick, const std::string& trace, const std::string& person,
                       const std::string& predictor)
    : stick_(stick), before_(csv_line({trace, person, stick.name, predictor})) {
    before_.back() = ',';
}

std::string SampleRows::header() {
    return csv_line({"trace", "person", "stick", "predictor", "lead_s", "t", "error_mm", "ex_mm", "ey_mm",
                     "ez_mm", "tip_mm", "rotation_deg", "deviations", "free", "unflagged"});
}

void SampleRows::add(std::size_t sample, std::size_t lead, const tracking::PosePrediction& predicted,
                     const std::optional<tracking::PoseCovariance>& covariance) {
    constexpr double kMillimetres = 1e3, kDegreesPerRad = 180 / std::numbers::pi;
    const Truth& truth = *stick_.truth(sample, lead);
    const Eigen::Vector3d error = predicted.position - truth.pose.position;
    Cell tip, rotation, deviations;
    if (truth.rotation_trusted) {
        const Eigen::Vector3d of_tip =
            error + predicted.orientation * stick_.tip - truth.pose.orientation * stick_.tip;
        tip = kMillimetres * of_tip.norm();
        rotation = kDegreesPerRad * predicted.orientation.angularDistance(truth.pose.orientation);
    }
    if (covariance)
        if (const Eigen::LLT<Eigen::Matrix3d> root(covariance->position); root.info() == Eigen::Success)
            deviations = root.matrixL().solve(error).norm();
    const auto digits = [](const Cell& cell) { return Cell(cell.shown(".4f", "")); };
    text_ += before_;
    text_ += csv_line({stick_.leads_s[lead], stick_.samples[sample].t_s, digits(kMillimetres * error.norm()),
                       digits(kMillimetres * error.x()), digits(kMillimetres * error.y()),
                       digits(kMillimetres * error.z()), digits(tip), digits(rotation), digits(deviations),
                       truth.free, truth.unflagged});
}

OrderedFile::OrderedFile(const std::filesystem::path& file, const std::string& header)
    : file_(file), out_(file_.partial(), std::ios::binary) {
    out_ << header;
    check();
}

void OrderedFile::add(std::size_t part, std::string text) {
    const std::lock_guard lock(mutex_);
    waiting_.emplace(part, std::move(text));
    for (auto first = waiting_.begin(); first != waiting_.end() && first->first == next_; ++next_) {
        out_ << first->second;
        first = waiting_.erase(first);
    }
    check();
}

void OrderedFile::finish() {
    out_.close();
    check();
    file_.finish();
}

void OrderedFile::check() {
    if (!out_)
        throw std::runtime_error(
            fmt::format("error: cannot write {}: {}; free some space or name another file",
                        file_.partial().string(), std::strerror(errno)));
}

}  // namespace app
