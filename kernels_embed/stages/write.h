/* write.h - puts springls where the caller has moved them. */
#ifndef SPRINGLS__KERNEL_STAGES_WRITE_H
#define SPRINGLS__KERNEL_STAGES_WRITE_H

#include "../model/model.h"

/* Returns where particle p goes with its triangle: it keeps its barycentric coordinates, and its offset from the place there. */
SPRINGLS__MATHS springls__v3 springls__carried_particle(springls__tri from, springls__tri to, springls__v3 p)
{
    springls__tri_hit before = springls__tri_closest(from, p);
    springls__tri_hit after = springls__tri_hit_make(to, p, before.bary[0], before.bary[1], before.bary[2]);
    return springls__add(after.point, springls__sub(p, before.point));
}

/* Puts springl args.write.first + i where the caller has it. A triangle that is not given moves by as much as the particle; a
   particle that is not given is carried by its triangle. */
SPRINGLS__MATHS void springls__write_element(const springls__model *model, springls__arguments args, int i)
{
    int n = args.write.first + i, m;
    springls__springl s = model->set.s[n], old = s;
    if (args.write.particles) s.p = model->force.written_particles[i];
    if (args.write.vertices)
        for (m = 0; m < 3; m++) s.q[m] = model->force.written_vertices[3 * i + m];
    if (!args.write.particles) s.p = springls__carried_particle(springls__springl_tri(old), springls__springl_tri(s), old.p);
    if (!args.write.vertices)
        for (m = 0; m < 3; m++) s.q[m] = springls__add(old.q[m], springls__sub(s.p, old.p));
    model->set.s[n] = springls__springl_finished(s);
}

#endif
