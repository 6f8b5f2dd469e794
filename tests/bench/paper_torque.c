/* paper_torque.c - Fig. 6: relaxation with physical and with normalized torque. */
#include "springls.h"

#include "paper.h"

#include "examples/common/base/vec3.h"

#include <math.h>
#include <string.h>

enum { TORQUES = 2, RELAXATIONS = 12, TRIO_VIEW = 300, MAX_SPRINGLS = 4000 };

struct soup {
    int count;
    uint8_t kept[MAX_SPRINGLS]; /* 1: not relaxed */
    float vertices[9 * MAX_SPRINGLS], particles[3 * MAX_SPRINGLS];
};

/* Adds the springls of a ball; what unsigned_to_signed wants is a body. */
static bool add_ball(const float center[3], float radius, struct soup *soup)
{
    springls_desc desc = springls_default_desc();
    springls_sphere ball = {{center[0], center[1], center[2]}, radius};
    springls_context *ctx;
    desc.grid.size[0] = desc.grid.size[1] = desc.grid.size[2] = 32;
    if (springls_create(&desc, &ctx) != SPRINGLS_OK) {
        return false;
    }
    const bool good = springls_set_implicit(ctx, springls_implicit_sphere, &ball) == SPRINGLS_OK
                   && springls_count(ctx) < MAX_SPRINGLS - 4;
    const springls_view view = springls_view_vertices(ctx);
    for (int i = 0; i < view.count && good; ++i) {
        memcpy(soup->vertices + 9 * i, (const char *)view.data + (size_t)i * view.stride, 9 * sizeof(float));
        const float *q = soup->vertices + 9 * i;
        for (int k = 0; k < 3; ++k) {
            soup->particles[3 * i + k] = (q[k] + q[3 + k] + q[6 + k]) / 3.0f;
        }
        soup->count = i + 1;
    }
    springls_destroy(ctx);
    return good;
}

static const float trio_center[3] = {24.0f, 24.0f, 24.0f};
static const float lengths[3] = {1.2f, 0.6f, 0.6f};

/* Adds Fig. 6's springl, which has one long spring and two short ones, and above each vertex, at the same height, a neighbour that
   stays. */
static void add_trio(struct soup *soup)
{
    static const float turns[3] = {3.14159265f, 1.04719755f, -1.04719755f}, height = 0.2f;
    float *middle = soup->vertices + 9 * soup->count;
    memcpy(soup->particles + 3 * soup->count++, trio_center, sizeof trio_center);
    for (int m = 0; m < 3; ++m) {
        const float along[3] = {cosf(turns[m]), sinf(turns[m]), 0.0f}, across[3] = {-along[1], along[0], 0.0f};
        float *vertex = middle + 3 * m, *other = soup->vertices + 9 * soup->count;
        vec3_add_scaled(trio_center, lengths[m], along, vertex);
        const float above[3] = {vertex[0], vertex[1], vertex[2] + height};
        vec3_add_scaled(above, -0.4f, across, other);
        vec3_add_scaled(above, 0.9f, along, other + 3);
        vec3_add_scaled(above, 0.4f, across, other + 6);
        vec3_add_scaled(above, 0.3f, along, soup->particles + 3 * soup->count);
        soup->kept[soup->count++] = 1;
    }
}

/* Turns each springl of a ball about its particle and changes its size, by chance. */
static void disturb(struct soup *soup)
{
    uint32_t seed = 1;
    for (int i = 0; i < soup->count; ++i) {
        float random[4];
        for (int k = 0; k < 4; ++k) {
            seed = seed * 1664525u + 1013904223u;
            random[k] = (float)(seed >> 8) / 8388608.0f - 1.0f;
        }
        for (int m = 0; m < 3; ++m) {
            float *vertex = soup->vertices + 9 * i + 3 * m, from[3], turned[3];
            vec3_sub(vertex, soup->particles + 3 * i, from);
            vec3_cross(random, from, turned); /* by up to half a radian about each axis */
            vec3_add_scaled(from, 0.5f, turned, from);
            vec3_add_scaled(soup->particles + 3 * i, 0.8f + 0.3f * random[3], from, vertex);
        }
    }
}

static bool relax(struct soup *soup, springls_torque torque)
{
    springls_desc desc = springls_default_desc();
    springls_params params = springls_paper_params();
    springls_context *ctx;
    params.torque = torque;
    desc.params = &params;
    desc.grid.size[0] = desc.grid.size[1] = desc.grid.size[2] = 32;
    if (springls_create(&desc, &ctx) != SPRINGLS_OK) {
        return false;
    }
    bool good = springls_set_springls(ctx, soup->vertices, soup->particles, NULL, soup->count) == SPRINGLS_OK
             && springls_set_keep_mask(ctx, soup->kept) == SPRINGLS_OK;
    for (int k = 0; k < RELAXATIONS && good; ++k) {
        good = springls_run_stage(ctx, SPRINGLS_STAGE_RELAX) == SPRINGLS_OK;
    }
    const springls_view view = springls_view_vertices(ctx);
    for (int i = 0; i < view.count && good; ++i) {
        memcpy(soup->vertices + 9 * i, (const char *)view.data + (size_t)i * view.stride, 9 * sizeof(float));
    }
    springls_destroy(ctx);
    return good && view.count == soup->count;
}

static float tilt(const float *triangle, const float reference[3])
{
    float normal[3];
    vec3_triangle_normal(triangle, normal);
    vec3_normalize(normal);
    return 57.29578f * acosf(fminf(1.0f, fabsf(vec3_dot(normal, reference))));
}

