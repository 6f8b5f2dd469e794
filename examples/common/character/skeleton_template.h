/* skeleton_template.h - a skeleton without a body: joints in a rest pose, read from a JSON file.
 *
 * In the file y is up, z forward and x to the body's left. Joints without a mirror form the trunk, from which limbs branch off
 * in pairs; every trunk end and every limb ends in a joint with "end", a place on the surface that gets no weights. */
#ifndef EXAMPLES_CHARACTER_SKELETON_TEMPLATE_H
#define EXAMPLES_CHARACTER_SKELETON_TEMPLATE_H

#include "character/character.h"

enum { TEMPLATE_JOINTS = 64, TEMPLATE_ENDS = 8 };

/* How a joint is placed in a body. */
enum template_place {
    PLACE_BETWEEN, /* between its neighbors as in the rest pose, nearer to where the limb is thin */
    PLACE_LIMB,    /* where the limb leaves the trunk */
    PLACE_AXIS,    /* over the middle of the limb, as high as the middle of the trunk */
    PLACE_NARROW,  /* where the trunk is narrowest nearby */
    PLACE_HEIGHT,  /* as high above the ground as in the rest pose, relative to the body's height, or to that of a limb's joint
                    * on the axis */
    PLACE_BEND,    /* where a leg bends backwards most; as PLACE_HEIGHT where it is straight */
    PLACE_SHARE    /* as far from the trunk's end that hangs on it, else from the limbs, as in the rest pose, relative to the way from
                    * one pair of limbs to the other */
};

struct template_joint {
    char name[CHARACTER_NAME], hint[CHARACTER_NAME]; /* hint: words in other skeletons' names, separated by '|' */
    int parent, mirror;                              /* -1: none */
    float position[3];
    enum template_place place;
    bool end, optional; /* optional: of a trunk end, such as a tail, that a body may lack */
};

struct skeleton_template {
    char name[CHARACTER_NAME];
    int count;
    struct template_joint joints[TEMPLATE_JOINTS]; /* parents before children */
    int trunk_ends, limbs;                         /* numbers of trunk ends and of pairs of limbs */
    int trunk_end[2];                              /* the head's end, and the tail's if there is one */
    int limb_end[2][2];                            /* of each pair: left, right */
    int limb_root[2][2];                           /* their first joints */
    bool ground[2];                                /* the pair stands on the ground */
    float height;                                  /* of the rest pose */
};

/* Reads a template. Returns false with one line in `error`. */
bool skeleton_template_read(const char *path, struct skeleton_template *skeleton, char error[CHARACTER_TEXT]);

/* Returns whether `joint` is `above` or below it. */
bool skeleton_template_below(const struct skeleton_template *skeleton, int joint, int above);

#endif
