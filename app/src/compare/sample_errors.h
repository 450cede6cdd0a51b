#pragma once
#include <cstddef>
#include <filesystem>
#include <fstream>
#include <map>
#include <mutex>
#include <string>

#include "compare/predictor_scores.h"
#include "compare/recording.h"
#include "files/output_file.h"

namespace app {

/// Rows of `compare --samples`, one for each prediction that is scored: collected while one predictor runs over one
/// stick.
class SampleRows {
public:
    SampleRows(const SensedStick& stick, const std::string& trace, const std::string& person,
               const std::string& predictor);
    static std::string header();
    void add(std::size_t sample, std::size_t lead, const tracking::PosePrediction& predicted,
             const std::optional<tracking::PoseCovariance>& covariance);
    [[nodiscard]] std::string take() { return std::move(text_); }

private:
    const SensedStick& stick_;
    std::string before_, text_;
};

/// A file whose parts are made by several threads, in any order; written in the order of the parts. FILE.partial
/// until it is whole. Throws std::runtime_error when it cannot be written.
class OrderedFile {
public:
    OrderedFile(const std::filesystem::path& file, const std::string& header);
    /// Any thread; each part once.
    void add(std::size_t part, std::string text);
    void finish();

private:
    void check();

    OutputFile file_;
    std::ofstream out_;
    std::mutex mutex_;
    std::size_t next_ = 0;
    std::map<std::size_t, std::string> waiting_;
};

}  // namespace app
