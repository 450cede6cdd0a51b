#include "sticks/external_predictor.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <iterator>
#include <stdexcept>

#include "files/one_line.h"

namespace app {
namespace {

constexpr int kProtocol = 1;

std::vector<double> ascending(std::span<const double> leads_s) {
    std::vector<double> leads(leads_s.begin(), leads_s.end());
    std::sort(leads.begin(), leads.end());
    leads.erase(std::unique(leads.begin(), leads.end()), leads.end());
    if (leads.empty() || !(leads.front() >= 0) || !std::isfinite(leads.back()))
        throw std::invalid_argument("an external predictor needs finite leads >= 0");
    return leads;
}

/// The numbers of a line, exactly `count`. Throws std::runtime_error "found ..., expected ...".
void parse_numbers(std::string_view line, std::size_t count, std::vector<double>& numbers) {
    numbers.clear();
    const char *at = line.data(), *end = at + line.size();
    const auto is_blank = [](char c) { return c == ' ' || c == '\t' || c == '\r'; };
    for (at = std::find_if_not(at, end, is_blank); at != end; at = std::find_if_not(at, end, is_blank)) {
        const char* stop = std::find_if(at, end, is_blank);
        double value = 0;
        const auto [parsed, problem] = std::from_chars(at, stop, value);
        if (parsed != stop || problem != std::errc() || !std::isfinite(value))
            throw std::runtime_error(
                fmt::format("found \"{}\" as number {} of {}, expected a finite number",
                            one_line(std::string_view(at, static_cast<std::size_t>(stop - at)), 60),
                            numbers.size() + 1, count));
        numbers.push_back(value);
        at = stop;
    }
    if (numbers.size() != count)
        throw std::runtime_error(fmt::format("found {} numbers, expected {}", numbers.size(), count));
}

}  // namespace

ExternalPredictor::ExternalPredictor(const std::string& command, std::span<const double> leads_s,
                                     const std::string& stick, ExternalPatience patience)
    : place_(fmt::format("exec:{}, stick {}", command, stick)),
      leads_s_(ascending(leads_s)),
      held_(tracking::make_predictor("hold")),
      patience_(patience) {
    try {
        child_.emplace(command);
        fmt::format_to(std::back_inserter(line_), "musicworld {} {}", kProtocol, stick);
        for (const double lead : leads_s_) fmt::format_to(std::back_inserter(line_), " {}", lead);
        line_ += '\n';
        child_->send(line_, patience_.start_s);
        path_ = AnswerPath(leads_s_, form_ = parse_answer_form(child_->receive(patience_.start_s)));
    } catch (const std::runtime_error& wrong) {
        throw std::runtime_error(fmt::format("{}, first line: error: {}", place_, wrong.what()));
    }
}

tracking::SampleStatus ExternalPredictor::correct(const tracking::PoseSample& sample) noexcept {
    if (failure_) return tracking::SampleStatus::not_finite;
    const tracking::SampleStatus status = held_->correct(sample);
    const bool fresh = status == tracking::SampleStatus::reinitialised;
    if (status != tracking::SampleStatus::accepted && !fresh) return status;
    try {
        exchange(sample, fresh && answers_ > 0);
    } catch (...) {
        failure_ = std::current_exception();
        return tracking::SampleStatus::not_finite;
    }
    return status;
}

void ExternalPredictor::exchange(const tracking::PoseSample& sample, bool anew) {
    const Eigen::Vector3d& p = sample.position;
    const Eigen::Quaterniond& q = sample.orientation;
    line_ = anew ? "restart\n" : "";
    fmt::format_to(std::back_inserter(line_), "{} {} {} {}", sample.t_s, p.x(), p.y(), p.z());
    if (sample.has_orientation)
        fmt::format_to(std::back_inserter(line_), " {} {} {} {}", q.w(), q.x(), q.y(), q.z());
    line_ += '\n';
    ++answers_;
    try {
        child_->send(line_, patience_.answer_s);
        parse_numbers(child_->receive(patience_.answer_s), leads_s_.size() * form_.numbers(), numbers_);
        path_.take(held_->predict(0), numbers_);
    } catch (const std::runtime_error& wrong) {
        throw std::runtime_error(fmt::format("{}, answer {}: error: {}", place_, answers_, wrong.what()));
    }
}

}  // namespace app
