/* clip_transfer.h - clips of one character on the skeleton of another, with which it is aligned. */
#ifndef EXAMPLES_CHARACTER_CLIP_TRANSFER_H
#define EXAMPLES_CHARACTER_CLIP_TRANSFER_H

#include "character/skeleton_align.h"

/* Makes clips for the target's joints from all clips of the source, with keys 1/fps seconds apart. A paired joint turns as its
 * partner does, seen from each body (y is up); arms and legs first become parallel to the source's. The first bone also moves,
 * by the ratio of sizes. Left out are clips that the target has too, with the same name, duration and turns; other equal names get
 * " (source)". To be freed by clips_free. Returns false, with nothing to free, if memory is short. */
bool clips_transfer(const struct character *source, const struct alignment *alignment, const struct character *target, int fps,
                    struct animation **clips, int *count);
void clips_free(struct animation *clips, int count);

#endif
