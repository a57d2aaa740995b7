/* The implementation that most tests share, and what they see of its inside. */
#define DEM2D_IMPLEMENTATION
#define DEM2DI_FIELD_TEXTS
#include "dem2d.h"
#include "inside.h"
#include "fields.h"
