/* tools.h - the modeling tools, each call one step, by rays and brushes; they need no window and no pointer. With a budget the
 * step goes on in viewer_model_continue.
 *
 * A brush is a ball, and with symmetry its mirror image too. Its effect fades from its center to its rim, q = |x - c|^2 / R^2.
 * What is masked does not move. */
#ifndef EXAMPLES_VIEWER_TOOLS_H
#define EXAMPLES_VIEWER_TOOLS_H

#include "viewer/camera.h"
#include "viewer/model.h"

enum viewer_falloff {
    VIEWER_FALLOFF_SMOOTH,  /* (1 - q)^2 */
    VIEWER_FALLOFF_POINTED, /* (1 - q)^4 */
    VIEWER_FALLOFF_FLAT,    /* (1 - q^2)^2 */
    VIEWER_FALLOFFS
};

struct viewer_brush {
    float center[3], normal[3]; /* world; normal: of the surface, outward */
    float radius;
    float strength; /* share of the largest effect of a step, 0 to 1 */
    enum viewer_falloff falloff;
    int symmetry; /* 1, 2, 3: mirrored along x, y, z, at the middle of the body at the start; 0: not */
};

/* Finds the first place where the ray enters the body and sets the brush's center and normal there. Returns false if it
 * misses. */
bool viewer_pick(struct viewer_model *model, const struct viewer_ray *ray, struct viewer_brush *brush);

/* Returns the maximum displacement of one call with this brush in world units, at full strength: within it the flow is one to one,
 * in one step. */
float viewer_max_displacement(const struct viewer_model *model, const struct viewer_brush *brush);

/* Moves the content of the brush and the brush's center by `displacement`. */
bool viewer_drag(struct viewer_model *model, struct viewer_brush *brush, const float displacement[3]);

/* Moves the surface that faces like the brush along the brush's normal, by world units, positive outward. */
bool viewer_push(struct viewer_model *model, const struct viewer_brush *brush, float distance);

/* Moves the surface along its normals whichever way they face, by world units; brush NULL: the whole body. */
bool viewer_inflate(struct viewer_model *model, const struct viewer_brush *brush, float distance);

/* Moves the surface by its mean curvature; amount 1 is the maximum of one step. brush NULL: the whole body. */
bool viewer_smooth(struct viewer_model *model, const struct viewer_brush *brush, float amount);

/* Adds to the mask, or takes away from it where amount is negative; 1 masks the brush's center at once. brush NULL: the whole
 * body. */
bool viewer_mask(struct viewer_model *model, const struct viewer_brush *brush, float amount);

#endif
