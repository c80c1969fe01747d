#pragma once
// Positions and lengths as users write them: "1.2" (rad or m), "90deg", "1.57rad", "0.2m".

#include <string_view>

namespace doppel::app {

// In rad or m. `context` is quoted in the message: "elbow=9odeg". Throws InputError.
double parse_position(std::string_view number, std::string_view context);

}  // namespace doppel::app
