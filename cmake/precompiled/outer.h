// As library.h, for what never runs in the control loop, which is compiled by other options.
#include "library.h"

#include <nlohmann/json.hpp>
