#pragma once
// Options of ros2 bag that doppel does not have: harmless ones are accepted with a note, so that command
// lines can be reused, and the others are refused with the reason.

#include <span>

namespace CLI {
class App;
}

namespace doppel::app {

struct ForeignOption {
  const char* name;
  int values;           // 0: a flag
  const char* refusal;  // why it cannot be used; "": it is accepted
  const char* instead;  // what to do, or why nothing has to be done
};

// They are not in the help.
void add_foreign_options(CLI::App& verb, std::span<const ForeignOption> options);

}  // namespace doppel::app
