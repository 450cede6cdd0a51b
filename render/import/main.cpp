/// musicworld_mesh_import FILE: reads a mesh file with assimp under limits on memory and processor time and
/// writes it to standard output as the stream of mesh_stream.h. Started by load_mesh(); ends with 0 also when
/// the stream tells of a failure.
#include <sys/resource.h>

#include <cstdio>
#include <exception>
#include <stdexcept>

#include "assimp_mesh.h"
#include "mesh_stream.h"

namespace {

void limit(__rlimit_resource resource, rlim_t most) {
    const rlimit value{most, most};
    setrlimit(resource, &value);
}

void limit_this_process() {
    limit(RLIMIT_CPU, 10);  // seconds
    limit(RLIMIT_CORE, 0);
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
    limit(RLIMIT_AS, rlim_t{2} << 30);  // the sanitizers' shadow memory alone is far larger
#endif
}

std::string import_stream(const char* file) {
    try {
        return render::encode_mesh_stream(render::import_with_assimp(file));
    } catch (const std::exception& error) {
        return render::encode_mesh_failure(error.what());
    }
}

}  // namespace

int main(int count, char** arguments) {
    if (count != 2) {
        std::fputs("usage: musicworld_mesh_import FILE > STREAM\n", stderr);
        return 2;
    }
    limit_this_process();
    const std::string stream = import_stream(arguments[1]);
    const bool written =
        std::fwrite(stream.data(), 1, stream.size(), stdout) == stream.size() && std::fflush(stdout) == 0;
    return written ? 0 : 1;
}
