#pragma once
// Private to the reports of this room.

#include <string>

namespace doppel {

// With two digits, in the unit that reads best: "0.41 mrad", "120 um". The least that is told apart is 1e-12.
std::string size_of(double value, const char* unit);

}  // namespace doppel
