/* tools.h - what a hand does to a model, each call one step: no window, no pointer, only rays and brushes.
 *
 * A brush is a ball. What it does fades smoothly from its centre to its rim: w(x) = (1 - |x - c|^2 / R^2)^2. */
#ifndef EXAMPLES_VIEWER_TOOLS_H
#define EXAMPLES_VIEWER_TOOLS_H

#include "viewer/camera.h"
#include "viewer/model.h"

struct viewer_brush {
    float center[3], normal[3]; /* world; normal: of the surface, outward */
    float radius;
};

/* The first place where the ray enters the body: the brush's centre and normal; its radius stays. False: it misses. */
bool viewer_pick(struct viewer_model *model, const struct viewer_ray *ray, struct viewer_brush *brush);

/* The furthest that one call with this brush should go, world units: the flow stays one to one, and one step suffices. */
float viewer_max_displacement(const struct viewer_model *model, const struct viewer_brush *brush);

/* Moves what is in the brush by `distance`, and the brush's centre with it. */
bool viewer_drag(struct viewer_model *model, struct viewer_brush *brush, const float displacement[3]);

/* Moves the surface that faces as the brush does along its normal, world units: positive outward. */
bool viewer_push(struct viewer_model *model, const struct viewer_brush *brush, float distance);

/* Moves the surface along its normal whichever way it faces; brush NULL: the whole body. */
bool viewer_inflate(struct viewer_model *model, const struct viewer_brush *brush, float distance);

/* Motion by mean curvature; amount 1 is as much as one step bears. brush NULL: the whole body. */
bool viewer_smooth(struct viewer_model *model, const struct viewer_brush *brush, float amount);

#endif
