#include "report/plot.h"

#include <fmt/format.h>
#include <tracking/input.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <iterator>
#include <map>
#include <stdexcept>
#include <tuple>
#include <utility>

#include "files/bad_input.h"
#include "process/child_process.h"

namespace app {
namespace fs = std::filesystem;
namespace {

constexpr std::array<ReportColour, 9> kLineColours = {
    colours::sticks[0], colours::sticks[1], colours::sticks[2], colours::sticks[3], colours::released,
    colours::wrong,     colours::missed,    colours::wave,      colours::cancelled};

fs::path svg_file(const fs::path& scratch, std::size_t number) {
    return scratch / fmt::format("plot{:03}.svg", number);
}

/// With one process: in the locale C, so that numbers have points, and without the user's start-up files.
void run_gnuplot(const std::string& commands, const fs::path& scratch) {
    const fs::path script = scratch / "plots.gp";
    write_file(script, commands);
    run_child({"gnuplot", "--default-settings", script.string()}, scratch / "plots.log", {"LC_ALL=C"});
}

std::string read_if_there(const fs::path& file) {
    std::error_code error;
    return fs::exists(file, error) ? tracking::read_bytes(file.string(), "a plot") : "";
}

/// By its end.
bool is_whole(const fs::path& file) {
    const std::string picture = read_if_there(file);
    if (file.extension() == ".svg") return picture.find("</svg>") != std::string::npos;
    return picture.ends_with("IEND\xae\x42\x60\x82");
}

void replace_all(std::string& text, std::string_view from, std::string_view to) {
    std::string replaced;
    std::size_t done = 0;
    for (std::size_t at = text.find(from); at != std::string::npos; at = text.find(from, done)) {
        replaced.append(text, done, at - done).append(to);
        done = at + from.size();
    }
    if (done > 0) text = replaced.append(text, done);
}

/// From the first `from` to the next `to` after it, both included.
std::string_view span_of(std::string_view text, std::string_view from, std::string_view to) {
    const std::size_t begin = text.find(from);
    const std::size_t end = begin == std::string_view::npos ? begin : text.find(to, begin + from.size());
    if (end == std::string_view::npos)
        throw std::runtime_error(
            fmt::format("error: found a plot without {}, expected one of gnuplot 5", from));
    return text.substr(begin, end + to.size() - begin);
}

/// What stands for a plot in a page's text.
std::string mark_of(std::size_t number) {
    return fmt::format("<!--plot {}-->", number);
}

/// gnuplot writes its colours as attributes: what it drew in one of ours follows the page, black is the
/// page's text.
void follow_page(std::string& svg) {
    for (const ReportColour& colour : colours::all) {
        const std::uint32_t rgb = colour.light, red = rgb >> 16, green = rgb >> 8 & 255, blue = rgb & 255;
        const std::string variable = fmt::format("var(--{})", colour.name);
        replace_all(svg, fmt::format("rgb({:3}, {:3}, {:3})", red, green, blue), variable);  // lines
        replace_all(svg, fmt::format("rgb({},{},{})", red, green, blue), variable);          // text
    }
    replace_all(svg, "\"black\"", "\"currentColor\"");
    replace_all(svg, "'black'", "'currentColor'");
}

/// Lines without the groups that hold nothing (gnuplot writes four of them a tick), titles and ids.
std::string without_ballast(std::string_view svg) {
    std::vector<std::string_view> lines;
    for (std::size_t at = 0; at < svg.size();) {
        const std::size_t end = std::min(svg.find('\n', at), svg.size());
        const std::string_view line = svg.substr(at, end - at);
        at = end + 1;
        if (line == "</g>" && !lines.empty() && lines.back().starts_with("<g fill=\"none\"") &&
            lines.back().ends_with(">")) {
            lines.pop_back();
        } else if (!line.empty()) {
            lines.push_back(line);
        }
    }
    std::string out;
    for (const std::string_view line : lines) {
        const bool named =
            line.starts_with("\t<g id=\"gnuplot_plot_") || line.starts_with("<g id=\"gnuplot_canvas\"");
        out += named ? "<g>" : line;
        out += '\n';
    }
    return out;
}

}  // namespace

void require_gnuplot() {
    require_program("gnuplot", "plots; install the package gnuplot-nox");
}

std::vector<std::string> Plotter::draw(const std::vector<PlotScript>& scripts) {
    std::vector<PlotFile> pictures;
    for (const PlotScript& script : scripts) {
        const fs::path file = svg_file(scratch_, pictures.size());
        pictures.push_back(
            {file, fmt::format("reset\nunset key\nset terminal svg size {},{} noenhanced font "
                               "'sans-serif,12'\nset output {}\n{}\nset output\n",
                               script.width, script.height, gnuplot_string(file.string()), script.commands)});
    }
    draw_files(pictures);
    std::vector<std::string> drawn;
    for (const PlotFile& picture : pictures) drawn.push_back(read_if_there(picture.file));
    return drawn;
}

void Plotter::draw_files(const std::vector<PlotFile>& pictures) {
    std::string reason;
    const auto is_done = [&](const std::string& commands) {
        try {
            run_gnuplot(commands, scratch_);
            return true;
        } catch (const std::runtime_error& failed) {
            if (reason.empty()) reason = failed.what();
            return false;
        }
    };
    std::error_code ignored;
    std::string all;
    for (const PlotFile& picture : pictures) {
        fs::remove(picture.file, ignored);
        all += picture.commands;
    }
    const bool at_once = is_done(all);
    for (const PlotFile& picture : pictures) {
        if (at_once && is_whole(picture.file)) continue;
        if (is_done(picture.commands) && is_whole(picture.file)) continue;
        fs::remove(picture.file, ignored);
        if (failure_.empty())
            failure_ = reason.empty() ? "error: cannot draw a plot: gnuplot left none" : reason;
    }
}

void write_page(OutputFolder& folder, std::string_view name,
                const std::function<std::string(Plotter&)>& format) {
    folder.adorn(name, [&] {
        Plotter plotter(folder.scratch());
        write_file(folder.path(name), format(plotter));
        if (!plotter.failure().empty()) throw std::runtime_error(plotter.failure());
    });
}

std::string gnuplot_string(std::string_view text) {
    std::string quoted = "'";
    for (const char c : text) {
        if (c == '\'') quoted += '\'';
        quoted += is_control(c) ? ' ' : c;
    }
    return quoted + "'";
}

std::string gnuplot_colour(const ReportColour& colour) {
    return fmt::format("rgb '#{:06x}'", colour.light);
}

const ReportColour& stick_colour(std::size_t stick) {
    return colours::sticks[stick % colours::sticks.size()];
}

void PlotPanel::add(std::string_view data, std::string_view style) {
    std::string finite;
    bool gap = false;  // an empty line, which two lines of numbers are not joined over
    for (std::size_t at = 0; at < data.size();) {
        const std::size_t end = std::min(data.find('\n', at), data.size());
        const std::string_view line = data.substr(at, end - at);
        at = end + 1;
        if (line.empty() || line.find('n') != std::string_view::npos) {  // NaN and infinities alone have an n
            gap = !finite.empty();
            continue;
        }
        if (std::exchange(gap, false)) finite += '\n';
        finite.append(line) += '\n';
    }
    if (finite.empty()) return;
    fmt::format_to(std::back_inserter(clauses_), "{}'-' {}", clauses_.empty() ? "" : ", ", style);
    data_ += finite + "e\n";
}

std::string PlotPanel::text(const std::vector<PlotLine>& key) const {
    std::string clauses = clauses_.empty() ? "NaN" : clauses_;
    for (const PlotLine& line : key)
        clauses += fmt::format(", NaN {} title {}", style_of(line, 2), gnuplot_string(line.name));
    return "plot " + clauses + "\n" + data_;
}

std::string plot_axes() {
    return fmt::format(
        "set border 3 lt 1 lw 1 lc {0}\nset tics nomirror out scale 0.6 textcolor {0}\n"
        "set grid lt 1 lw 0.6 lc {1}\n",
        gnuplot_colour(colours::axis), gnuplot_colour(colours::grid));
}

double round_step(double span, int count) {
    if (!(std::isfinite(span) && span > 0)) span = 1;
    const double rough = span / count, power = std::pow(10.0, std::floor(std::log10(rough)));
    for (const double factor : {1.0, 2.0, 5.0})
        if (factor * power >= rough * (1 - 1e-9)) return factor * power;
    return 10 * power;
}

PlotScript plot_of(int width, int height, const PlotAxis& x, const PlotAxis& y, const PlotPanel& panel,
                   std::string_view more, std::vector<PlotLine> legend) {
    std::string commands = plot_axes();
    for (const auto& [name, axis] : {std::pair{"x", &x}, {"y", &y}}) {
        if (!axis->label.empty()) commands += fmt::format("set {}label '{}'\n", name, axis->label);
        const bool finite = std::isfinite(axis->low) && std::isfinite(axis->high);
        const double low = finite ? axis->low : 0, high = finite ? axis->high : 1;
        commands += fmt::format("set {}range [{}:{}]\n", name, low, high);
        if (axis->tics > 0) commands += round_tics(name, high - low, axis->tics);
    }
    commands.append(more);
    std::string plain = commands + panel.text(), keyed = commands + panel.text(legend);
    return {width, height, std::move(plain), std::move(legend), std::move(keyed)};
}

Histogram histogram(std::span<const double> values, double bin) {
    std::map<int, int> bins;
    for (const double value : values)
        if (std::isfinite(value)) ++bins[static_cast<int>(std::floor(value / bin))];
    Histogram made;
    if (bins.empty()) return made;
    for (int at = bins.begin()->first - 1, last = bins.rbegin()->first + 1; at <= last; ++at) {
        const int count = bins[at];
        fmt::format_to(std::back_inserter(made.data), "{} {}\n", (at + 0.5) * bin, count);
        made.highest = std::max(made.highest, count);
    }
    return made;
}

std::string boxes_of(const ReportColour& colour) {
    return "with boxes fs solid 0.75 noborder lc " + gnuplot_colour(colour);
}

std::string plot_margins(int top, int bottom, int height) {
    return fmt::format("set tmargin at screen {}\nset bmargin at screen {}\n",
                       1 - static_cast<double>(top) / height, 1 - static_cast<double>(bottom) / height);
}

std::string round_tics(std::string_view axis, double span, int count) {
    const double step = round_step(span, count);
    const int decimals = std::max(0, static_cast<int>(-std::floor(std::log10(step) + 1e-9)));
    return fmt::format("set {0}tics {1}\nset format {0} '%.{2}f'\n", axis, step, decimals);
}

void ThinnedMarks::add(double x, double y, std::string_view rest) {
    const auto pixel = [](double value, double low, double high, int size) {
        if (!(high > low)) return 0;
        return static_cast<int>(std::floor(std::clamp((value - low) / (high - low), -1.0, 2.0) * size));
    };
    if (!(x >= area_.x_low && x <= area_.x_high) || !std::isfinite(x) || !std::isfinite(y)) return;
    const std::pair<int, int> place = {pixel(x, area_.x_low, area_.x_high, area_.width),
                                       pixel(y, area_.y_low, area_.y_high, area_.height)};
    if (taken_.insert(place).second)
        fmt::format_to(std::back_inserter(text_), "{:.4f} {:.4f} {}\n", x, y, rest);
}

std::string sound_envelope(std::span<const float> stereo, double t0_s, double from_s, double to_s,
                           int columns) {
    constexpr double kRate = 48000;
    const std::size_t frames = stereo.size() / 2;
    const double count = static_cast<double>(frames), column_s = (to_s - from_s) / columns;
    const auto sample_at = [&](double t_s) {
        return static_cast<std::size_t>(std::clamp(std::round((t_s - t0_s) * kRate), 0.0, count)) * 2;
    };
    std::string text;
    for (int i = 0; i < columns; ++i) {
        const std::size_t begin = sample_at(from_s + i * column_s),
                          end = sample_at(from_s + (i + 1) * column_s);
        if (begin == end) continue;
        const auto [low, high] = std::minmax_element(stereo.begin() + static_cast<std::ptrdiff_t>(begin),
                                                     stereo.begin() + static_cast<std::ptrdiff_t>(end));
        fmt::format_to(std::back_inserter(text), "{:.4f} {:.4f} {:.4f}\n", from_s + (i + 0.5) * column_s,
                       *low, *high);
    }
    return text;
}

PlotLine line_of(std::size_t n, const std::string& name) {
    return {name, kLineColours[n % kLineColours.size()], n / kLineColours.size() % 2 == 1};
}

std::string style_of(const PlotLine& line, double width) {
    return fmt::format("with lines lt 1 lw {}{} lc {}", width, line.dashed ? " dt '-'" : "",
                       gnuplot_colour(line.colour));
}

std::string PlotGallery::add(PlotScript plot, std::string label) {
    plots_.push_back(std::move(plot));
    labels_.push_back(std::move(label));
    return mark_of(plots_.size() - 1);
}

std::string PlotGallery::element(PlotScript plot, const std::string& label) {
    std::vector<std::pair<std::string, std::string>> legend;
    for (const PlotLine& line : plot.legend)
        legend.emplace_back(line_shape(line.colour, line.dashed), line.name);
    return fmt::format("<div><h3>{}</h3>\n{}{}</div>\n", html(label),
                       legend.empty() ? "" : report_legend(legend), framed(add(std::move(plot), label)));
}

std::string PlotGallery::in_page(std::size_t number, std::string_view drawn) const {
    if (drawn.empty()) return "<p class=note>This plot could not be drawn.</p>\n";
    std::string svg = without_ballast(span_of(drawn, "</defs>", "</svg>").substr(7));
    follow_page(svg);
    // The definitions, left out, stood inside the canvas's group.
    return fmt::format("<svg role=\"img\" aria-label=\"{}\" {}>\n<g>\n{}", html(labels_[number]),
                       span_of(drawn, "viewBox=\"", "\""), svg);
}

void PlotGallery::write_files(const fs::path& folder, Plotter& plotter) const {
    constexpr int kTitleHeight = 30, kKeyRowHeight = 18, kKeyWidth = 170;
    std::vector<PlotFile> pictures;
    for (std::size_t i = 0; i < plots_.size(); ++i) {
        const PlotScript& plot = plots_[i];
        std::string name = fmt::format("{:02}_{}", i + 1, labels_[i].substr(0, 60));
        for (char& c : name)
            if (std::isalnum(static_cast<unsigned char>(c)) == 0 && c != '-' && c != '.') c = '_';
        const int columns = std::max(1, plot.width / kKeyWidth),
                  rows = (static_cast<int>(plot.legend.size()) + columns - 1) / columns;
        for (const auto& [ending, terminal, size] :
             {std::tuple("svg", "svg size {},{} noenhanced font 'sans-serif,12' background rgb 'white'", 1),
              {"png",
               "pngcairo size {},{} noenhanced font 'sans-serif,12' fontscale 2 linewidth 2 pointscale 2",
               2}}) {
            const fs::path file = folder / (name + "." + ending);
            pictures.push_back(
                {file,
                 fmt::format(
                     "reset\nset terminal {}\nset output {}\nset title {}\n"
                     "set key noautotitle outside bottom center horizontal maxrows {}\n{}\nset output\n",
                     fmt::format(fmt::runtime(terminal), size * plot.width,
                                 size * (plot.height + kTitleHeight + kKeyRowHeight * rows)),
                     gnuplot_string(file.string()), gnuplot_string(labels_[i]), std::max(1, rows),
                     plot.keyed.empty() ? plot.commands : plot.keyed)});
        }
    }
    plotter.draw_files(pictures);
}

std::string PlotGallery::drawn(std::string page, Plotter& plotter) const {
    const std::vector<std::string> drawn = plotter.draw(plots_);
    for (std::size_t i = 0; i < drawn.size(); ++i) replace_all(page, mark_of(i), in_page(i, drawn[i]));
    const auto any = std::ranges::find_if(drawn, [](const std::string& svg) { return !svg.empty(); });
    if (any == drawn.end()) return page;
    replace_all(
        page, symbols(),
        fmt::format(
            "<svg width=\"0\" height=\"0\" style=\"position:absolute\" aria-hidden=\"true\">{}</svg>\n",
            span_of(*any, "<defs>", "</defs>")));
    return page;
}

}  // namespace app
