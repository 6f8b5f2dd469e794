/* integrate_body.h - the motion of springls over a step by fourth-order Runge-Kutta (eq. 2) or one Euler step. A path is that of
   SPRINGLS__GROUPS times SPRINGLS__WIDTH springls: few on a device, a block of them on the host, where forces are callbacks. How
   the points of a SPRINGLS__NUM3 are laid out is up to those who evaluate the forces, as sums and products are the same in any
   order of its numbers. Before this text they define

     find_flow    writes sigma of eq. 1 at the points of mover m, in Runge-Kutta stage k
     add_push     adds rho of eq. 1 and motion by curvature at the particles, along the normals of the springls
     add_affine   adds the affine maps of eq. 1 to the slopes of all movers
     flow_movers  how many movers find_flow reads: all where it needs normals, else 1
     by_lane      the points of a SPRINGLS__NUM3, one a lane */

typedef struct SPRINGLS__W(path) {
    SPRINGLS__NUM3 x[SPRINGLS__MOVERS][SPRINGLS__GROUPS];        /* where the points are before the step                */
    SPRINGLS__NUM3 at[SPRINGLS__MOVERS][SPRINGLS__GROUPS];       /* where they are in a stage; in the end, displacements */
    SPRINGLS__NUM3 along[SPRINGLS__MOVERS][SPRINGLS__GROUPS];    /* on the cubic through the ends of the step           */
    SPRINGLS__NUM3 slope[4][SPRINGLS__MOVERS][SPRINGLS__GROUPS];
    SPRINGLS__NUM3 flow[4][SPRINGLS__GROUPS];                    /* at the particles, in the stages, without pushes     */
    SPRINGLS__NUM3 push[SPRINGLS__GROUPS], residual[SPRINGLS__GROUPS], middle[SPRINGLS__GROUPS];
    SPRINGLS__NUM error[SPRINGLS__GROUPS];                       /* in the end, of the particles' displacements         */
} SPRINGLS__W(path);

#define SPRINGLS__FOR_GROUPS(g) for (g = 0; g < SPRINGLS__GROUPS; g++)

/* Finds the slopes of stage k, where the points are at x: those of the particle for all points of a springl or, with
   vertex_velocity, the flow at each of them and the push at the particle, as vertices have no normals of their own. */
SPRINGLS__W_MATHS void SPRINGLS__W(find_slopes)(const springls__model *model, const springls__force_rule *rule,
                                                SPRINGLS__W(path) *path, SPRINGLS__NUM3 (*x)[SPRINGLS__GROUPS], int k)
{
    SPRINGLS__NUM3 (*slope)[SPRINGLS__GROUPS] = path->slope[k];
    int g, m;
    SPRINGLS__W(find_flow)(model, rule, path, x, 0, k, path->flow[k]);
    if (!model->params.vertex_velocity) {
        SPRINGLS__FOR_GROUPS(g) slope[0][g] = path->flow[k][g];
        SPRINGLS__W(add_push)(model, rule, path, x, slope[0]);
        for (m = 1; m < SPRINGLS__MOVERS; m++)
            SPRINGLS__FOR_GROUPS(g) slope[m][g] = slope[0][g];
    } else {
        SPRINGLS__FOR_GROUPS(g) path->push[g] = SPRINGLS__W(broadcast3)(springls__v3_make(0.0f, 0.0f, 0.0f));
        SPRINGLS__W(add_push)(model, rule, path, x, path->push);
        for (m = 1; m < SPRINGLS__MOVERS; m++) SPRINGLS__W(find_flow)(model, rule, path, x, m, k, slope[m]);
        SPRINGLS__FOR_GROUPS(g) slope[0][g] = SPRINGLS__W(add)(path->flow[k][g], path->push[g]);
        for (m = 1; m < SPRINGLS__MOVERS; m++)
            SPRINGLS__FOR_GROUPS(g) slope[m][g] = SPRINGLS__W(add)(slope[m][g], path->push[g]);
    }
    SPRINGLS__W(add_affine)(rule, path, x, slope);
}

/* Finds simpson_residual for the particles of a path that is displaced by `at`. Pushes are not evaluated again: those of the stages
   are taken for them. */
