#include "doppel/audit/audit.h"
