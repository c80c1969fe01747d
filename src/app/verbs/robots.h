#pragma once

#include <string>
#include <vector>

namespace doppel::app {

// The names of the robots that come with doppel, sorted.
std::vector<std::string> bundled_robots();

}  // namespace doppel::app
