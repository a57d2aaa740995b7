/* The implementation that most tests share, and what they see of its inside. */
#define DEM2D_IMPLEMENTATION
#include "dem2d.h"
#include "inside.h"
