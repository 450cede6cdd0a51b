#include "compare/training_report.h"

#include <fmt/format.h>

#include <algorithm>

#include "files/checksum.h"

namespace app {
namespace {

bool is_synthetic(const Recording& recording) {
    return recording.trace.source.starts_with("synthetic");
}

}  // namespace

std::vector<std::pair<std::string, std::string>> provenance_of(std::span<const Recording> recordings,
                                                               const TrainingField& field,
                                                               const tracking::TrainingOptions& options,
                                                               const tracking::TrainingResult& result,
                                                               const std::string& version) {
    std::vector<std::pair<std::string, std::string>> lines;
    const bool synthetic = std::ranges::all_of(recordings, is_synthetic);
    lines.emplace_back("trained_on", synthetic ? "synthetic traces alone" : "recordings");
    lines.emplace_back("made_by", "musicworld " + version);
    std::string command = "musicworld train";
    for (const Recording& recording : recordings) command += " " + recording.trace.file;
    lines.emplace_back("command",
                       fmt::format("{} --hidden {} --steps {} --seed {}{}", command, options.hidden,
                                   options.steps, options.seed, options.contacts ? "" : " --no-contacts"));
    for (const Recording& recording : recordings)
        lines.emplace_back("input", sha256_of_file(recording.trace.file) + " " + recording.trace.file);
    lines.emplace_back("held_out", field.held_out);
    lines.emplace_back("examples", fmt::format("{}, {} steps", result.examples, result.steps));
    for (const tracking::TrainingScore& s : result.scores)
        lines.emplace_back(
            "error", fmt::format("{:.4f} s ahead: {:.1f} mm RMS with the shaft, {:.1f} without; the "
                                 "fading velocity {:.1f}; regions of 50 and 95 % hold {:.3f}, {:.3f}",
                                 s.lead_s, s.with_shaft_mm, s.position_only_mm, s.fading_mm, s.inside_50,
                                 s.inside_95));
    if (result.contact_examples > 0)
        lines.emplace_back(
            "contact_times",
            fmt::format("{} examples, {} steps; -ln(probability of what came) {:.3f} held out, {:.3f} "
                        "of the shares alone",
                        result.contact_examples, result.contact_steps, result.contact_loss,
                        result.contact_loss_of_shares));
    return lines;
}

std::string format_training_text(const tracking::TrainingResult& result, const TrainingField& field) {
    std::string text = fmt::format(
        "{} examples, {} steps. Held out: {}, at 60 Hz with 0.25 mm of noise; RMS mm of the tracked "
        "point:\n\n"
        "lead s  with the shaft  position only  fading velocity  inside 50  inside 95\n",
        result.examples, result.steps, field.held_out);
    for (const tracking::TrainingScore& s : result.scores)
        text += fmt::format("{:6.4f}  {:14.1f}  {:13.1f}  {:15.1f}  {:9.3f}  {:9.3f}\n", s.lead_s,
                            s.with_shaft_mm, s.position_only_mm, s.fading_mm, s.inside_50, s.inside_95);
    if (result.contact_examples > 0)
        text += fmt::format(
            "\nTime to contact: {} examples, {} steps; -ln(probability of what came) {:.3f}, of the shares "
            "alone "
            "{:.3f}{}\n",
            result.contact_examples, result.contact_steps, result.contact_loss, result.contact_loss_of_shares,
            result.model.contacts ? ""
                                  : "; too little: the model is without it, strikes are decided by paths");
    return text;
}

}  // namespace app
