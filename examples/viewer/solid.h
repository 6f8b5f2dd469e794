/* solid.h - cuts a model along a stroke of the pointer, and merges a second body into it. */
#ifndef EXAMPLES_VIEWER_SOLID_H
#define EXAMPLES_VIEWER_SOLID_H

#include "viewer/camera.h"
#include "viewer/model.h"

/* The region that a stroke removes, seen from the eye: a slab around the plane through the eye and the stroke, no longer than
 * the stroke; or everything to the right of that plane in the direction of the stroke. */
struct viewer_cut {
    float eye[3], normal[3];    /* of the plane; to the right */
    float after[3], before[3];  /* the planes through the stroke's ends: the stroke is in front of both */
    float half_width;           /* of the slab */
    bool side;                  /* all to the right instead */
    float middle[3], reach;     /* nothing further from the middle along an axis is removed; set by viewer_subtract */
};

/* Makes a cut between two rays. Returns false if the rays are too close to each other. */
bool viewer_cut_between(const struct viewer_ray *from, const struct viewer_ray *to, float width, bool side,
                        struct viewer_cut *cut);

/* Subtracts the cut; the rest keeps its springls, correspondences and colors. After a failure the model may be empty. */
bool viewer_subtract(struct viewer_model *model, const struct viewer_cut *cut);
bool viewer_merge(struct viewer_model *model, struct viewer_model *second);

#endif
