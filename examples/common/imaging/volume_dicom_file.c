/* volume_dicom_file.c - whether a DICOM file is whole: GDCM ends the program at some files that are cut off, and lets others pass. */
#define _POSIX_C_SOURCE 200809L

#include "imaging/volume_format.h"

#include <string.h>

enum { FIRST_ELEMENT = 132, NAME = 64 };

static const uint32_t no_length = 0xffffffffu, syntax_tag = 0x00020010u, item_end = 0xfffee00du, sequence_end = 0xfffee0ddu;

struct element {
    uint32_t tag, length;
    int header; /* bytes before its value */
    bool odd;   /* not written as its syntax says, or of a type that is not known */
};

static uint32_t number_at(const unsigned char *bytes, int count)
{
    uint32_t number = 0;
    while (count-- > 0) {
        number = number << 8 | bytes[count];
    }
    return number;
}

/* Items and their ends have no types in either syntax. */
static struct element element_of(const unsigned char bytes[12], bool typed)
{
    static const char *const long_types = "OB OD OF OL OV OW SQ SV UC UN UR UT UV";
    const char type[3] = {(char)bytes[4], (char)bytes[5], '\0'};
    struct element e = {number_at(bytes, 2) << 16 | number_at(bytes + 2, 2), number_at(bytes + 4, 4), 8, false};
    if (typed && e.tag >> 16 != 0xfffe) {
        const bool is_long = strlen(type) == 2 && strstr(long_types, type);
        e.length = is_long ? number_at(bytes + 8, 4) : number_at(bytes + 6, 2);
        e.header = is_long ? 12 : 8;
        e.odd = type[0] < 'A' || type[0] > 'Z' || type[1] < 'A' || type[1] > 'Z' || (e.length == no_length && strcmp(type, "UN") == 0);
    }
    return e;
}

/* Walks from element to element, into sequences of unknown length. Returns whether all that is said to be there is, and no more. */
static bool is_whole(FILE *file, int64_t size)
{
    char syntax[NAME + 1] = "";
    bool typed = true, begun = false; /* begun: what follows the description of the file itself */
    int unended = 0; /* sequences and items */
    for (int64_t at = FIRST_ELEMENT; at < size;) {
        unsigned char bytes[12] = {0};
        if (fseeko(file, (off_t)at, SEEK_SET) != 0 || fread(bytes, 1, sizeof bytes, file) < 2) {
            return false;
        }
        if (!begun && number_at(bytes, 2) != 2) {
            begun = true;
            typed = strcmp(syntax, "1.2.840.10008.1.2") != 0;
            if (strcmp(syntax, "1.2.840.10008.1.2.2") == 0 || strcmp(syntax, "1.2.840.10008.1.2.1.99") == 0) {
                return true; /* of high bytes first, or deflated: not looked at */
            }
        }
        const struct element e = element_of(bytes, typed);
        if (at + e.header > size) {
            return false;
        }
        if (e.odd) {
            return true; /* for GDCM to judge */
        }
        if (e.tag == syntax_tag && e.length <= NAME) {
            fseeko(file, (off_t)(at + e.header), SEEK_SET);
            syntax[fread(syntax, 1, e.length, file)] = '\0';
        }
        unended += e.length == no_length;
        unended -= unended > 0 && (e.tag == item_end || e.tag == sequence_end);
        at += e.header + (e.length == no_length ? 0 : (int64_t)e.length);
        if (at > size) {
            return false;
        }
    }
    return begun && unended == 0;
}

enum volume_dicom volume_look_at_dicom(const char *path)
{
    char begin[FIRST_ELEMENT];
    FILE *file = fopen(path, "rb");
    const size_t count = file ? fread(begin, 1, sizeof begin, file) : 0;
    enum volume_dicom found = count == 0 ? DICOM_CUT : NO_DICOM;
    if (count == sizeof begin && memcmp(begin + 128, "DICM", 4) == 0) {
        found = is_whole(file, volume_file_size(path)) ? DICOM_WHOLE : DICOM_CUT;
    }
    if (file) {
        fclose(file);
    }
    return found;
}
