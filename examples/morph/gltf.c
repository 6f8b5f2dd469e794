/* gltf.c - writes a morph as glTF: all frames as a sequence, and the end as a skinned body in the neutral pose. */
#include "morph/morph.h"

#include "base/progress.h"
#include "base/threads.h"
#include "character/clip_transfer.h"
#include "character/gltf_character.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Prepares a frame as it is written: cut into the charts of its own texture, with `size` texels a side; 0: with colors at
 * vertices. */
static bool dress(const struct morph *morph, const struct morph_frame *frame, int size, int material, struct textured_mesh *d)
{
    const struct gltf_mesh plain = {.positions = frame->mesh.positions,
                                    .normals = frame->mesh.normals,
                                    .colors = frame->colors,
                                    .triangles = frame->mesh.triangles,
                                    .vertex_count = frame->mesh.vertex_count,
                                    .triangle_count = frame->mesh.triangle_count};
    memset(d, 0, sizeof *d);
    d->mesh = plain;
    return size == 0 || morph_bake(morph, frame, &plain, size, material, d);
}

static struct material textured(int image)
{
    struct material material = material_plain();
    snprintf(material.name, sizeof material.name, "frame %d", image);
    material.image = image;
    return material;
}

struct dress_loop {
    const struct morph *morph;
    int size;
    struct textured_mesh *dressed;
    struct progress *bar;
    int *done;
    bool *good;
};

static void run_dress_loop(void *arg, int begin, int end)
{
    const struct dress_loop *loop = arg;
    const struct morph *morph = loop->morph;
    const int size = loop->size;
    struct textured_mesh *dressed = loop->dressed;
    struct progress *bar = loop->bar;
    int *done = loop->done;
    bool good = true;
    for (int f = begin; f < end; ++f) {
        good = good && dress(morph, &morph->frames[f], size, f, &dressed[f]);
        threads_lock();
        progress_update(bar, (size_t)++*done, NULL);
        threads_unlock();
    }
    threads_lock();
    *loop->good = *loop->good && good;
    threads_unlock();
}

static bool write_sequence(const struct morph *morph, const char *path)
{
    const int count = morph->frame_count, size = morph->settings.texture;
    const size_t room = (size_t)count + 1;
    struct textured_mesh *dressed = calloc(room, sizeof *dressed);
    struct gltf_mesh *meshes = malloc(room * sizeof *meshes);
    struct material *materials = malloc(room * sizeof *materials);
    struct picture *pictures = malloc(room * sizeof *pictures);
    struct progress bar;
    int done = 0;
    bool good = dressed && meshes && materials && pictures;
    progress_begin(&bar, "textures", (size_t)count, morph->settings.common.quiet || size == 0);
    struct dress_loop loop = {morph, size, dressed, &bar, &done, &good};
    threads_for(good ? count : 0, 1, run_dress_loop, &loop);
    progress_end(&bar);
    for (int f = 0; good && f < count; ++f) {
        meshes[f] = dressed[f].mesh;
        materials[f] = textured(f);
        pictures[f] = dressed[f].picture;
    }
    const struct gltf_look look = {materials, pictures, count, count};
    good = good ? gltf_write_sequence(path, meshes, count, morph->settings.fps, size > 0 ? &look : NULL)
                      || cli_write_failed("morph", path)
                : morph_fail("%s: the textures cannot be baked (--texture %d)", path, size);
    for (int f = 0; dressed && f < count; ++f) {
        textured_mesh_free(&dressed[f]);
    }
    free(dressed);
    free(meshes);
    free(materials);
    free(pictures);
    return good;
}

/* Writes a body with the target's skeleton, all clips of the target and those of the source. */
static bool write_with_clips(const struct morph *morph, const char *path, const struct gltf_mesh *mesh,
                             const struct influences *influences, const struct gltf_look *look)
{
    struct character with = morph->target.character;
    const size_t own = (size_t)with.animation_count;
    struct animation *clips, *all = NULL;
    int count;
    if (!clips_transfer(&morph->source.character, &morph->alignment, &with, morph->settings.fps, &clips, &count)) {
        return morph_no_memory();
    }
    all = malloc((own + (size_t)count + 1) * sizeof *all);
    if (all) {
        memcpy(all, with.animations, own * sizeof *all);
        memcpy(all + own, clips, (size_t)count * sizeof *all);
        with.animations = all;
        with.animation_count += count;
    }
    const bool good = all ? gltf_write_skinned(path, mesh, influences, look, &with) || cli_write_failed("morph", path)
                          : morph_no_memory();
    free(all);
    clips_free(clips, count);
    return good;
}

/* Writes the end in the neutral pose with bone weights: a body that any engine can animate. Its texture is twice as wide. */
static bool write_skinned(const struct morph *morph, const char *path)
{
    const struct morph_frame *rest = &morph->rest;
    const int size = 2 * morph->settings.texture;
    struct textured_mesh d;
    bool good = dress(morph, rest, size, 0, &d) || morph_fail("%s: the texture cannot be baked (--texture %d)", path, size / 2);
    struct influences *influences = good ? malloc(((size_t)d.mesh.vertex_count + 1) * sizeof *influences) : NULL;
    const struct material material = textured(0);
    const struct gltf_look look = {&material, &d.picture, 1, 1};
    good = good && (influences || morph_no_memory());
    for (int v = 0; good && v < d.mesh.vertex_count; ++v) {
        influences[v] = morph_mixed_influences(morph, rest, size > 0 ? d.atlas.vertex_of[v] : v);
    }
    good = good && write_with_clips(morph, path, &d.mesh, influences, size > 0 ? &look : NULL);
    free(influences);
    textured_mesh_free(&d);
    return good;
}

bool morph_write_gltf(const struct morph *morph)
{
    char sequence[1200], skinned[1200];
    run_path(morph->settings.common.out, "morph.glb", sequence, sizeof sequence);
    run_path(morph->settings.common.out, "skinned.glb", skinned, sizeof skinned);
    return write_sequence(morph, sequence) && write_skinned(morph, skinned);
}
