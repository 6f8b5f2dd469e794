/* paper_head.c - Fig. 3: one model as zero level, springls, capsules and surfels. */
#include "springls.h"

#include "paper.h"

#include "examples/common/base/vec3.h"
#include "examples/common/imaging/resample.h"
#include "examples/common/imaging/segment_image.h"
#include "examples/common/springls/segment_model.h"
#include "examples/common/springls/volume_raycast.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

static const char *const head_file = "/usr/share/mricron/templates/ch2.nii.gz";
enum { HEAD_LEVEL = 34, PANELS = 4, PANEL_WIDTH = 300, PANEL_HEIGHT = 320, INSET = 120, ZOOM = 4 };
static const float head_voxel = 1.8f; /* mm: 120 voxels from chin to crown */

/* Makes the level set of the head in a scan: skin, and all within. */
static float *read_head(struct volume *cubes)
{
    struct volume image;
    char error[VOLUME_TEXT];
    if (!volume_read(head_file, 0, &image, error)) {
        fprintf(stderr, "paper: %s\n", error);
        return NULL;
    }
    float *blurred = malloc(volume_voxels(&image) * sizeof *blurred);
    if (blurred) {
        memcpy(blurred, image.data, volume_voxels(&image) * sizeof *blurred);
    }
    const bool made = blurred && segment_blur(&image, head_voxel, blurred) && volume_create_cubes(&image, head_voxel, 2, cubes);
    if (made) {
        resample_volume(&image, blurred, NULL, cubes, cubes->data, NULL);
    }
    free(blurred);
    volume_free(&image);
    if (!made) {
        return NULL;
    }
    for (size_t n = 0; n < volume_voxels(cubes); ++n) { /* what the resampling repeats beyond the image's border is outside */
        int at[3];
        bool border = false;
        volume_place(cubes->dims, n, at);
        for (int k = 0; k < 3; ++k) {
            border = border || at[k] < 3 || at[k] >= cubes->dims[k] - 3;
        }
        cubes->data[n] = border ? (float)HEAD_LEVEL : (float)HEAD_LEVEL - cubes->data[n];
    }
    return segment_keep_largest(cubes->dims, cubes->data) ? cubes->data : NULL;
}

/* Makes the model of the head with the paper's parameters; its springls have relaxed once. */
static springls_context *head_model(void)
{
    struct volume cubes;
    springls_context *ctx = NULL;
    springls_desc desc = springls_default_desc();
    const springls_params params = springls_paper_params();
    memset(&cubes, 0, sizeof cubes);
    const float *phi = read_head(&cubes);
    desc.params = &params;
    if (phi) {
        desc.grid = segment_model_grid(cubes.dims, cubes.spacing, cubes.origin, &cubes.direction[0][0]);
    }
    if (phi && springls_create(&desc, &ctx) == SPRINGLS_OK
        && (springls_set_threshold(ctx, phi, -FLT_MAX, 0.0f) != SPRINGLS_OK
            || springls_run_stage(ctx, SPRINGLS_STAGE_RELAX) != SPRINGLS_OK)) {
        fprintf(stderr, "paper: Fig. 3: %s\n", springls_last_error(ctx));
        springls_destroy(ctx);
        ctx = NULL;
    }
    volume_free(&cubes);
    return ctx;
}

struct head_scenes {
    struct volume_scene shapes[PANELS]; /* the first stays empty: the zero level */
    struct raycast_camera camera;
};

