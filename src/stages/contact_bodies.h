/* contact_bodies.h - finds the bodies that stay two on contact (params.contact = SEPARATE): the components of phi when the switch
   went on, or the model was set with it on.

     springls of A    phi of the union
        ____________ _______                 Why numbers and not phi: where two bodies are pressed together phi has no wall
       /           _|_      \                between them, and cannot tell where they were two. Springls can: each has the number
      |     A     | : | B    |               of its body, those that lie in another body (:) stay where they are and have no part
       \___________\:/______/                in phi, and when the bodies part they bound them again, with all that they carry. */
#ifndef SPRINGLS__STAGES_CONTACT_BODIES_H
#define SPRINGLS__STAGES_CONTACT_BODIES_H

#include "../runtime/launch.h"
#include "../model/cell_bricks.h"
#include "../model/constellation.h"
#include "components.h"

SPRINGLS__FN bool springls__contact_bodies_are_new(const springls_context *ctx)
{
    return ctx->model.params.contact == SPRINGLS_CONTACT_SEPARATE && ctx->last_contact_body == 0;
}

/* Gives every springl the body that it bounds. */
SPRINGLS__FN springls_status springls__find_contact_bodies(springls_context *ctx)
{
    springls__constellation *set = &ctx->model.set;
    springls__labels labels;
    int i;
    SPRINGLS__TRY(springls__components_to_host(ctx, SPRINGLS__BIT(CONTACT_BODY) | SPRINGLS__BIT(OVERLAPPED)));
    SPRINGLS__TRY(springls__find_components(ctx, &labels));
    for (i = 0; i < set->count; i++) {
        int32_t body, cavity;
        springls__components_at(&ctx->model.grid, &labels, set->s[i].p, &body, &cavity);
        set->contact_body[i] = (uint32_t)(body + 1);
        set->overlapped[i] = 0;
    }
    ctx->last_contact_body = (uint32_t)labels.count + 1u;
    return SPRINGLS_OK;
}

/* Finds which springls lie in another body. */
SPRINGLS__FN springls_status springls__find_overlap(springls_context *ctx)
{
    springls__arguments args;
    if (ctx->model.params.contact != SPRINGLS_CONTACT_SEPARATE) return SPRINGLS_OK;
    SPRINGLS__TRY(springls__displacement_since_phi(ctx, &args.overlap.max_displacement));
    SPRINGLS__TRY(springls__cell_list_cover(ctx));
    springls__run(ctx, SPRINGLS__KERNEL_overlap, ctx->model.set.count, &args);
    return SPRINGLS_OK;
}

#endif
