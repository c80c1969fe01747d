#pragma once
// The robot that the command line of `up` and `view` specifies.

#include <string>
#include <vector>

#include "doppel/scenario/schema/scenario.h"

namespace CLI {
class App;
}

namespace doppel::app {

struct DescribedBy {
  std::vector<std::string> words;  // TARGET and its name:=value arguments
  std::vector<std::string> set;    // further name:=value
};

// TARGET and --set.
void add_described_by(CLI::App& verb, DescribedBy& by, bool required = true);

// The scenario of that description (without a robot where there is none). Throws InputError: an argument that
// is not name:=value.
Scenario described_scenario(const DescribedBy& by);

}  // namespace doppel::app