static bool make_scenes(springls_context *ctx, struct head_scenes *scenes)
{
    static const float direction[3] = {-0.62f, 1.0f, 0.12f}, up[3] = {0.0f, 0.0f, 1.0f};
    const int count = springls_count(ctx);
    const springls_params params = springls_paper_params();
    springls_mesh soup; /* world coordinates, which views of the vertices have not */
    float *surfels = malloc(((size_t)count + 1) * 7 * sizeof *surfels);
    memset(scenes, 0, sizeof *scenes);
    if (!surfels || springls_extract_soup(ctx, &soup) != SPRINGLS_OK) {
        free(surfels);
        return false;
    }
    scenes->camera = raycast_frame_points(soup.positions, (size_t)soup.vertex_count, direction, up, 20.0f,
                                          (float)PANEL_WIDTH / PANEL_HEIGHT);
    const float thin = params.particle_radius * head_voxel, wide = params.d_max * head_voxel;
    const bool good = springls_extract_surfels(ctx, surfels) == SPRINGLS_OK
                   && volume_scene_capsules(soup.positions, soup.triangle_count, thin, head_voxel, &scenes->shapes[1])
                   && volume_scene_capsules(soup.positions, soup.triangle_count, wide, head_voxel, &scenes->shapes[2])
                   && volume_scene_surfels(surfels, count, head_voxel, &scenes->shapes[3]);
    springls_mesh_free(ctx, &soup);
    free(surfels);
    return good;
}

/* Turns the camera to the place of the surface behind a place of the picture, and enlarges. */
static struct raycast_camera close_camera(springls_context *ctx, const struct raycast_camera *camera)
{
    struct raycast_camera close = *camera;
    const struct raycast_frame frame = raycast_camera_frame(camera, (float)PANEL_WIDTH / PANEL_HEIGHT);
    float origin[3], direction[3];
    springls_hit hit;
    raycast_camera_ray(camera, &frame, -0.1f, -0.42f, origin, direction);
    if (springls_raycast(ctx, SPRINGLS_SURFACE_WATERTIGHT, origin, direction, 1, 0.0f, &hit) == SPRINGLS_OK && hit.springl >= 0) {
        memcpy(close.target, hit.point, sizeof close.target);
    }
    close.field_of_view = camera->field_of_view * INSET / PANEL_HEIGHT / ZOOM;
    return close;
}

static bool draw_panel(springls_context *ctx, const struct head_scenes *scenes, int panel, struct image *image)
{
    const struct volume_scene *shape = panel > 0 ? &scenes->shapes[panel] : NULL;
    const struct raycast_camera close = close_camera(ctx, &scenes->camera);
    struct image inset = {0, 0, NULL};
    const bool good = volume_picture(ctx, shape, head_voxel, &scenes->camera, PANEL_WIDTH, PANEL_HEIGHT, image)
                   && volume_picture(ctx, shape, head_voxel, &close, INSET, INSET, &inset);
    if (good) {
        image_paste(image, &inset, PANEL_WIDTH - INSET, PANEL_HEIGHT - INSET);
        image_frame(image, PANEL_WIDTH - INSET - 1.0f, PANEL_HEIGHT - INSET - 1.0f, PANEL_WIDTH, PANEL_HEIGHT, 1.5f,
                    color_rgb(0.3f, 0.3f, 0.3f));
    }
    image_free(&inset);
    return good;
}

void paper_fig3(struct paper *paper)
{
    static const char *const labels[PANELS] = {"zero level", "springls", "capsules, d_max", "surfels"};
    struct image images[PANELS];
    struct head_scenes scenes;
    springls_context *ctx = head_model();
    memset(images, 0, sizeof images);
    bool good = ctx && make_scenes(ctx, &scenes);
    for (int p = 0; p < PANELS && good; ++p) {
        good = draw_panel(ctx, &scenes, p, &images[p]);
    }
    if (good) {
        paper_say(paper, "%d springls.\n", springls_count(ctx));
    }
    paper_strip(paper, images, labels, PANELS, PANELS, 1000, "fig03.png",
                "Fig. 3: one model by volumetric ray casting: zero level, springls, their capsules, surfels");
    for (int p = 1; p < PANELS && ctx; ++p) {
        volume_scene_free(&scenes.shapes[p]);
    }
    springls_destroy(ctx);
}
