/// Time of one picture of the kit in kit_scene.cpp, by stage. The first frame (shaders are compiled in it) is
/// drawn before measuring.
#include <benchmark/benchmark.h>

#include "kit_scene.h"
#include "render/renderer.h"

namespace {

const char* const kMeshes = MUSICWORLD_SOURCE_DIR "/assets/meshes";

void draw_kit(benchmark::State& state, render::SceneDescription scene, bool png) {
    render::Renderer renderer(scene);
    render::Image image;
    renderer.draw(render_bench::kit_frame(0), image);
    int frame = 0;
    for (auto _ : state) {
        renderer.draw(render_bench::kit_frame(++frame / 30.0), image);
        if (png) benchmark::DoNotOptimize(render::encode_png(image));
    }
    state.SetLabel(std::to_string(renderer.triangles()) + " triangles");
}

void frame_640x480_with_png(benchmark::State& state) {
    draw_kit(state, render_bench::kit_scene(kMeshes), true);
}

void frame_640x480(benchmark::State& state) {
    draw_kit(state, render_bench::kit_scene(kMeshes), false);
}

void frame_640x480_without_antialiasing(benchmark::State& state) {
    render::SceneDescription scene = render_bench::kit_scene(kMeshes);
    scene.samples = 1;
    draw_kit(state, scene, false);
}

void frame_640x480_without_shadow(benchmark::State& state) {
    render::SceneDescription scene = render_bench::kit_scene(kMeshes);
    scene.shadow_size = 0;
    draw_kit(state, scene, false);
}

void frame_640x480_empty_room(benchmark::State& state) {
    render::SceneDescription scene = render_bench::kit_scene(kMeshes);
    scene.objects.clear();
    render::Renderer renderer(scene);
    render::Image image;
    for (auto _ : state) renderer.draw({}, image);
}

void frame_1280x720_with_png(benchmark::State& state) {
    render::SceneDescription scene = render_bench::kit_scene(kMeshes);
    scene.width = 1280;
    scene.height = 720;
    draw_kit(state, scene, true);
}

void start_and_first_frame(benchmark::State& state) {
    for (auto _ : state) {
        render::Renderer renderer(render_bench::kit_scene(kMeshes));
        render::Image image;
        renderer.draw(render_bench::kit_frame(0), image);
    }
}

BENCHMARK(frame_640x480_with_png)->Unit(benchmark::kMillisecond)->MeasureProcessCPUTime()->UseRealTime();
BENCHMARK(frame_640x480)->Unit(benchmark::kMillisecond)->MeasureProcessCPUTime()->UseRealTime();
BENCHMARK(frame_640x480_without_antialiasing)
    ->Unit(benchmark::kMillisecond)
    ->MeasureProcessCPUTime()
    ->UseRealTime();
BENCHMARK(frame_640x480_without_shadow)
    ->Unit(benchmark::kMillisecond)
    ->MeasureProcessCPUTime()
    ->UseRealTime();
BENCHMARK(frame_640x480_empty_room)->Unit(benchmark::kMillisecond)->MeasureProcessCPUTime()->UseRealTime();
BENCHMARK(frame_1280x720_with_png)->Unit(benchmark::kMillisecond)->MeasureProcessCPUTime()->UseRealTime();
BENCHMARK(start_and_first_frame)->Unit(benchmark::kMillisecond)->MeasureProcessCPUTime()->UseRealTime();

}  // namespace
