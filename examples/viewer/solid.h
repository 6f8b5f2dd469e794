/* solid.h - cutting a model along a stroke of the pointer, and merging a second body into it. */
#ifndef EXAMPLES_VIEWER_SOLID_H
#define EXAMPLES_VIEWER_SOLID_H

#include "viewer/camera.h"
#include "viewer/model.h"

/* What a stroke takes away, seen from the eye: a slab about the plane through the eye and the stroke, no longer than the
 * stroke; or all that lies to the right of that plane, as the stroke runs. */
struct viewer_cut {
    float eye[3], normal[3];    /* of the plane; to the right */
    float after[3], before[3];  /* the stroke is where both planes have the point before them */
    float half_width;           /* of the slab */
    bool side;                  /* all to the right instead */
};

/* False: the two rays are too near to each other. */
bool viewer_cut_between(const struct viewer_ray *from, const struct viewer_ray *to, float width, bool side, struct viewer_cut *cut);

/* What stays keeps its springls, correspondences and colours. After a failure the model may be empty. */
bool viewer_subtract(struct viewer_model *model, const struct viewer_cut *cut);
bool viewer_merge(struct viewer_model *model, struct viewer_model *second);

#endif
