#include "doppel/overlay/overlay.h"
