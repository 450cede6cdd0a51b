// Lateness of live sound: some seconds of notes on the wall clock; how much later than planned blocks began
// and were done. `musicworld_audio_bench [SECONDS] [--realtime] [--benchmark_format=json]`; with --realtime
// the audio thread asks for SCHED_FIFO 70; the last prints JSON as Google Benchmark does. `musicworld_audio_bench
// --mix [INSTRUMENT]`: how many times faster than real time sixteen sounding voices in a room are rendered.
#include <pthread.h>
#include <sched.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <stdexcept>
#include <string>
#include <vector>

#include "audio/live_performance.h"
#include "clocks.h"

namespace {

using audio::BlockTiming;

void ask_for_realtime() {
    sched_param priority{};
    priority.sched_priority = 70;
    if (pthread_setschedparam(pthread_self(), SCHED_FIFO, &priority) != 0) {
        throw std::runtime_error(
            "found no permission for SCHED_FIFO, expected CAP_SYS_NICE or an rtprio limit; leave out "
            "--realtime");
    }
}

/// Quantile, linear between the order statistics (Hyndman and Fan 1996, definition 7); sorts the values.
double ms_at(std::vector<std::int64_t>& values, double p) {
    std::ranges::sort(values);
    const double at = p * static_cast<double>(values.size() - 1);
    const auto below = static_cast<std::size_t>(at), above = std::min(below + 1, values.size() - 1);
    return 1e-6 * std::lerp(static_cast<double>(values[below]), static_cast<double>(values[above]),
                            at - static_cast<double>(below));
}

struct Lateness {
    const char* name;
    std::vector<std::int64_t> ns;
};

void print(Lateness& of) {
    std::printf("%-18s p50 %7.3f  p95 %7.3f  p99 %7.3f  max %7.3f ms\n", of.name, ms_at(of.ns, 0.5),
                ms_at(of.ns, 0.95), ms_at(of.ns, 0.99), ms_at(of.ns, 1));
}

void print_json(Lateness& of, bool first) {
    const struct {
        const char* name;
        double fraction;
    } kinds[] = {{"p50", 0.5}, {"p95", 0.95}, {"p99", 0.99}, {"max", 1}};
    for (const auto& kind : kinds) {
        std::printf("%s\n{\"name\": \"%s/%s\", \"cpu_time\": %.6f, \"time_unit\": \"ms\"}", first ? "" : ",",
                    of.name, kind.name, ms_at(of.ns, kind.fraction));
        first = false;
    }
}

/// A kit's worth of voices, sixteen strokes per second.
std::vector<audio::Voice> voices() {
    const auto voice = [](const char* instrument) {
        return audio::Voice{instrument, instrument, {}, 0.5, 0, ""};
    };
    return {voice("drum"), voice("drum"), voice("cymbal"), voice("bell"), voice("string"), voice("cymbal")};
}

/// Returns the blocks of real time.
std::vector<BlockTiming> play(audio::LivePerformance& live, double seconds) {
    std::vector<BlockTiming> blocks;
    const auto take = [&] {
        for (const BlockTiming& block : live.take_blocks()) blocks.push_back(block);
    };
    const std::int64_t epoch = audio::monotonic_ns() + 100'000'000;
    live.start(epoch);
    for (std::uint64_t id = 1; static_cast<double>(id) / 16 < seconds; ++id) {
        const auto onset = static_cast<std::int64_t>(id) * audio::kSampleRate / 16;
        audio::sleep_until_ns(epoch + audio::samples_ns(onset) - 66'000'000);
        audio::Note note{
            .id = id, .voice = static_cast<std::uint32_t>(id % 6), .onset_sample = onset, .speed_mps = 4};
        live.schedule(note);
        take();
    }
    audio::sleep_until_ns(epoch + static_cast<std::int64_t>(1e9 * seconds));
    take();
    return blocks;
}

void report(const audio::LivePerformance& live, const std::vector<BlockTiming>& blocks, bool json) {
    Lateness all[] = {{"started - planned", {}}, {"done - started", {}}, {"done - planned", {}}};
    for (const BlockTiming& block : blocks) {
        all[0].ns.push_back(block.started_ns - block.planned_ns);
        all[1].ns.push_back(block.done_ns - block.started_ns);
        all[2].ns.push_back(block.done_ns - block.planned_ns);
    }
    if (json) {
        std::printf("{\"benchmarks\": [");
        for (Lateness& one : all) print_json(one, &one == all);
        std::printf("]}\n");
        return;
    }
    std::printf("%s, %zu blocks of %d samples (%.3f ms)\n", live.version().c_str(), all[0].ns.size(),
                live.block_size(), 1e3 * live.block_size() / audio::kSampleRate);
    for (Lateness& one : all) print(one);
    std::printf("processor time %.3f s\n", live.busy_s());
}

/// 20 s of sixteen voices in a room, each struck every two seconds at 5 m/s, so that sixteen to forty notes sound: a drum kit of
/// eight toms and snares, four cymbals, two bells and two strings, or sixteen of one instrument.
void report_mix(const std::string& instrument) {
    std::vector<audio::Voice> sixteen;
    for (int i = 0; i < 16; ++i) {
        const char* of_kit = i < 8 ? "drum" : i < 12 ? "cymbal" : i < 14 ? "bell" : "string";
        const std::string name = instrument.empty() ? of_kit : instrument;
        sixteen.push_back({name, name, {}, i / 15.0, 0, ""});
    }
    audio::Performance performance(MUSICWORLD_SOURCE_DIR "/assets/orchestra/musicworld.orc", sixteen,
                                   {.gain_db = 0, .room = {.t60_s = 1, .level_db = -14}, .alone = {}});
    constexpr int kSeconds = 20;
    std::uint64_t id = 0;
    for (int stroke = 0; stroke < kSeconds / 2; ++stroke)
        for (std::uint32_t voice = 0; voice < 16; ++voice)
            performance.schedule(
                {.id = ++id, .voice = voice, .onset_sample = 96000 * stroke + 5987 * voice, .speed_mps = 5});
    (void)performance.finish(kSeconds * audio::kSampleRate, 0);
    std::printf("16 voices in a room (%s): %.3f s of processor time for %d s, %.1f times real time\n",
                instrument.empty() ? "a kit" : instrument.c_str(), performance.busy_s(), kSeconds,
                kSeconds / performance.busy_s());
}

}  // namespace

int main(int count, char** arguments) {
    if (count > 2 && std::strcmp(arguments[1], "--mix") == 0) {
        report_mix(arguments[2]);
        return 0;
    }
    if (count > 1 && std::strcmp(arguments[1], "--mix") == 0) {
        for (const char* instrument : {"", "drum", "bell", "string", "cymbal"}) report_mix(instrument);
        return 0;
    }
    double seconds = 10;
    bool json = false;
    audio::LiveOptions options;
    for (int i = 1; i < count; ++i) {
        if (std::strcmp(arguments[i], "--realtime") == 0) {
            options.on_thread_start = ask_for_realtime;
        } else if (std::strcmp(arguments[i], "--benchmark_format=json") == 0) {
            json = true;
        } else {
            seconds = std::stod(arguments[i]);
        }
    }
    options.longest_s = seconds + 1;
    try {
        audio::LivePerformance live(MUSICWORLD_SOURCE_DIR "/assets/orchestra/musicworld.orc", voices(),
                                    options);
        const std::vector<BlockTiming> blocks = play(live, seconds);
        (void)live.finish(0, 0);
        report(live, blocks, json);
    } catch (const std::exception& error) {
        std::fprintf(stderr, "error: %s\n", error.what());
        return 1;
    }
}
