/* meshes.c - the surfaces of a layer's labels, in mm, with normals, volumes and areas. */
#include "surfaces/surfaces.h"

#include "base/threads.h"
#include "base/vec3.h"

#include <stdlib.h>
#include <string.h>

/* The net, and its vertices sorted by labels. */
struct work {
    struct surfaces *run;
    size_t from;
    struct net net;
    uint32_t *vertices;
    bool mirrored; /* the axes of the voxels are left-handed */
    bool failed;
};

/* Finds a label of the layer; 0 is none. */
static struct surfaces_label *label_of(const struct work *work, uint32_t id)
{
    size_t low = work->from, high = work->run->count;
    while (low < high) {
        const size_t middle = (low + high) / 2;
        if (work->run->labels[middle].id < id) {
            low = middle + 1;
        } else {
            high = middle;
        }
    }
    return id == 0 ? NULL : &work->run->labels[low];
}

/* Sorts the vertices by the labels that they have at their corners. */
static bool sort_vertices(struct work *work)
{
    const struct net *net = &work->net;
    size_t sum = 0;
    for (size_t e = 0; e < net->first[net->count]; ++e) {
        struct surfaces_label *label = label_of(work, net->labels[e]);
        if (label) {
            ++label->count;
        }
    }
    for (size_t l = work->from; l < work->run->count; ++l) {
        work->run->labels[l].first = sum;
        sum += work->run->labels[l].count;
        work->run->labels[l].count = 0;
    }
    work->vertices = malloc((sum + 1) * sizeof *work->vertices);
    for (size_t v = 0; work->vertices && v < net->count; ++v) {
        for (size_t e = net->first[v]; e < net->first[v + 1]; ++e) {
            struct surfaces_label *label = label_of(work, net->labels[e]);
            if (label) {
                work->vertices[label->first + label->count++] = (uint32_t)v;
            }
        }
    }
    return work->vertices != NULL;
}

/* Takes the vertices to mm, and turns triangles that this mirrors. */
static void to_world(const struct work *work, struct label_surface *mesh)
{
    for (size_t v = 0; v < mesh->vertex_count; ++v) {
        volume_index_to_world(&work->run->map, mesh->places + 3 * v, mesh->places + 3 * v);
    }
    for (size_t t = 0; work->mirrored && t < mesh->triangle_count; ++t) {
        uint32_t *corner = mesh->triangles + 3 * t;
        const uint32_t first = corner[0];
        corner[0] = corner[1];
        corner[1] = first;
    }
}

/* Computes area, volume (divergence theorem, about the first vertex) and the vertices' normals, weighted by area. */
static void measure(struct surfaces_label *label)
{
    const struct label_surface *mesh = &label->mesh;
    for (size_t t = 0; t < mesh->triangle_count; ++t) {
        const uint32_t *corner = mesh->triangles + 3 * t;
        float a[3], b[3], c[3], normal[3];
        vec3_sub(mesh->places + 3 * (size_t)corner[0], mesh->places, a);
        vec3_sub(mesh->places + 3 * (size_t)corner[1], mesh->places + 3 * (size_t)corner[0], b);
        vec3_sub(mesh->places + 3 * (size_t)corner[2], mesh->places + 3 * (size_t)corner[0], c);
        vec3_cross(b, c, normal);
        label->area += 0.5 * (double)vec3_length(normal);
        label->volume += (double)vec3_dot(a, normal) / 6.0;
        for (int k = 0; k < 3; ++k) {
            vec3_add_scaled(label->normals + 3 * (size_t)corner[k], 1.0f, normal, label->normals + 3 * (size_t)corner[k]);
        }
    }
    for (size_t v = 0; v < mesh->vertex_count; ++v) {
        vec3_normalize(label->normals + 3 * v);
    }
}

static void make_labels(void *arg, int begin, int end)
{
    struct work *work = arg;
    const struct surfaces *run = work->run;
    for (int l = begin; l < end; ++l) {
        struct surfaces_label *label = &run->labels[work->from + (size_t)l];
        if (!label->chosen) {
            continue;
        }
        if (net_label(&work->net, run->map.dims, run->map.ids, label->id, work->vertices + label->first, label->count, &label->mesh)
            && (label->normals = calloc(3 * label->mesh.vertex_count + 1, sizeof *label->normals)) != NULL) {
            to_world(work, &label->mesh);
            measure(label);
        } else {
            threads_lock();
            work->failed = true;
            threads_unlock();
        }
    }
}

bool surfaces_make(struct surfaces *run, size_t from)
{
    struct work work = {.run = run, .from = from};
    const float(*d)[3] = (const float(*)[3])run->map.direction;
    float normal[3];
    const float x[3] = {d[0][0], d[1][0], d[2][0]}, y[3] = {d[0][1], d[1][1], d[2][1]}, z[3] = {d[0][2], d[1][2], d[2][2]};
    vec3_cross(x, y, normal);
    work.mirrored = vec3_dot(normal, z) < 0.0f;
    bool good = net_create(run->map.dims, run->map.ids, &work.net)
        && net_smooth(&work.net, run->map.dims, run->map.ids, run->settings.smooth) && sort_vertices(&work);
    good = good && (!run->settings.common.out || surfaces_make_walls(run, &work.net, work.mirrored));
    if (good) {
        threads_for((int)(run->count - from), 1, make_labels, &work);
        good = !work.failed;
    }
    free(work.vertices);
    net_free(&work.net);
    return good || surfaces_no_memory();
}
