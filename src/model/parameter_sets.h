/* parameter_sets.h - the two parameter sets, and the ranges of their members. */
#ifndef SPRINGLS__MODEL_PARAMETER_SETS_H
#define SPRINGLS__MODEL_PARAMETER_SETS_H

#include "../../kernels_embed/model/model.h"
#include "../runtime/finite.h"

enum { SPRINGLS__COOKIE = 0x53504731 };

SPRINGLS_API springls_params springls_paper_params(void)
{
    springls_params p;
    memset(&p, 0, sizeof p);
    p.cookie = SPRINGLS__COOKIE;
    p.d_max = 0.5f;
    p.particle_radius = 0.05f;
    p.neighbor_radius = 0.6f; /* d_max + 2r */
    p.max_neighbors = 8;
    p.relax_iterations = 5;
    p.threshold = SPRINGLS_THRESHOLD_TANH;
    p.weight = SPRINGLS_WEIGHT_LINEAR;
    p.torque = SPRINGLS_TORQUE_NORMALIZED;
    p.sharpness = 5.0f;
    p.kappa_int = 0.3f;
    p.kappa_ext = 1.0f;
    p.relax_step_length = 0.1f;
    p.relax_step_rotation = 0.1f;
    p.cover = 0;
    p.relax_same_side = 0;
    p.contract_distance = 0.625f; /* (1 + 0.25) d_max */
    p.min_angle = 20.0f;
    p.max_angle = 160.0f;
    p.min_area = 0.0f;
    p.reshape = 0;
    p.merge_distance = 0.0f;
    p.keep_thin = 0;
    p.resample_period = 5;
    p.resample_last = 0;
    p.split_edge = 1e6f;
    p.split_area = 3.0f;
    p.placement = SPRINGLS_PLACEMENT_COPY;
    p.band_half_width = 3.0f;
    p.capture_range = 2.0f;
    p.evolve_iterations = 4;
    p.evolve_step = 0.75f;
    p.evolve_width = 1.5f;
    p.curvature = 0.0f;
    p.carry_level_set = 0;
    p.lazy_distance = 0.0f;
    p.project_level_set = 0;
    p.nucleate = 0;
    p.fill_from_springls = 0;
    p.keep_edges = 0;
    p.min_component = 0.0f;
    p.topology = SPRINGLS_TOPOLOGY_FREE;
    p.contact = SPRINGLS_CONTACT_MERGE;
    p.nearest_rule = 1e6f;
    p.track_iterations = 4;
    p.track_step = 0.5f;
    p.vertex_velocity = 0;
    p.half_time_sampling = 0;
    p.volume_lock = 0;
    p.split_input = 0;
    p.components = 0;
    p.contouring = SPRINGLS_CONTOURING_LEVEL_SET;
    p.initial_stride = 2;
    p.project_initial = 1;
    return p;
}

SPRINGLS_API springls_params springls_default_params(void)
{
    springls_params p = springls_paper_params();
    p.relax_iterations = 1;
    p.relax_step_length = 0.2f;
    p.relax_step_rotation = 0.2f;
    p.kappa_int = 1.5f;
    p.cover = 1;
    p.min_area = 0.05f;
    p.reshape = 1;
    p.merge_distance = 0.6f;
    p.keep_thin = 1;
    p.resample_last = 1;
    p.split_edge = 2.0f;
    p.split_area = 4.0f;
    p.placement = SPRINGLS_PLACEMENT_QUADRATIC;
    p.evolve_iterations = 0;
    p.carry_level_set = 1;
    p.lazy_distance = 3.5f;
    p.project_level_set = 1;
    p.nucleate = 1;
    p.fill_from_springls = 1;
    p.vertex_velocity = 1;
    p.keep_edges = 1;
    p.min_component = 1.0f;
    p.split_input = 1;
    p.initial_stride = 1;
    return p;
}

