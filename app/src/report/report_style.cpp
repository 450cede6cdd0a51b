#include "report/report_style.h"

#include <fmt/format.h>

#include "report/html.h"

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

}  // namespace

std::string report_style() {
    return ":root{color-scheme:light dark;--page:#f6f8fa;--card:#ffffff;--ink:#1b2027;" + css_colours(false) +
           "}\n@media screen and "
           "(prefers-color-scheme:dark){:root{--page:#12161b;--card:#1a2027;--ink:#e3e8ee;" +
           css_colours(true) + "}}" + kRules;
}

std::string report_page(std::string_view title, std::string_view body) {
    return fmt::format(
        "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\n"
        "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n"
        "<title>{}: MusicWorld</title>\n<style>{}</style></head>\n<body><main>\n{}</main></body></html>\n",
        html(title), report_style(), body);
}

std::string report_fact(std::string_view name, std::string_view value) {
    return fmt::format("<div><dt>{}</dt><dd>{}</dd></div>\n", html(name), html(value));
}

std::string report_figure(std::string_view value, std::string_view name, std::string_view tone) {
    return fmt::format("<div style=\"--tone:var(--{})\"><b>{}</b><span>{}</span></div>\n", tone, html(value),
                       html(name));
}

}  // namespace app
