#include "traces/predict.h"

#include <algorithm>
#include <memory>
#include <tuple>
#include <utility>
#include <vector>

#include "report/table.h"
#include "sticks/predictors.h"

namespace app {
namespace {

struct Row {
    double sample_t_s;
    std::size_t stick;
    tracking::PoseSample predicted;  // t_s: the time predicted for
};

/// Appends a row for every sample of a stick that is newer than all before it, but the first.
void predict_stick(const tracking::StickTrace& stick, std::size_t index, tracking::Predictor& predictor,
                   double lead_s, std::vector<Row>& rows) {
    bool oriented = false;
    double newest_s = 0;
    bool first = true;
    for (const tracking::PoseSample& sample : stick.samples) {
        const double behind_s = tracking::feed(predictor, sample);
        oriented = oriented || sample.has_orientation;
        if (!first && !(sample.t_s > newest_s)) continue;
        newest_s = sample.t_s;
        if (std::exchange(first, false)) continue;
        const tracking::PosePrediction pose = predictor.predict(lead_s + behind_s);
        rows.push_back({newest_s, index, {newest_s + lead_s, pose.position, pose.orientation, oriented}});
    }
}

}  // namespace

std::string predict_table(const tracking::Trace& seen, const std::string& specification, double lead_s,
                          std::vector<tracking::Experience>* learned) {
    const std::vector<double> leads = {lead_s};
    std::vector<Row> rows;
    for (std::size_t i = 0; i < seen.sticks.size(); ++i) {
        const std::unique_ptr<tracking::Predictor> predictor =
            make_any_predictor(picture_specification(specification), leads,
                               {seen.sticks[i].name, seen.shaft.value_or(-Eigen::Vector3d::UnitZ())});
        predict_stick(seen.sticks[i], i, *predictor, lead_s, rows);
        if (learned == nullptr) continue;
        if (std::optional<tracking::Experience> one =
                tracking::experience_of(*predictor, seen.sticks[i].name))
            learned->push_back(std::move(*one));
    }
    // A stick's times differ. (stable_sort's buffer is not aligned for what holds Eigen's types.)
    std::ranges::sort(rows, {}, [](const Row& row) { return std::tuple(row.sample_t_s, row.stick); });
    std::string table = predicted_row_header();
    for (const Row& row : rows) table += predicted_row(seen.sticks[row.stick].name, row.predicted);
    return table;
}

std::string predicted_row_header() {
    return csv_line({"t", "stick", "px", "py", "pz", "qw", "qx", "qy", "qz"});
}

std::string predicted_row(const std::string& stick, const tracking::PoseSample& predicted) {
    const Eigen::Vector3d& p = predicted.position;
    const Eigen::Quaterniond& q = predicted.orientation;
    const auto turn = [&](double part) { return predicted.has_orientation ? Cell(part) : Cell(); };
    return csv_line(
        {predicted.t_s, stick, p.x(), p.y(), p.z(), turn(q.w()), turn(q.x()), turn(q.y()), turn(q.z())});
}

}  // namespace app
