#pragma once
// The width and the colours of stdout.

#include <string>

namespace doppel::app {

struct TerminalShape {
  bool colour = false;
  int width = 100;  // columns
};

// colour: "auto", "always" or "never". Piped output has no colour, and the width of COLUMNS or 100.
TerminalShape terminal_shape(const std::string& colour);

}  // namespace doppel::app
