/* tools.h - the modeling tools, each call one step, by rays and brushes; they need no window and no pointer. With a budget the
 * step goes on in viewer_model_continue.
 *
 * A brush is a ball. Its effect fades smoothly from its center to its rim: w(x) = (1 - |x - c|^2 / R^2)^2. */
#ifndef EXAMPLES_VIEWER_TOOLS_H
#define EXAMPLES_VIEWER_TOOLS_H

#include "viewer/camera.h"
#include "viewer/model.h"

struct viewer_brush {
    float center[3], normal[3]; /* world; normal: of the surface, outward */
    float radius;
};

/* Finds the first place where the ray enters the body and sets the brush's center and normal there. Returns false if it
 * misses. */
bool viewer_pick(struct viewer_model *model, const struct viewer_ray *ray, struct viewer_brush *brush);

/* Returns the maximum displacement of one call with this brush in world units: within it the flow is one to one, in one step. */
float viewer_max_displacement(const struct viewer_model *model, const struct viewer_brush *brush);

/* Moves the content of the brush and the brush's center by `displacement`. */
bool viewer_drag(struct viewer_model *model, struct viewer_brush *brush, const float displacement[3]);

/* Moves the surface that faces like the brush along the brush's normal, by world units, positive outward. */
bool viewer_push(struct viewer_model *model, const struct viewer_brush *brush, float distance);

/* Moves the surface along its normals whichever way they face, by world units; brush NULL: the whole body. */
bool viewer_inflate(struct viewer_model *model, const struct viewer_brush *brush, float distance);

/* Moves the surface by its mean curvature; amount 1 is the maximum of one step. brush NULL: the whole body. */
bool viewer_smooth(struct viewer_model *model, const struct viewer_brush *brush, float amount);

#endif