/* Returns the distance of a vertex to the nearest side of another springl. */
static float gap(const struct soup *soup, int i, int m)
{
    const float *x = soup->vertices + 9 * i + 3 * m;
    float least = INFINITY;
    for (int j = 0; j < soup->count; ++j) {
        for (int k = 0; k < 3 && j != i; ++k) {
            const float *a = soup->vertices + 9 * j + 3 * k, *b = soup->vertices + 9 * j + 3 * ((k + 1) % 3);
            float edge[3], to[3];
            vec3_sub(b, a, edge);
            vec3_sub(x, a, to);
            const float t = vec3_dot(to, edge) / fmaxf(vec3_dot(edge, edge), 1e-12f);
            vec3_add_scaled(to, -fmaxf(0.0f, fminf(1.0f, t)), edge, to);
            least = fminf(least, vec3_length(to));
        }
    }
    return least;
}

/* One row: the springls of the ball at the start or after relaxation, and the trio's springl. */
static void torque_row(struct table *table, const char *name, const struct soup *ball, const float center[3], const float *middle)
{
    static const float up[3] = {0.0f, 0.0f, 1.0f};
    double gaps = 0.0, tilts = 0.0, sum = 0.0, squares = 0.0;
    for (int i = 0; i < ball->count; ++i) {
        float outward[3], spring[3];
        vec3_sub(ball->particles + 3 * i, center, outward);
        vec3_normalize(outward);
        tilts += (double)tilt(ball->vertices + 9 * i, outward) / ball->count;
        for (int m = 0; m < 3; ++m) {
            vec3_sub(ball->vertices + 9 * i + 3 * m, ball->particles + 3 * i, spring);
            const double length = (double)vec3_length(spring);
            gaps += (double)gap(ball, i, m) / (3.0 * ball->count);
            sum += length / (3.0 * ball->count);
            squares += length * length / (3.0 * ball->count);
        }
    }
    table_row(table, "%s|%.1f|%.3f|%.1f|%.3f +- %.3f", name, (double)tilt(middle, up), gaps, tilts, sum,
              sqrt(fmax(0.0, squares - sum * sum)));
}

/* Draws the trio from the side: triangles are lines; particles red, vertices yellow, as in the paper's Fig. 4. */
static void draw_trio(const float *vertices, const float *particles, struct image *image)
{
    const float scale = 0.5f * TRIO_VIEW / 1.65f;
    if (!image_create(image, TRIO_VIEW, TRIO_VIEW / 2, color_rgb(1.0f, 1.0f, 1.0f))) {
        return;
    }
#define AT_X(p) (0.5f * TRIO_VIEW + scale * ((p)[0] - trio_center[0] + 0.55f))
#define AT_Y(p) (0.3f * TRIO_VIEW - scale * ((p)[2] - trio_center[2]))
    for (int i = 3; i >= 0; --i) {
        const struct color color = i == 0 ? color_rgb(0.2f, 0.4f, 0.75f) : color_rgb(0.6f, 0.6f, 0.6f);
        for (int k = 0; k < 3; ++k) {
            const float *a = vertices + 9 * i + 3 * k, *b = vertices + 9 * i + 3 * ((k + 1) % 3);
            image_line(image, AT_X(a), AT_Y(a), AT_X(b), AT_Y(b), i == 0 ? 4.0f : 3.0f, color);
        }
        for (int k = 0; k < 3; ++k) {
            image_disc(image, AT_X(vertices + 9 * i + 3 * k), AT_Y(vertices + 9 * i + 3 * k), 4.0f, color_rgb(0.95f, 0.75f, 0.1f));
        }
        image_disc(image, AT_X(particles + 3 * i), AT_Y(particles + 3 * i), 4.5f, color_rgb(0.85f, 0.15f, 0.1f));
    }
#undef AT_X
#undef AT_Y
}

void paper_fig6(struct paper *paper)
{
    static const char *const labels[TORQUES + 1] = {"at the start", "physical torque", "normalized torque"};
    static const springls_torque torques[TORQUES + 1] = {SPRINGLS_TORQUE_NORMALIZED, SPRINGLS_TORQUE_PHYSICAL,
                                                         SPRINGLS_TORQUE_NORMALIZED};
    static const float ball_center[3] = {15.5f, 15.5f, 15.5f}, corner[3] = {8.0f, 8.0f, 8.0f};
    static struct soup ball, trio;
    static struct table table;
    struct image images[TORQUES + 1];
    bool good = true;
    table_begin(&table);
    table_row(&table, "|The springl's turn, degrees|Gap, mean|Off the ball's normal, degrees|Spring lengths");
    for (int t = 0; t <= TORQUES && good; ++t) {
        ball.count = trio.count = 0;
        good = add_ball(ball_center, 8.0f, &ball) && add_ball(corner, 4.0f, &trio);
        const int first = trio.count;
        add_trio(&trio);
        disturb(&ball);
        good = good && (t == 0 || (relax(&ball, torques[t]) && relax(&trio, torques[t])));
        torque_row(&table, labels[t], &ball, ball_center, trio.vertices + 9 * first);
        draw_trio(trio.vertices + 9 * first, trio.particles + 3 * first, &images[t]);
    }
    if (!good) {
        fprintf(stderr, "paper: Fig. 6: a model cannot be made\n");
        ++paper->failures;
        return;
    }
    paper_table(paper, &table);
    paper_strip(paper, images, labels, TORQUES + 1, TORQUES + 1, 1000, "fig06.png",
                "Fig. 6: a springl between neighbours at one height, from the side");
}