/* Lists all members but the cookie, with their ranges. The order is of no account. */
#define SPRINGLS__PARAMS(REAL, INTEGER)                                                                                          \
    REAL(d_max, 0.05, 4)                                                                                                         \
    REAL(particle_radius, 0, 1)                                                                                                  \
    REAL(neighbor_radius, 0.05, 4)                                                                                               \
    INTEGER(max_neighbors, 1, SPRINGLS__MAX_NEIGHBORS)                                                                           \
    INTEGER(relax_iterations, 0, 1000)                                                                                           \
    INTEGER(threshold, SPRINGLS_THRESHOLD_LINEAR, SPRINGLS_THRESHOLD_TANH)                                                       \
    INTEGER(weight, SPRINGLS_WEIGHT_LINEAR, SPRINGLS_WEIGHT_SPLINE_NEAR)                                                         \
    INTEGER(torque, SPRINGLS_TORQUE_NORMALIZED, SPRINGLS_TORQUE_PHYSICAL)                                                        \
    REAL(sharpness, 0, 1000)                                                                                                     \
    REAL(kappa_int, 0, 100)                                                                                                      \
    REAL(kappa_ext, 0, 100)                                                                                                      \
    REAL(relax_step_length, 0, 1)                                                                                                \
    REAL(relax_step_rotation, 0, 1)                                                                                              \
    REAL(contract_distance, 0, 100)                                                                                              \
    REAL(min_angle, 0, 60)                                                                                                       \
    REAL(max_angle, 60, 180)                                                                                                     \
    REAL(min_area, 0, 10)                                                                                                        \
    REAL(merge_distance, 0, 4)                                                                                                   \
    INTEGER(keep_thin, 0, 1)                                                                                                     \
    INTEGER(cover, 0, 1)                                                                                                         \
    INTEGER(relax_same_side, 0, 1)                                                                                               \
    INTEGER(reshape, 0, 1)                                                                                                       \
    INTEGER(resample_last, 0, 1)                                                                                                 \
    INTEGER(resample_period, 1, 1000000)                                                                                         \
    REAL(split_edge, 0.1, 1e6)                                                                                                   \
    REAL(split_area, 0.01, 1e6)                                                                                                  \
    INTEGER(placement, SPRINGLS_PLACEMENT_COPY, SPRINGLS_PLACEMENT_QUADRATIC)                                                    \
    REAL(band_half_width, 2, 6)                                                                                                  \
    REAL(capture_range, 0.3, 6)                                                                                                  \
    INTEGER(evolve_iterations, 0, 1000)                                                                                          \
    REAL(evolve_step, 0, 1)                                                                                                      \
    REAL(evolve_width, 0.5, 3)                                                                                                   \
    REAL(curvature, -0.2, 0.2)                                                                                                   \
    INTEGER(carry_level_set, 0, 1)                                                                                               \
    REAL(lazy_distance, 0, 6)                                                                                                    \
    INTEGER(project_level_set, 0, 1)                                                                                             \
    INTEGER(nucleate, 0, 1)                                                                                                      \
    INTEGER(keep_edges, 0, 1)                                                                                                    \
    INTEGER(vertex_velocity, 0, 1)                                                                                               \
    INTEGER(half_time_sampling, 0, 1)                                                                                            \
    INTEGER(volume_lock, 0, 1)                                                                                                   \
    INTEGER(split_input, 0, 1)                                                                                                   \
    INTEGER(components, 0, 1)                                                                                                    \
    INTEGER(contouring, SPRINGLS_CONTOURING_LEVEL_SET, SPRINGLS_CONTOURING_SPRINGLS)                                             \
    INTEGER(project_initial, 0, 1)                                                                                               \
    INTEGER(fill_from_springls, 0, 1)                                                                                            \
    REAL(min_component, 0, 16)                                                                                                   \
    INTEGER(topology, SPRINGLS_TOPOLOGY_FREE, SPRINGLS_TOPOLOGY_PRESERVED)                                                       \
    INTEGER(contact, SPRINGLS_CONTACT_MERGE, SPRINGLS_CONTACT_SEPARATE)                                                          \
    REAL(nearest_rule, 0, 1e6)                                                                                                   \
    INTEGER(track_iterations, 0, 1000)                                                                                           \
    REAL(track_step, 0, 1)                                                                                                       \
    INTEGER(initial_stride, 1, 4)

