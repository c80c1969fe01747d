#include "doppel/geometry/mesh_report.h"
