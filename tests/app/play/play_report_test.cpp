#include <gtest/gtest.h>
#include <render/renderer.h>

#include <cstdlib>
#include <optional>
#include <set>
#include <sstream>

#include "files/output_folder.h"
#include "kit/kit.h"
#include "play/film.h"
#include "play/play_plots.h"
#include "play/play_run.h"
#include "report/plot.h"
#include "sample_play_result.h"

namespace {
namespace fs = std::filesystem;

std::string report_of(const app::PlayResult& result) {
    const TemporaryFolder scratch;
    app::Plotter plotter(scratch.path());
    std::string page = app::format_report(
        result, app::report_sections(result, plotter, [](std::uint64_t) { return std::nullopt; }));
    EXPECT_EQ(plotter.failure(), "");
    return page;
}

std::size_t count(const std::string& text, const std::string& part) {
    std::size_t found = 0;
    for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++found;
    return found;
}

bool holds(const std::string& text, const std::string& part) {
    return text.find(part) != std::string::npos;
}

/// An environment variable for the length of a test.
class Variable {
public:
    Variable(const char* name, const std::string& value) : name_(name) {
        if (const char* old = std::getenv(name)) old_ = old;
        ::setenv(name, value.c_str(), 1);
    }
    ~Variable() { old_ ? ::setenv(name_, old_->c_str(), 1) : ::unsetenv(name_); }
    Variable(const Variable&) = delete;
    Variable& operator=(const Variable&) = delete;

private:
    const char* name_;
    std::optional<std::string> old_;
};

TEST(Report, NeedsNothingBesideItself) {
    const std::string page = report_of(sample_play_result());
    for (const char* outside :
         {"http:", "https:", "<script", "<link", "@import", "url(", "src=\"/", "file:", "<?xml", "<!ENTITY"})
        EXPECT_FALSE(holds(page, outside)) << outside;
    EXPECT_EQ(count(page, " src="),
              count(page, " src=\"data:image/png;base64,") + count(page, " src=\"data:audio/mpeg;base64,"));
}

TEST(Report, PlaysTheSoundAShortOneFromWithinThePage) {
    EXPECT_EQ(
        count(report_of(sample_play_result()), "<audio controls preload=metadata src=\"data:audio/mpeg"), 1U);
    app::PlayResult result = sample_play_result();
    result.sound.samples = {};
    const std::vector<float> second(2 * 48000);
    for (int i = 0; i <= 300; ++i) result.sound.samples.append(second);  // five minutes stay within the page
    EXPECT_EQ(count(report_of(result), "<audio controls preload=metadata src=\"audio.wav\">"), 1U);
    result.sound.samples = {};
    EXPECT_FALSE(holds(report_of(result), "<audio"));
}

TEST(Report, ShowsTheVideoWhereItLies) {
    app::PlayResult result = sample_play_result();
    EXPECT_FALSE(holds(report_of(result), "<video"));
    result.options.video = "my take.mp4";
    result.pictures.video = "../my%20take.mp4";
    EXPECT_TRUE(holds(report_of(result), "<video controls preload=metadata src=\"../my%20take.mp4\">"));
}

/// Frames of 8 x 4 pixels, the second one missing: four pictures side by side, each half as wide, with a bar
/// of four rows.
TEST(Report, AFilmIsItsFramesSideBySideWithABarBelow) {
    const TemporaryFolder here;
    app::Film film{{}, 2, 1.0 / 30};
    for (int i = 0; i < 4; ++i) {
        film.files.push_back(here.path() / (std::to_string(i) + ".png"));
        render::Image frame{8, 4,
                            std::vector<std::uint8_t>(8 * 4 * 3, static_cast<std::uint8_t>(50 * i + 20))};
        frame.rgb[0] = static_cast<std::uint8_t>(50 * i + 24);  // a mean of four: 1 more
        const std::vector<std::uint8_t> png = render::encode_png(frame);
        if (i != 1) app::write_file(film.files.back(), png);
    }
    const auto none = [](const std::filesystem::path&) { return std::nullopt; };
    const render::Image strip = app::film_strip(film, 4, none);
    ASSERT_EQ(strip.width, 16);
    ASSERT_EQ(strip.height, 2 + 4);
    const auto pixel = [&](int x, int y) {
        return int{strip.rgb[static_cast<std::size_t>(3 * (y * 16 + x))]};
    };
    EXPECT_EQ(pixel(0, 0), 21);
    EXPECT_EQ(pixel(1, 0), 20);
    EXPECT_EQ(pixel(4, 0), 21) << "a frame that is missing shows the one before";
    EXPECT_EQ(pixel(8, 0), 121);
    EXPECT_EQ(pixel(15, 1), 170);
    EXPECT_NE(pixel(0, 2), pixel(1, 2)) << "where the first frame is in the film";
    EXPECT_EQ(pixel(8 + 2, 2), 43) << "the frame that is struck, in the colour of notes";
    const render::Image kept = app::film_strip(film, 4, [](const std::filesystem::path& file) {
        const bool second = app::frame_number(file) == 1;
        return second ? std::optional(render::Image{8, 4, std::vector<std::uint8_t>(8 * 4 * 3, 99)})
                      : std::nullopt;
    });
    EXPECT_EQ(kept.rgb[3 * 4], 99) << "a picture that is at hand is not read";
    EXPECT_EQ(kept.rgb[3 * 8], 121);
    app::PlayResult result = sample_play_result();
    result.pictures.films = {film};
    EXPECT_TRUE(holds(report_of(result), "<div class=film style=\"--n:4;--s:0.80s;aspect-ratio:8/8\">"));
}
TEST(Report, EveryPlotIsAWholeSvgWithALabelAndFollowsThePagesColours) {
    const std::string page = report_of(sample_play_result());
    // One row of timeline, two of timing, the leads, the sound and its spectrogram; every mark in the legend
    // and the symbols are more.
    EXPECT_EQ(count(page, "<svg role=\"img\" aria-label=\""), 6U);
    EXPECT_EQ(count(page, "<svg"), count(page, "</svg>"));
    EXPECT_EQ(count(page, "<g>") + count(page, "<g "), count(page, "</g>"));
    EXPECT_EQ(count(page, "id='gpPt6'"), 1U) << "the symbols are defined once";
    EXPECT_FALSE(holds(page, "rgb(")) << "a colour that does not follow";
    EXPECT_FALSE(holds(page, "<title>gnuplot"));
    for (const char* colour : {"var(--stick-1)", "var(--stick-2)", "var(--released)", "var(--wrong)",
                               "var(--missed)", "var(--cancelled)", "var(--contact)", "var(--wave)"})
        EXPECT_TRUE(holds(page, "'" + std::string(colour) + "'")) << colour << " is drawn by gnuplot";
    EXPECT_TRUE(holds(page, "prefers-color-scheme:dark"));
}

TEST(Report, ShowsTheFiguresAndTheProvenance) {
    const std::string page = report_of(sample_play_result());
    for (const char* text : {"<b>3</b><span>true contacts", "<b>1</b><span>cancelled", "<b>2</b><span>moved",
                             "<b>1</b><span>false", "<b>1</b><span>missed", "<b>3.0 ms</b><span>median error",
                             "<b>4.0 ms</b><span>95 % error", "drums &amp; bells", "33.3 ms ahead",
                             "up to 66.7 ms ahead", "0123456789abcdef", "Heard: 66.7 %", "False: 33.3 %"})
        EXPECT_TRUE(holds(page, text)) << text;
    EXPECT_TRUE(holds(page, std::string(64, 'a')));
}

/// snare: onset 0.1 + 9600 / 48000 = 0.300 s against 0.298 s; tom: 0.500 s against 0.504 s.
TEST(Report, TheTableByInstrumentHasTheSignedErrors) {
    const std::string page = report_of(sample_play_result());
    EXPECT_TRUE(holds(page,
                      "<tr><td>snare<td class=n>1<td class=n>1<td class=n>0<td class=n>0<td class=n>0"
                      "<td class=n>2.0<td class=n>+2.0</tr>"));
    EXPECT_TRUE(holds(page, "<td class=n>4.0<td class=n>-4.0</tr>"));
    EXPECT_TRUE(holds(page,
                      "&lt;/b&gt;<td class=n>1<td class=n>1<td class=n>1<td class=n>1<td class=n>1"
                      "<td class=n>\xe2\x80\x93<td class=n>\xe2\x80\x93</tr>"));
}

TEST(Report, IsTheSameForTheSameResultInAnyLocaleAndFolder) {
    const std::string first = report_of(sample_play_result());
    const Variable locale("LC_ALL", "de_DE.UTF-8");
    EXPECT_EQ(report_of(sample_play_result()), first);
}

TEST(Report, DoesNotDependOnTimesAndWorkers) {
    app::PlayResult other = sample_play_result();
    other.wall_s = 123;
    other.stages_s = {{"drawing", 45}};
    other.options.workers = 3, other.workers_lost = 1, other.bodies_reowned = 4;
    EXPECT_EQ(report_of(other), report_of(sample_play_result()));
}

TEST(Report, NamesAreTextWhateverTheyHold) {
    const TemporaryFolder here;
    const std::string touched = (here.path() / "touched").string();
    app::PlayResult result = sample_play_result();
    const std::string hostile =
        "'; system('touch " + touched + "'); `touch " + touched + "`\nset output <script>alert(1)</script>";
    result.trace = result.kit_name = result.trace_source = result.options.picture_predictor = hostile;
    result.options.sound_predictor = result.origin.fingerprint = hostile;
    result.options.kit = hostile;
    for (std::string& name : result.instruments) name = hostile;
    for (std::string& name : result.sticks) name = hostile;
    for (app::TipTrack& track : result.tracks) track.stick = hostile;
    result.origin.inputs = {{hostile, hostile}};
    result.origin.versions = {{hostile, hostile}};
    const std::string page = report_of(result);
    EXPECT_FALSE(holds(page, "<script"));
    EXPECT_FALSE(fs::exists(touched));
}

TEST(Report, OfARunWithoutAnythingIsAPageNonetheless) {
    app::PlayResult nothing;
    nothing.trace = "empty.csv";
    const std::string page = report_of(nothing);
    EXPECT_TRUE(holds(page, "<b>0</b><span>true contacts"));
    EXPECT_TRUE(holds(page, "<b>none</b><span>median error"));
    EXPECT_FALSE(holds(page, "<h2>Sound"));
    EXPECT_FALSE(holds(page, "<h2>Frames"));
    app::PlayResult silent = sample_play_result();
    silent.sound.samples = {};
    silent.sound.samples.append(std::vector<float>(2 * 48000));
    EXPECT_TRUE(holds(report_of(silent), "Silence"));
}

/// RFC 4648: "Man" is TWFu, "Ma" is TWE=. Frame 7 at 30 a second from 0.1 s is shown at 0.333 s, 33 ms after
/// the note at 0.3 s.
TEST(Report, FramesAreWithinWithTheirTimeAndTheNearestNote) {
    const TemporaryFolder here;
    app::PlayResult result = sample_play_result();
    for (const auto& [name, bytes] : {std::pair{"000007.png", "Man"}, {"000029.png", "Ma"}}) {
        app::write_file(here.path() / name, std::string_view(bytes));
        result.pictures.frames.push_back(here.path() / name);
    }
    const std::string page = report_of(result);
    EXPECT_TRUE(holds(page, "base64,TWFu\">"));
    EXPECT_TRUE(holds(page, "base64,TWE=\">"));
    EXPECT_TRUE(holds(page, "<figcaption>0.333 s: 33 ms after snare (left)</figcaption>"));
    EXPECT_TRUE(holds(page, "<figcaption>1.067 s</figcaption>"));
    result.pictures.frames.push_back(here.path() / "000030.png");
    try {
        (void)report_of(result);
        FAIL();
    } catch (const std::runtime_error& error) {
        EXPECT_TRUE(holds(error.what(), "000030.png")) << error.what();
    }
}

TEST(Report, WithoutGnuplotIsAPageWithoutPlotsAndBeforeARunSaysWhatToInstall) {
    const TemporaryFolder empty;
    const Variable path("PATH", empty.path().string());
    app::Plotter plotter(empty.path());
    const app::PlayResult result = sample_play_result();
    const std::string page = app::format_report(
        result, app::report_sections(result, plotter, [](std::uint64_t) { return std::nullopt; }));
    EXPECT_TRUE(holds(plotter.failure(), "gnuplot")) << plotter.failure();
    EXPECT_TRUE(holds(page, "could not be drawn"));
    EXPECT_TRUE(page.ends_with("</html>\n"));
    try {
        app::require_gnuplot();
        FAIL();
    } catch (const std::runtime_error& error) {
        EXPECT_TRUE(holds(error.what(), "gnuplot-nox")) << error.what();
    }
}

/// gnuplot ends at the first plot of nothing but NaN, and at a range of NaN.
TEST(Gnuplot, NumbersThatAreNotFiniteAreGaps) {
    const TemporaryFolder here;
    app::Plotter plotter(here.path());
    app::PlotPanel some, none;
    some.add("0 1\n1 nan\n2 -inf\n3 2\n", "with lines");
    none.add("0 nan\n1 -nan", "with lines");
    const double nan = std::numeric_limits<double>::quiet_NaN();
    EXPECT_TRUE(holds(some.text(), "\n0 1\n\n3 2\ne\n")) << some.text();
    const std::vector<std::string> drawn =
        plotter.draw({app::plot_of(100, 100, {"x", 0, 3, 4}, {"y", nan, 2, 4}, some),
                      app::plot_of(100, 100, {"x", 0, 3}, {"y", 0, nan}, none)});
    EXPECT_EQ(plotter.failure(), "");
    EXPECT_FALSE(drawn[0].empty());
    EXPECT_FALSE(drawn[1].empty());
}

TEST(Report, AnHourIsTwelveRowsAndUnder4Megabytes) {
    app::PlayResult hour = sample_play_result();
    hour.t_end_s = hour.t0_s + 3600;
    app::Strike strike = hour.strikes[0];
    app::TrueContact contact = hour.contacts[0];
    hour.strikes.clear();
    hour.contacts.clear();
    for (std::uint64_t id = 1; id <= 36000; ++id) {
        strike.id = id;
        strike.outcome = id % 3 == 0 ? app::Outcome::cancelled : app::Outcome::released;
        strike.onset_s = hour.t0_s + static_cast<double>(id) * 0.1;
        strike.scheduled_at_s = strike.onset_s - 0.001 * static_cast<double>(10 + id % 57);
        contact.t_s = strike.onset_s - 0.001 * static_cast<double>(id % 25);
        contact.matched_id = id % 3 != 0 && id % 7 != 0 ? id : 0;
        hour.strikes.push_back(strike);
        hour.contacts.push_back(contact);
    }
    for (app::TipTrack& track : hour.tracks) {
        track.t_s.clear();
        track.tip.clear();
        for (int i = 0; i < 3600 * 60; ++i) {
            track.t_s.push_back(hour.t0_s + i / 60.0);
            track.tip.emplace_back(0, 1 + 0.2 * std::sin(i * 0.4), 0);
        }
    }
    const std::string page = report_of(hour);
    EXPECT_EQ(count(page, "aria-label=\"timeline from"), 12U);
    EXPECT_EQ(count(page, "aria-label=\"notes heard"), 1U);
    EXPECT_LT(page.size(), 4U << 20);
}

TEST(Timeline, ShowsAllRowsOf48SecondsAndOfMoreTheOnesWithTheMostErrors) {
    app::PlayResult result;
    result.t0_s = 10;
    result.t_end_s = 58;
    EXPECT_TRUE(app::timeline_of(result).whole);
    EXPECT_EQ(app::timeline_of(result).starts_s.size(), 12U);
    result.t_end_s = 12.5;
    EXPECT_EQ(app::timeline_of(result).row_s, 2.5);
    result.t_end_s =
        410;  // a hundred rows; two missed contacts in the last, one false note in the row from 50 s on
    result.contacts.resize(3);
    result.contacts[0].t_s = 20;
    result.contacts[0].matched_id = 5;
    result.contacts[1].t_s = 409;
    result.contacts[2].t_s = 410;
    result.strikes.resize(1);
    result.strikes[0].id = 1;
    result.strikes[0].outcome = app::Outcome::released;
    result.strikes[0].onset_s = 53.9;
    const app::Timeline timeline = app::timeline_of(result);
    EXPECT_FALSE(timeline.whole);
    EXPECT_EQ(timeline.starts_s, (std::vector<double>{10, 14, 18, 22, 26, 30, 34, 38, 42, 46, 50, 406}));
}

TEST(PlotPanel, RoundStepsAreOneTwoOrFiveTimesAPowerOfTen) {
    EXPECT_DOUBLE_EQ(app::round_step(4, 8), 0.5);
    EXPECT_DOUBLE_EQ(app::round_step(100, 10), 10);
    EXPECT_DOUBLE_EQ(app::round_step(0.7, 4), 0.2);
    EXPECT_DOUBLE_EQ(app::round_step(600, 12), 50);
    for (const double none : {0.0, -1.0, std::nan(""), HUGE_VAL})
        EXPECT_EQ(app::round_tics("x", none, 4), app::round_tics("x", 1, 4)) << none;
}

TEST(PlotPanel, ANumberThatIsNotFiniteIsAGapInALine) {
    app::PlotPanel panel;
    panel.add("nan 1\n1 2\n2 3\n3 nan\n4 -inf\n5 6\n6 nan\n", "with lines");
    panel.add("1 nan\n", "with points");
    EXPECT_EQ(panel.text(), "plot '-' with lines\n1 2\n2 3\n\n5 6\ne\n");
}

TEST(PlotPanel, MarksWithinAPixelAreThinnedAndThoseOutsideLeftOut) {
    app::ThinnedMarks marks({0, 10, 0, 1, 100, 100});
    marks.add(5.01, 0.501);
    marks.add(5.02, 0.502);
    marks.add(5.02, 0.9);
    marks.add(10.1, 0.5);
    marks.add(std::nan(""), 0.5);
    marks.add(5.5, std::nan(""));
    EXPECT_EQ(marks.text(), "5.0100 0.5010 \n5.0200 0.9000 \n");
    app::ThinnedMarks flat({0, 10, 1, 1, 100, 100});
    flat.add(5, 1);
    EXPECT_EQ(flat.text(), "5.0000 1.0000 \n");
}

/// A ramp of a second: column i of ten holds the samples i / 10 to (i + 1) / 10 - 1 / 48000, the right
/// channel their negatives.
TEST(PlotPanel, TheEnvelopeIsTheLowestAndHighestSampleOfBothChannels) {
    std::vector<float> stereo;
    for (int i = 0; i < 48000; ++i) {
        const float ramp = static_cast<float>(i) / 48000;
        stereo.insert(stereo.end(), {ramp, -ramp});
    }
    std::istringstream lines(app::sound_envelope(stereo, 2, 2, 4, 20));
    for (int i = 0; i < 10; ++i) {
        double t = 0, low = 0, high = 0;
        ASSERT_TRUE(lines >> t >> low >> high) << i;
        EXPECT_NEAR(t, 2.05 + 0.1 * i, 1e-4);  // four decimals are written
        EXPECT_NEAR(high, 0.1 * (i + 1) - 1.0 / 48000, 1e-4);
        EXPECT_NEAR(low, -high, 1e-4);
    }
    std::string more;
    EXPECT_FALSE(lines >> more) << "nothing is drawn where there is no sound";
}

TEST(Gnuplot, AMistakeInAScriptIsReportedInOneLineWithItsMessage) {
    const TemporaryFolder here;
    app::Plotter plotter(here.path());
    const app::PlotScript good{100, 100, "plot x"};
    const std::vector<std::string> drawn = plotter.draw({good, {100, 100, "plot no_such_thing"}, good});
    EXPECT_TRUE(holds(plotter.failure(), "no_such_thing")) << plotter.failure();
    EXPECT_FALSE(holds(plotter.failure(), "\n"));
    EXPECT_TRUE(holds(drawn[0], "</svg>"));
    EXPECT_EQ(drawn[1], "");
    EXPECT_EQ(drawn[2], drawn[0]) << "the plots after it are drawn";
}

TEST(Gnuplot, AFigureThatCannotBeDrawnLeavesNoFileAndTheOthersAreWhole) {
    const TemporaryFolder here;
    fs::create_directory(here.path() / "figures");
    app::Plotter plotter(here.path());
    app::PlotGallery gallery;
    (void)gallery.add({100, 100, "plot no_such_thing"}, "bad");
    (void)gallery.add({100, 100, "plot x"}, "good");
    gallery.write_files(here.path() / "figures", plotter);
    EXPECT_TRUE(holds(plotter.failure(), "no_such_thing")) << plotter.failure();
    std::set<std::string> names;
    for (const fs::directory_entry& entry : fs::directory_iterator(here.path() / "figures"))
        names.insert(entry.path().filename().string());
    EXPECT_EQ(names, (std::set<std::string>{"02_good.png", "02_good.svg"}));
}

TEST(Html, EscapesMarkupAndControlCharacters) {
    EXPECT_EQ(app::html("<a href='x'>\"&\"</a>\n\x7f"),
              "&lt;a href=&#39;x&#39;&gt;&quot;&amp;&quot;&lt;/a&gt;  ");
}

}  // namespace
