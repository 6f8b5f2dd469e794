/* displace_body.h - evaluates forces on a device, for a springl or for several at once, one a lane; those that are given by samples
   or by the user lane by lane. Callbacks and affine maps are the host's (src/stages/forces.h). */

struct SPRINGLS__W(path);

SPRINGLS__W_MATHS int SPRINGLS__W(flow_movers)(const struct SPRINGLS__W(path) *path)
{
    (void)path;
    return 1;
}

SPRINGLS__W_MATHS SPRINGLS__NUM3 SPRINGLS__W(by_lane)(SPRINGLS__NUM3 points) { return points; }

/* Returns the velocity at x of the user's flow, or of the samples. */
SPRINGLS__W_MATHS SPRINGLS__NUM3 SPRINGLS__W(given_velocity)(const springls__model *model, const springls__force_rule *rule,
                                                             SPRINGLS__NUM3 x, int k, bool sampled)
{
    SPRINGLS__W(lanes) at, velocity;
    int lane;
    SPRINGLS__W(lanes_store)(&at, x);
    for (lane = 0; lane < SPRINGLS__WIDTH; lane++) {
        const springls__v3 one = SPRINGLS__W(lane_get)(&at, lane);
        SPRINGLS__W(lane_set)(&velocity, lane,
                              sampled ? springls__sampled_velocity(rule, model->force.velocity, one)
                                      : springls__user_velocity(one, rule->stage_time[k], model->force.user));
    }
    return SPRINGLS__W(load_v3)(velocity.x, velocity.y, velocity.z);
}

SPRINGLS__W_MATHS void SPRINGLS__W(find_flow)(const springls__model *model, const springls__force_rule *rule,
                                              const struct SPRINGLS__W(path) *path, SPRINGLS__NUM3 (*x)[1], int m, int k,
                                              SPRINGLS__NUM3 *flow)
{
    const SPRINGLS__NUM weight = SPRINGLS__W(broadcast)(rule->velocity_weight);
    const SPRINGLS__NUM3 on_lattice = SPRINGLS__W(add)(x[m][0], SPRINGLS__W(broadcast3)(rule->window));
    (void)path;
    flow[0] = SPRINGLS__W(broadcast3)(springls__v3_make(0.0f, 0.0f, 0.0f));
    if (rule->has_velocity)
        flow[0] = SPRINGLS__W(scale)(SPRINGLS__W(given_velocity)(model, rule, on_lattice, k, false), weight);
    if (rule->velocity.channels != 0)
        flow[0] = SPRINGLS__W(mad)(flow[0], SPRINGLS__W(given_velocity)(model, rule, x[m][0], k, true), weight);
}

SPRINGLS__W_MATHS void SPRINGLS__W(add_push)(const springls__model *model, const springls__force_rule *rule,
                                             const struct SPRINGLS__W(path) *path, SPRINGLS__NUM3 (*x)[1], SPRINGLS__NUM3 *push)
{
    SPRINGLS__W(lanes) p, n, sum;
    int lane;
    (void)path;
    if (rule->pressure.channels == 0 && rule->curvature_weight == 0.0f) return;
    SPRINGLS__W(lanes_store)(&p, x[0][0]);
    SPRINGLS__W(lanes_store)(&n, SPRINGLS__W(normal_of)(x[1][0], x[2][0], x[3][0]));
    SPRINGLS__W(lanes_store)(&sum, push[0]);
    for (lane = 0; lane < SPRINGLS__WIDTH; lane++) {
        const springls__v3 normal = SPRINGLS__W(lane_get)(&n, lane), at = SPRINGLS__W(lane_get)(&p, lane);
        springls__v3 pushed = SPRINGLS__W(lane_get)(&sum, lane);
        if (rule->pressure.channels != 0)
            pushed = springls__pressed(rule, springls__sampled_pressure(rule, model->force.pressure, at), normal, pushed);
        SPRINGLS__W(lane_set)(&sum, lane, springls__curved(&model->grid, rule, at, normal, pushed));
    }
    push[0] = SPRINGLS__W(load_v3)(sum.x, sum.y, sum.z);
}

SPRINGLS__W_MATHS void SPRINGLS__W(add_affine)(const springls__force_rule *rule, const struct SPRINGLS__W(path) *path,
                                               SPRINGLS__NUM3 (*x)[1], SPRINGLS__NUM3 (*slope)[1])
{
    (void)rule;
    (void)path;
    (void)x;
    (void)slope;
}

#define SPRINGLS__GROUPS 1
#include "../stages/integrate_body.h"
#undef SPRINGLS__GROUPS

/* Displaces springls first, first + 1, ... by the forces of the rule; those outside of its region do not move. */
SPRINGLS__W_MATHS void SPRINGLS__W(displace)(const springls__model *model, const springls__force_rule *rule, int first)
{
    const SPRINGLS__NUM zero = SPRINGLS__W(broadcast)(0.0f);
    const SPRINGLS__W(springl) s = SPRINGLS__W(springl_load)(model->set.s, first);
    const SPRINGLS__COND acts = SPRINGLS__W(in_force_region)(rule->region_lower, rule->region_upper, s.p);
    SPRINGLS__W(path) path;
    SPRINGLS__W(movers) at, d;
    int m;
    path.x[0][0] = s.p;
    for (m = 0; m < 3; m++) path.x[m + 1][0] = s.q[m];
    SPRINGLS__W(integrate)(model, rule, &path);
    at.error = zero;
    d.error = path.error[0];
    for (m = 0; m < SPRINGLS__MOVERS; m++) {
        at.x[m] = path.x[m][0];
        d.x[m] = SPRINGLS__W(v3_make)(SPRINGLS__W(select)(acts, path.at[m][0].x, zero),
                                      SPRINGLS__W(select)(acts, path.at[m][0].y, zero),
                                      SPRINGLS__W(select)(acts, path.at[m][0].z, zero));
    }
    SPRINGLS__W(displaced_store)(model, rule, first, at, d, SPRINGLS__W(load)(model->set.error + first));
}
