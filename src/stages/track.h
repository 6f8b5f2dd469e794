/* track.h - keeps correspondences on the original surface (section 4.7).

   Why identity is safe here: no step computes the correspondence of an original springl again, whatever moves it. Only springls that
   come later, by a split or in a gap, get a new one, interpolated between those around, which may lie beside the original surface
   by the height of a chord; phi_ref pulls it back onto it (eq. 26). Ids are given once and never again, and a new springl
   notes the id of its parent and how many splits and fills lead to it, so that a place can be followed back to where it came from. */
#ifndef SPRINGLS__STAGES_TRACK_H
#define SPRINGLS__STAGES_TRACK_H

#include "../runtime/entries.h"

static const springls__entry springls__track[] = { SPRINGLS__KERNEL(track, SPRINGLS) /* eq. 26 */ SPRINGLS__END };

#endif
