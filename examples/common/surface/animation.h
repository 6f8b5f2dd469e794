/* animation.h - clips: keys of the places, rotations and scales of nodes, and what they are at a time (glTF 2.0, 3.11 and appendix C). */
#ifndef EXAMPLES_SURFACE_ANIMATION_H
#define EXAMPLES_SURFACE_ANIMATION_H

enum { ANIMATION_NAME = 64 };

enum keys_interpolation { KEYS_LINEAR, KEYS_STEP, KEYS_CUBIC }; /* between keys: straight or along the arc; the key before; cubic splines */

struct keys { /* animation of one property of a node */
    int count;
    double *times;  /* seconds, rising */
    double *values; /* 3 a key, or 4: quaternion w, x, y, z; KEYS_CUBIC: three such groups a key: in-tangent, value, out-tangent */
    enum keys_interpolation interpolation;
};

struct channel {
    int joint; /* the node */
    struct keys translation, rotation, scale;
};

struct animation {
    char name[ANIMATION_NAME];
    double duration; /* seconds */
    int channel_count;
    struct channel *channels;
};

/* Frees what an animation owns. */
void animation_free(struct animation *animation);

/* Returns how many numbers a key has, of a property that has `width`. */
int keys_width(const struct keys *keys, int width);

/* Returns the value of key k, without its tangents. */
double *keys_value(const struct keys *keys, int width, int k);

/* Computes the property at a time: width 3, or 4 for a rotation, which has length 1. Leaves `out` as it is where there are no keys. */
void keys_sample(const struct keys *keys, int width, double time, double *out);

#endif
