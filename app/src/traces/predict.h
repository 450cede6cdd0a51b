#pragma once
#include <tracking/experience.h>
#include <tracking/trace.h>

#include <string>
#include <vector>

namespace app {

/// What a predictor makes of the samples of a trace, as text: the columns t,stick,px,py,pz,qw,qx,qy,qz of the
/// tracked point (metres, y up), t the time predicted for. A row for every sample from each stick's second
/// on, in order of arrival; samples that are not newer than one before them (the estimators ignore these) get
/// none. t is the sample's time + lead, also where a sample was refused as an outlier. The q columns are
/// empty until a stick has shown an orientation. Numbers read back to the same double; the text is a trace
/// itself.
///
///   seen           samples of each stick in the order of arrival
///   specification  any of make_any_predictor; `auto` means the picture's
///   lead_s         >= 0
///   learned        gets what each stick has taught the predictor, if that learns
///
/// Throws BadInput for the specification, std::runtime_error when an external predictor fails.
[[nodiscard]] std::string predict_table(const tracking::Trace& seen, const std::string& specification,
                                        double lead_s, std::vector<tracking::Experience>* learned = nullptr);

/// A row of it, and what stands above the rows; `predicted.t_s` is the time predicted for.
[[nodiscard]] std::string predicted_row(const std::string& stick, const tracking::PoseSample& predicted);
[[nodiscard]] std::string predicted_row_header();

}  // namespace app
