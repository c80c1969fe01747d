#include "doppel/calibration/calibration.h"