/* Describes a member of the parameters: an enumeration counts as an integer. */
typedef struct springls__param {
    const char *name, *fault;
    size_t offset;
    bool real;
    float low, high;
} springls__param;

#define SPRINGLS__TEXT_OF(x) #x
#define SPRINGLS__TEXT(x) SPRINGLS__TEXT_OF(x) /* of what x stands for */
#define SPRINGLS__PARAM_REAL(name, low, high)                                                                                    \
    { #name, "params." #name " is not in " SPRINGLS__TEXT(low) " to " SPRINGLS__TEXT(high),                                      \
      offsetof(springls_params, name), true, (float)(low), (float)(high) },
#define SPRINGLS__PARAM_INTEGER(name, low, high)                                                                                 \
    { #name, "params." #name " is not in " SPRINGLS__TEXT(low) " to " SPRINGLS__TEXT(high),                                      \
      offsetof(springls_params, name), false, (float)(low), (float)(high) },
static const springls__param springls__param_list[] = { SPRINGLS__PARAMS(SPRINGLS__PARAM_REAL, SPRINGLS__PARAM_INTEGER) };
#undef SPRINGLS__PARAM_REAL
#undef SPRINGLS__PARAM_INTEGER
#define SPRINGLS__PARAM_COUNT (sizeof springls__param_list / sizeof springls__param_list[0])

/* Do not compile with -fshort-enums and -fsingle-precision-constant: snapshots and state would have other bits. */
typedef char springls__enumerations_are_integers[sizeof(springls_contact) == sizeof(int) ? 1 : -1];
typedef char springls__constants_are_double[sizeof 1.0 == sizeof(double) ? 1 : -1];

/* Does not compile when a member is missing from the list. */
typedef char springls__all_params_are_listed[4 * (SPRINGLS__PARAM_COUNT + 1) == sizeof(springls_params) ? 1 : -1];

/* Returns whether a member is in its range. Enumerations are read as integers, whatever value they have. */
SPRINGLS__FN bool springls__param_good(const springls_params *p, const springls__param *member)
{
    const char *at = (const char *)p + member->offset;
    int32_t integer;
    float real;
    memcpy(&integer, at, sizeof integer);
    memcpy(&real, at, sizeof real);
    if (member->real) return springls__finite_float(real) && real >= member->low && real <= member->high;
    return integer >= (int32_t)member->low && integer <= (int32_t)member->high;
}

/* Returns why parameters cannot be used, NULL when they can: a constant sentence that names the first member out of range, and the
   range. */
SPRINGLS__FN const char *springls__params_fault(const springls_params *p)
{
    size_t i;
    if (p->cookie != SPRINGLS__COOKIE)
        return "params do not come from springls_default_params() or springls_paper_params()";
    for (i = 0; i < SPRINGLS__PARAM_COUNT; i++)
        if (!springls__param_good(p, &springls__param_list[i])) return springls__param_list[i].fault;
    return p->initial_stride == 3 ? "params.initial_stride is not 1, 2 or 4" : NULL; /* does not divide a brick */
}

/* Writes the value of the first member that is out of its range, after a colon; "" when none is. */
SPRINGLS__FN void springls__params_bad_value(const springls_params *p, char text[32])
{
    size_t i;
    text[0] = '\0';
    for (i = 0; i < SPRINGLS__PARAM_COUNT && text[0] == '\0'; i++) {
        const springls__param *member = &springls__param_list[i];
        const char *at = (const char *)p + member->offset;
        int32_t integer;
        float real;
        if (springls__param_good(p, member)) continue;
        memcpy(&integer, at, sizeof integer);
        memcpy(&real, at, sizeof real);
        if (member->real) snprintf(text, 32, ": %g", (double)real);
        else snprintf(text, 32, ": %ld", (long)integer);
    }
}

#endif
