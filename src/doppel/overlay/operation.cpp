#include "doppel/overlay/operation.h"
