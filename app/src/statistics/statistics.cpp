#include "statistics/statistics.h"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace app {

double median(std::vector<double> values) {
    if (values.empty()) return 0;
    std::sort(values.begin(), values.end());
    const std::size_t half = values.size() / 2;
    return values.size() % 2 == 1 ? values[half] : (values[half - 1] + values[half]) / 2;
}

double nearest_rank(std::vector<double> values, double percent) {
    assert(percent > 0 && percent <= 100 && "a percentile lies in (0, 100]");
    if (values.empty()) return 0;
    // Multiplied before it is divided: 95 * 20 / 100 is 19 exactly, 0.95 * 20 may round up beyond it.
    const auto rank = static_cast<std::size_t>(std::ceil(percent * static_cast<double>(values.size()) / 100));
    const auto nth = values.begin() + static_cast<std::ptrdiff_t>(std::max<std::size_t>(rank, 1) - 1);
    std::nth_element(values.begin(), nth, values.end());
    return *nth;
}

double quantile(std::vector<double> values, double p) {
    const double place = p * static_cast<double>(values.size() - 1);
    const auto nth = values.begin() + std::lround(place);
    std::nth_element(values.begin(), nth, values.end());
    return *nth;
}

}  // namespace app
