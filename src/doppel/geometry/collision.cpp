#include "doppel/geometry/collision.h"
