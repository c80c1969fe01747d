#pragma once
// Private to the reports of this module.

#include <string>

namespace doppel {

// With two digits and a suitable prefix of the unit: "0.41 mrad", "120 um". The resolution is 1e-12.
std::string size_of(double value, const char* unit);

}  // namespace doppel
