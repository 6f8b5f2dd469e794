/* label_names.h - names and colors of labels: of a table in a text file, or of the segments in a Slicer file (.seg.nrrd).
 *
 * A table has a label in each line, in one of two forms, and comments behind '#':
 *
 *   id  R G B  A  VIS MSH  "name"     ITK-SNAP's label descriptions: R, G, B from 0 to 255
 *   id  name  R G B  A                tables of colors of Slicer and FreeSurfer: a name without blanks; colors may be left out
 *
 * A .seg.nrrd has keys Segment0_Name, Segment0_LabelValue, Segment0_Layer, Segment0_Color and so on. Segments may overlap, then the
 * file has several layers, which are frames of the image. */
#ifndef EXAMPLES_IMAGING_LABEL_NAMES_H
#define EXAMPLES_IMAGING_LABEL_NAMES_H

#include "imaging/volume.h"

enum { LABEL_NAME = 64 };

struct label_name {
    uint32_t id;
    int layer;         /* of a segment, otherwise 0 */
    char name[LABEL_NAME];
    float color[3];    /* 0..1; color[0] < 0: none */
};

struct label_names {
    struct label_name *items;
    size_t count;
};

/* Reads a table. Returns false with one line in `error`: not readable, a line of another form, a label twice. */
bool label_names_read(const char *path, struct label_names *names, char error[VOLUME_TEXT]);

/* Reads the segments of a NRRD file; none are found where it, or another file, has none. Returns false as above. */
bool label_names_of_segments(const char *path, struct label_names *names, char error[VOLUME_TEXT]);
void label_names_free(struct label_names *names);

/* Finds a label of a layer; NULL: it has no name. */
const struct label_name *label_names_find(const struct label_names *names, uint32_t id, int layer);

/* Reads a label: a whole number from 0 to 2^32 - 1 and nothing else. */
bool label_read(const char *text, uint32_t *id);

#endif
