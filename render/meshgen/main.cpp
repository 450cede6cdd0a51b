/// musicworld_meshgen DIRECTORY: writes the project's own meshes as OBJ files.
#include <cstdio>
#include <fstream>
#include <string>

#include "shapes.h"

int main(int count, char** arguments) {
    if (count != 2) {
        std::fputs("usage: musicworld_meshgen DIRECTORY\n", stderr);
        return 2;
    }
    for (const meshgen::ObjMesh& mesh : meshgen::all_shapes()) {
        const std::string file = std::string(arguments[1]) + "/" + mesh.name + ".obj";
        std::ofstream out(file, std::ios::binary);
        out << mesh.text() << std::flush;
        if (!out) {
            std::fprintf(stderr, "%s: error: found no way to write it, expected a writable folder\n",
                         file.c_str());
            return 1;
        }
    }
    return 0;
}
