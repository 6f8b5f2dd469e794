/* parameter_sets.h - the two parameter sets, and the ranges of their members. */
#ifndef SPRINGLS__MODEL_PARAMETER_SETS_H
#define SPRINGLS__MODEL_PARAMETER_SETS_H

#include "../../kernels_embed/model/model.h"
#include "../runtime/base.h"

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
    p.lazy_way = 0.0f;
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
    p.lazy_way = 2.1f;
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

/* Returns the name of the first member that is out of range, or NULL. */
SPRINGLS__FN const char *springls__params_fault(const springls_params *p)
{
#define SPRINGLS__IN(member, low, high) \
    if (!(p->member >= (low) && p->member <= (high))) return #member
    if (p->cookie != SPRINGLS__COOKIE) return "cookie: begin with springls_default_params() or springls_paper_params()";
    SPRINGLS__IN(d_max, 0.05f, 4.0f);
    SPRINGLS__IN(particle_radius, 0.0f, 1.0f);
    SPRINGLS__IN(neighbor_radius, 0.05f, 4.0f);
    SPRINGLS__IN(max_neighbors, 1, SPRINGLS__MAX_NEIGHBORS);
    SPRINGLS__IN(relax_iterations, 0, 1000);
    SPRINGLS__IN(threshold, SPRINGLS_THRESHOLD_LINEAR, SPRINGLS_THRESHOLD_TANH);
    SPRINGLS__IN(weight, SPRINGLS_WEIGHT_LINEAR, SPRINGLS_WEIGHT_SPLINE_NEAR);
    SPRINGLS__IN(torque, SPRINGLS_TORQUE_NORMALIZED, SPRINGLS_TORQUE_PHYSICAL);
    SPRINGLS__IN(sharpness, 0.0f, 1000.0f);
    SPRINGLS__IN(kappa_int, 0.0f, 100.0f);
    SPRINGLS__IN(kappa_ext, 0.0f, 100.0f);
    SPRINGLS__IN(relax_step_length, 0.0f, 1.0f);
    SPRINGLS__IN(relax_step_rotation, 0.0f, 1.0f);
    SPRINGLS__IN(contract_distance, 0.0f, 100.0f);
    SPRINGLS__IN(min_angle, 0.0f, 60.0f);
    SPRINGLS__IN(max_angle, 60.0f, 180.0f);
    SPRINGLS__IN(min_area, 0.0f, 10.0f);
    SPRINGLS__IN(merge_distance, 0.0f, 4.0f);
    SPRINGLS__IN(keep_thin, 0, 1);
    SPRINGLS__IN(cover, 0, 1);
    SPRINGLS__IN(relax_same_side, 0, 1);
    SPRINGLS__IN(reshape, 0, 1);
    SPRINGLS__IN(resample_last, 0, 1);
    SPRINGLS__IN(resample_period, 1, 1000000);
    SPRINGLS__IN(split_edge, 0.1f, 1e6f);
    SPRINGLS__IN(split_area, 0.01f, 1e6f);
    SPRINGLS__IN(placement, SPRINGLS_PLACEMENT_COPY, SPRINGLS_PLACEMENT_QUADRATIC);
    SPRINGLS__IN(band_half_width, 2.0f, 6.0f);
    SPRINGLS__IN(capture_range, 0.3f, 6.0f);
    SPRINGLS__IN(evolve_iterations, 0, 1000);
    SPRINGLS__IN(evolve_step, 0.0f, 1.0f);
    SPRINGLS__IN(evolve_width, 0.5f, 3.0f);
    SPRINGLS__IN(curvature, -0.2f, 0.2f);
    SPRINGLS__IN(carry_level_set, 0, 1);
    SPRINGLS__IN(lazy_way, 0.0f, 3.0f);
    SPRINGLS__IN(project_level_set, 0, 1);
    SPRINGLS__IN(nucleate, 0, 1);
    SPRINGLS__IN(keep_edges, 0, 1);
    SPRINGLS__IN(vertex_velocity, 0, 1);
    SPRINGLS__IN(half_time_sampling, 0, 1);
    SPRINGLS__IN(volume_lock, 0, 1);
    SPRINGLS__IN(split_input, 0, 1);
    SPRINGLS__IN(components, 0, 1);
    SPRINGLS__IN(project_initial, 0, 1);
    SPRINGLS__IN(fill_from_springls, 0, 1);
    SPRINGLS__IN(min_component, 0.0f, 16.0f);
    SPRINGLS__IN(topology, SPRINGLS_TOPOLOGY_FREE, SPRINGLS_TOPOLOGY_PRESERVED);
    SPRINGLS__IN(contact, SPRINGLS_CONTACT_MERGE, SPRINGLS_CONTACT_SEPARATE);
    SPRINGLS__IN(nearest_rule, 0.0f, 1e6f);
    SPRINGLS__IN(track_iterations, 0, 1000);
    SPRINGLS__IN(track_step, 0.0f, 1.0f);
    SPRINGLS__IN(initial_stride, 1, 4);
#undef SPRINGLS__IN
    return p->initial_stride == 3 ? "initial_stride" : NULL; /* does not divide a brick */
}

#endif
