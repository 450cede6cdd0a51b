#include "report/html.h"

#include <fmt/format.h>

#include <algorithm>

#include "files/bad_input.h"

namespace app {
namespace {

constexpr const char* kRules = R"css(
*{box-sizing:border-box}
body{margin:0;background:var(--page);color:var(--ink);font:15px/1.5 system-ui,-apple-system,"Segoe UI",Roboto,sans-serif}
main{max-width:1120px;margin:0 auto;padding:28px 24px 56px}
header p{margin:2px 0;color:var(--axis)}
h1{font-size:26px;line-height:1.25;margin:0 0 4px;overflow-wrap:anywhere}
h2{font-size:18px;margin:40px 0 6px}
h3{font-size:15px;margin:0 0 4px}
p.note{color:var(--axis);margin:0 0 10px;max-width:95ch}
.scroll+p.note,table+p.note{margin-top:8px}
.facts{display:grid;grid-template-columns:repeat(auto-fit,minmax(230px,1fr));gap:8px 28px;margin:18px 0 0}
.facts div{border-top:1px solid var(--grid);padding-top:5px;overflow-wrap:anywhere}
.facts dt{color:var(--axis);font-size:12.5px}
.facts dd{margin:0}
.figures{display:grid;grid-template-columns:repeat(auto-fit,minmax(106px,1fr));gap:9px;margin:24px 0 8px}
.figures div{background:var(--card);border:1px solid var(--grid);border-top:3px solid var(--tone,var(--axis));border-radius:6px;padding:8px 11px}
.figures b{display:block;white-space:nowrap;font-size:20px;line-height:1.2;font-weight:650;font-variant-numeric:tabular-nums}
.figures span{color:var(--axis);font-size:12.5px}
.frames{display:grid;grid-template-columns:repeat(auto-fill,minmax(300px,1fr));gap:12px}
figure{margin:0}
.frames img{width:100%;height:auto;display:block;border-radius:6px;border:1px solid var(--grid)}
audio,video{display:block;width:100%;max-width:640px;margin:0 0 6px}
.film{overflow:hidden;width:100%;border-radius:6px;border:1px solid var(--grid)}
.frames .film img{width:calc(100%*var(--n));max-width:none;height:100%;border:0;border-radius:0;animation:film var(--s) steps(var(--n)) infinite}
@keyframes film{to{transform:translateX(-100%)}}
@media(prefers-reduced-motion:reduce){.film{overflow-x:auto}.frames .film img{animation:none}}
figcaption{color:var(--axis);font-size:12.5px;padding-top:3px}
.plot{background:var(--card);border:1px solid var(--grid);border-radius:6px;padding:8px 10px 4px}
.plot svg{display:block;width:100%;height:auto}
.pair{display:grid;grid-template-columns:repeat(auto-fit,minmax(420px,1fr));gap:12px}
.legend{display:flex;flex-wrap:wrap;gap:4px 18px;margin:0 0 8px;padding:0;list-style:none;font-size:13px}
.legend svg{width:22px;height:12px;vertical-align:-1px;margin-right:5px}
.scroll{overflow-x:auto}
table{border-collapse:collapse;font-variant-numeric:tabular-nums}
th,td{padding:4px 14px 4px 0;text-align:left;border-bottom:1px solid var(--grid);vertical-align:top;overflow-wrap:anywhere}
th{color:var(--axis);font-weight:500;font-size:13px}
td.n,th.n{text-align:right}
.wide td,.wide th,.grid td{overflow-wrap:normal}
.scroll+h3{margin-top:20px}
.wide td,.grid td{white-space:nowrap}
.wide td.text{white-space:normal}
.grid{font-size:12px}
.grid td,.grid th{padding:2px 10px 2px 0}
.scroll+p{margin-top:20px}
.grid td.gain b{color:var(--released)}
.grid td.none{color:var(--axis)}
details summary{cursor:pointer;margin:12px 0 6px}
.pair,.plot+.pair{margin-top:12px}
code{font:12.5px/1.5 ui-monospace,SFMono-Regular,Menlo,Consolas,monospace;overflow-wrap:anywhere}
@media(max-width:520px){.pair{grid-template-columns:1fr}main{padding:20px 14px}}
@media print{body{font-size:12px}.plot,figure,tr{break-inside:avoid}}
)css";

/// CSS declarations of all colours, "--grid:#e4e8ee;...", for a light or a dark page.
std::string css_colours(bool dark) {
    std::string css;
    for (const ReportColour& colour : colours::all)
        css += fmt::format("--{}:#{:06x};", colour.name, dark ? colour.dark : colour.light);
    return css;
}

}  // namespace

std::string html(std::string_view text) {
    constexpr std::pair<char, const char*> kEscapes[] = {
        {'&', "&amp;"}, {'<', "&lt;"}, {'>', "&gt;"}, {'"', "&quot;"}, {'\'', "&#39;"}};
    std::string out;
    for (const char c : text) {
        const auto* escape = std::ranges::find(kEscapes, c, &std::pair<char, const char*>::first);
        if (escape != std::end(kEscapes))
            out += escape->second;
        else
            out += is_control(c) ? ' ' : c;
    }
    return out;
}

std::string report_page(std::string_view title, std::string_view body) {
    return fmt::format(
        "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\n"
        "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n"
        "<title>{}: MusicWorld</title>\n<style>"
        ":root{{color-scheme:light dark;--page:#f6f8fa;--card:#ffffff;--ink:#1b2027;{}}}\n"
        "@media screen and (prefers-color-scheme:dark)"
        "{{:root{{--page:#12161b;--card:#1a2027;--ink:#e3e8ee;{}}}}}{}"
        "</style></head>\n<body><main>\n{}</main></body></html>\n",
        html(title), css_colours(false), css_colours(true), kRules, body);
}

std::string report_header(std::string_view title, std::string_view subtitle,
                          const std::vector<std::pair<std::string, std::string>>& facts) {
    std::string text = fmt::format("<header><h1>{}</h1>\n", html(title));
    if (!subtitle.empty()) text += fmt::format("<p>{}</p>\n", html(subtitle));
    text += "<dl class=facts>\n";
    for (const auto& [name, value] : facts)
        if (!value.empty())
            text += fmt::format("<div><dt>{}</dt><dd>{}</dd></div>\n", html(name), html(value));
    return text + "</dl></header>\n";
}

std::string report_figures(const std::vector<PageFigure>& figures) {
    std::string text = "<section class=figures>\n";
    for (const auto& [value, name, tone] : figures)
        text += fmt::format("<div style=\"--tone:var(--{})\"><b>{}</b><span>{}</span></div>\n", tone,
                            html(value), html(name));
    return text + "</section>\n";
}

std::string report_legend(const std::vector<std::pair<std::string, std::string>>& entries) {
    std::string text = "<ul class=legend>\n";
    for (const auto& [shape, name] : entries)
        text += fmt::format("<li><svg viewBox=\"0 0 22 12\" aria-hidden=\"true\">{}</svg>{}</li>\n", shape,
                            html(name));
    return text + "</ul>\n";
}

std::string line_shape(const ReportColour& colour, bool dashed) {
    return fmt::format("<path d=\"M1,6h20\" stroke=\"var(--{})\" stroke-width=\"2.5\"{}/>", colour.name,
                       dashed ? " stroke-dasharray=\"5 3\"" : "");
}

}  // namespace app
