#include "segment.h"
bool segment_compare_level_set(struct segment *run) { (void)run; return true; }
