// As library.h, for programs, which are compiled by other options.
#include "library.h"

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>
