/* gltf_draco.cpp - Draco's decoder, which is C++, for C. */
#include "surface/gltf_draco.h"

#include <draco/compression/decode.h>

#include <cstdint>
#include <exception>
#include <memory>

struct gltf_draco {
    std::unique_ptr<draco::Mesh> mesh;
};

namespace {

const size_t most = size_t(1) << 27;

template <typename Number>
bool copy_values(const draco::PointAttribute &attribute, size_t vertices, double *values)
{
    const int width = attribute.num_components();
    Number number[UINT8_MAX];
    for (size_t v = 0; v < vertices; ++v) {
        const draco::AttributeValueIndex at = attribute.mapped_index(draco::PointIndex(uint32_t(v)));
        if (at.value() >= attribute.size() || !attribute.ConvertValue<Number>(at, int8_t(width), number)) {
            return false;
        }
        for (int i = 0; i < width; ++i) {
            *values++ = double(number[i]);
        }
    }
    return true;
}

} // namespace

/* Draco does not throw, but what it allocates may. */
struct gltf_draco *gltf_draco_decode(const unsigned char *bytes, size_t size, const char **reason)
{
    try {
        draco::DecoderBuffer buffer;
        draco::Decoder decoder;
        buffer.Init(reinterpret_cast<const char *>(bytes), size);
        auto decoded = decoder.DecodeMeshFromBuffer(&buffer);
        if (!decoded.ok() || !decoded.value()) {
            *reason = "cannot be decoded";
            return nullptr;
        }
        std::unique_ptr<gltf_draco> made(new gltf_draco{std::move(decoded).value()});
        if (made->mesh->num_points() > most || made->mesh->num_faces() > most) {
            *reason = "has too many triangles";
            return nullptr;
        }
        for (uint32_t f = 0; f < made->mesh->num_faces(); ++f) {
            for (const draco::PointIndex &corner : made->mesh->face(draco::FaceIndex(f))) {
                if (corner.value() >= made->mesh->num_points()) {
                    *reason = "names vertices that there are not";
                    return nullptr;
                }
            }
        }
        return made.release();
    } catch (const std::exception &) {
        *reason = "takes more memory than there is";
        return nullptr;
    }
}

void gltf_draco_free(struct gltf_draco *mesh) { delete mesh; }

size_t gltf_draco_vertices(const struct gltf_draco *mesh) { return mesh->mesh->num_points(); }

size_t gltf_draco_triangles(const struct gltf_draco *mesh) { return mesh->mesh->num_faces(); }

void gltf_draco_corners(const struct gltf_draco *mesh, int *corners)
{
    for (uint32_t f = 0; f < mesh->mesh->num_faces(); ++f) {
        for (const draco::PointIndex &corner : mesh->mesh->face(draco::FaceIndex(f))) {
            *corners++ = int(corner.value());
        }
    }
}

int gltf_draco_width(const struct gltf_draco *mesh, unsigned id)
{
    const draco::PointAttribute *attribute = mesh->mesh->GetAttributeByUniqueId(id);
    return attribute ? attribute->num_components() : 0;
}

bool gltf_draco_values(const struct gltf_draco *mesh, unsigned id, double *values)
{
    const draco::PointAttribute *attribute = mesh->mesh->GetAttributeByUniqueId(id);
    const size_t vertices = mesh->mesh->num_points();
    if (!attribute) {
        return false;
    }
    switch (attribute->data_type()) {
    case draco::DT_FLOAT32: return copy_values<float>(*attribute, vertices, values);
    case draco::DT_UINT32: return copy_values<uint32_t>(*attribute, vertices, values);
    default: return copy_values<int32_t>(*attribute, vertices, values);
    }
}
