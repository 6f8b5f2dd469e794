#include "character/skeleton_picture.h"

#include "base/vec3.h"

#include <string.h>

void influences_color(const struct influences *influences, float color[3])
{
    memset(color, 0, 3 * sizeof *color);
    for (int k = 0; k < CHARACTER_BONES; ++k) {
        const int joint = influences->joint[k];
        const struct color c = color_hsv(0.618034f * (float)joint, 0.5f, joint % 2 ? 0.95f : 0.75f);
        const float rgb[3] = {c.r, c.g, c.b};
        vec3_add_scaled(color, influences->weight[k], rgb, color);
    }
}

/* Computes the place of a point in a picture, pixels. */
static void project(const struct raycast_camera *camera, const struct raycast_frame *frame, int width, int height, const float point[3],
                    float pixel[2])
{
    float d[3];
    vec3_sub(point, camera->eye, d);
    const float depth = vec3_dot(d, frame->forward);
    pixel[0] = 0.5f * (float)width * (1.0f + vec3_dot(d, frame->right) / (depth * frame->half_width));
    pixel[1] = 0.5f * (float)height * (1.0f - vec3_dot(d, frame->up) / (depth * frame->half_height));
}

bool skeleton_picture(const struct raycast_scene *scene, const struct character *character, const float *places, bool bones, int width,
                      int height, struct image *image)
{
    if (!raycast_render(scene, width, height, image)) { return false; }
    const struct raycast_frame frame = raycast_camera_frame(&scene->camera, (float)width / (float)height);
    for (int j = 0; j < character->joint_count; ++j) {
        const struct joint *joint = &character->joints[j];
        const int parent = joint->parent >= 0 ? joint->parent : j;
        float from[2], to[2];
        if (bones && !(joint->bone && character->joints[parent].bone)) { continue; }
        project(&scene->camera, &frame, width, height, places + 3 * j, from);
        project(&scene->camera, &frame, width, height, places + 3 * parent, to);
        const struct color ink = strstr(joint->name, ".L") ? color_rgb(0.75f, 0.0f, 0.0f) : color_rgb(0.1f, 0.1f, 0.1f);
        image_line(image, from[0], from[1], to[0], to[1], 2.0f, ink);
        image_disc(image, from[0], from[1], 3.0f, ink);
    }
    return true;
}
