/* project_body.h - the weight of a springl at a squared distance, for one place and for several. */

/* Returns a weight that falls smoothly from 1 to 0 at PROJECT_RADIUS. */
SPRINGLS__W_MATHS SPRINGLS__NUM SPRINGLS__W(project_weight)(SPRINGLS__NUM d2)
{
    SPRINGLS__NUM t = 1.0f - d2 * (1.0f / (SPRINGLS__PROJECT_RADIUS * SPRINGLS__PROJECT_RADIUS));
    t = SPRINGLS__W(max)(t, SPRINGLS__W(broadcast)(0.0f));
    t = t * t;
    return t * t;
}
