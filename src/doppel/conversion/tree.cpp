#include "doppel/conversion/tree.h"
