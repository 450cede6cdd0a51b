#pragma once
#include <cstdint>
#include <memory>

struct osmesa_context;

namespace render {

/// An off-screen OpenGL 3.3 core context of OSMesa (software). Objects made in it end with it.
class OsmesaContext {
public:
    /// Makes the context and makes it current. Throws std::runtime_error if OSMesa makes none.
    OsmesaContext();
    ~OsmesaContext();
    OsmesaContext(const OsmesaContext&) = delete;
    OsmesaContext& operator=(const OsmesaContext&) = delete;

    /// Makes it current on the calling thread. Cheap when it already is.
    void make_current();

    using Function = void (*)();
    /// Address of an OpenGL function; null for an unknown name.
    [[nodiscard]] static Function function(const char* name);

private:
    osmesa_context* context_;
    std::uint8_t front_buffer_[4] = {};  // OSMesa wants one; the frames are drawn into framebuffer objects
};

}  // namespace render
