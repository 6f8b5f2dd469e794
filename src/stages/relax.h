/* relax.h - Algorithm 1: moves every springl towards equilibrium with its neighbors, all at once (Jacobi).

   Why: advect moves the points of a springl one by one, so that a flow tears triangles apart and turns them away from each other. Three
   springs a springl pull the vertices back towards the particle, and springs between vertices and edges of neighbors close the seams.
   Particles stay: they have the exact path. All springls read the old state and write a new one, so that no order of springls counts. */
#ifndef SPRINGLS__STAGES_RELAX_H
#define SPRINGLS__STAGES_RELAX_H

#include "../runtime/arrays.h"
#include "../runtime/launch.h"
#include "../runtime/resumable.h"
#include "../model/cell_bricks.h"
#include "../model/constellation.h"
#include "../model/neighbors.h"

/* Replaces the springls by those that a kernel has written to relaxed_springls. */
SPRINGLS__FN springls_status springls__take_relaxed(springls_context *ctx)
{
    springls__swap(ctx, SPRINGLS__ARRAY_S, SPRINGLS__ROLE_ARRAY(relaxed_springls));
    springls__triangles_changed(ctx);
    return SPRINGLS_OK;
}

SPRINGLS__FN bool springls__may_relax(const springls_context *ctx)
{
    return ctx->model.set.count > 0 && ctx->model.params.relax_iterations > 0;
}

SPRINGLS__FN bool springls__covers(const springls_context *ctx) { return ctx->model.params.cover && springls__may_relax(ctx); }

/* Returns true while springls are to be relaxed once more. */
SPRINGLS__FN bool springls__iterates_relaxation(const springls_context *ctx)
{
    return springls__round(ctx) < ctx->model.params.relax_iterations;
}

/* After shorten_arms, springls with their own arms stay in relaxed_springls, for those that are asleep. */
SPRINGLS__FN void springls__relax_args(const springls_context *ctx, springls__arguments *args)
{
    args->relax.kept = ctx->model.params.cover && springls__round(ctx) == 0;
}

static const springls__entry springls__begin_relaxation[] = {
    SPRINGLS__ROOM(relaxed_springls, SPRINGLS)
    SPRINGLS__IF(springls__covers)
        SPRINGLS__KERNEL(shorten_arms, SPRINGLS)
        SPRINGLS__DO(springls__take_relaxed)
    SPRINGLS__END
    SPRINGLS__DO(springls__neighbors_build)
    SPRINGLS__DO(springls__neighbors_found)
SPRINGLS__END };

/* Algorithm 1: relaxes springls; their triangles stay as they are. */
static const springls__entry springls__relax_normals[] = {
    SPRINGLS__IF(springls__may_relax)
        SPRINGLS__CALL(springls__begin_relaxation)
        SPRINGLS__REPEAT_WHILE(springls__iterates_relaxation)
            SPRINGLS__KERNEL_WITH(relax, SPRINGLS, springls__relax_args) /* eq. 3 to 20 */
            SPRINGLS__DO(springls__take_relaxed)
        SPRINGLS__END
    SPRINGLS__END
SPRINGLS__END };

/* Algorithm 1: each gets the triangle of its share of the surface at the end, if params.cover. */
static const springls__entry springls__relax[] = {
    SPRINGLS__CALL(springls__relax_normals)
    SPRINGLS__IF(springls__covers)
        SPRINGLS__KERNEL(cover, SPRINGLS)
        SPRINGLS__DO(springls__take_relaxed)
    SPRINGLS__END
SPRINGLS__END };

/* Measures the shares of all springls again, after some springls have come or gone. */
static const springls__entry springls__cover[] = {
    SPRINGLS__IF(springls__covers)
        SPRINGLS__CALL(springls__begin_relaxation)
        SPRINGLS__KERNEL_WITH(cover, SPRINGLS, springls__relax_args)
        SPRINGLS__DO(springls__take_relaxed)
    SPRINGLS__END
SPRINGLS__END };

/* Makes room for the search that tells bodies apart. */
SPRINGLS__FN springls_status springls__orient_begin(springls_context *ctx)
{
    return ctx->model.params.contact == SPRINGLS_CONTACT_SEPARATE ? springls__cell_list_cover(ctx) : SPRINGLS_OK;
}

SPRINGLS__FN springls_status springls__triangles_oriented(springls_context *ctx)
{
    ctx->springl_surface_fresh = false;
    return SPRINGLS_OK;
}

/* Turns flipped triangles round (section 4.3.1). */
static const springls__entry springls__orient[] = {
    SPRINGLS__DO(springls__orient_begin)
    SPRINGLS__KERNEL(orient, SPRINGLS)
    SPRINGLS__DO(springls__triangles_oriented)
SPRINGLS__END };

#endif