SPRINGLS__W_MATHS void SPRINGLS__W(find_residual)(const springls__model *model, const springls__force_rule *rule,
                                                  SPRINGLS__W(path) *path)
{
    const int movers = SPRINGLS__W(flow_movers)(path);
    int g, m;
    SPRINGLS__FOR_GROUPS(g) path->residual[g] = SPRINGLS__W(broadcast3)(springls__v3_make(0.0f, 0.0f, 0.0f));
    if (!springls__has_flow(rule)) return;
    for (m = 0; m < movers; m++)
        SPRINGLS__FOR_GROUPS(g) path->along[m][g] = SPRINGLS__W(add)(path->x[m][g], path->at[m][g]);
    SPRINGLS__W(find_flow)(model, rule, path, path->along, 0, 3, path->residual);
    SPRINGLS__FOR_GROUPS(g) path->residual[g] = SPRINGLS__W(sub)(path->residual[g], path->flow[3][g]);
    for (m = 0; m < movers; m++)
        SPRINGLS__FOR_GROUPS(g) {
            const SPRINGLS__NUM3 last = SPRINGLS__W(add)(path->slope[3][m][g], path->residual[g]);
            path->along[m][g] = SPRINGLS__W(cubic_middle)(path->x[m][g], path->at[m][g], path->slope[0][m][g], last, rule->dt);
        }
    SPRINGLS__W(find_flow)(model, rule, path, path->along, 0, 1, path->middle);
    SPRINGLS__FOR_GROUPS(g)
        path->residual[g] =
            SPRINGLS__W(simpson_residual)(path->flow[1][g], path->flow[2][g], path->middle[g], path->residual[g]);
}

/* Finds the displacements of a path and their errors from its x. */
SPRINGLS__W_MATHS void SPRINGLS__W(integrate)(const springls__model *model, const springls__force_rule *rule,
                                              SPRINGLS__W(path) *path)
{
    SPRINGLS__NUM3 (*k1)[SPRINGLS__GROUPS] = path->slope[0], (*k2)[SPRINGLS__GROUPS] = path->slope[1];
    SPRINGLS__NUM3 (*k3)[SPRINGLS__GROUPS] = path->slope[2], (*k4)[SPRINGLS__GROUPS] = path->slope[3];
    int stage, m, g;
    for (stage = 0; stage < (rule->euler ? 1 : 4); stage++) { /* in one place: a device's compiler inlines all forces there */
        const SPRINGLS__NUM span = SPRINGLS__W(broadcast)(stage == 3 ? rule->dt : 0.5f * rule->dt);
        for (m = 0; m < SPRINGLS__MOVERS && stage > 0; m++)
            SPRINGLS__FOR_GROUPS(g)
                path->at[m][g] = SPRINGLS__W(mad)(path->x[m][g], path->slope[stage - 1][m][g], span);
        SPRINGLS__W(find_slopes)(model, rule, path, stage > 0 ? path->at : path->x, stage);
    }
    for (m = 0; m < SPRINGLS__MOVERS; m++)
        SPRINGLS__FOR_GROUPS(g)
            path->at[m][g] = rule->euler ? SPRINGLS__W(scale)(k1[m][g], SPRINGLS__W(broadcast)(rule->dt))
                                         : SPRINGLS__W(rk4)(k1[m][g], k2[m][g], k3[m][g], k4[m][g], rule->dt);
    SPRINGLS__FOR_GROUPS(g) path->error[g] = SPRINGLS__W(broadcast)(0.0f);
    if (rule->euler) return;
    SPRINGLS__W(find_residual)(model, rule, path);
    SPRINGLS__FOR_GROUPS(g)
        path->error[g] = SPRINGLS__W(rk4_error)(SPRINGLS__W(by_lane)(k1[0][g]), SPRINGLS__W(by_lane)(k2[0][g]),
                                                SPRINGLS__W(by_lane)(k3[0][g]), SPRINGLS__W(by_lane)(k4[0][g]),
                                                SPRINGLS__W(by_lane)(path->residual[g]), rule->dt);
}

#undef SPRINGLS__FOR_GROUPS
