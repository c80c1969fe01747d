#pragma once
// Numbers in the text of a parameter file, with its comments, its order and all other bytes.

#include <string>
#include <string_view>
#include <vector>

#include "doppel/export.h"

namespace doppel {

struct NumberEdit {
  std::string node;     // "arm_controller"
  std::string name;     // "gains.Revolute 2.p"
  std::string written;  // "120.0"
  // The number of the same map behind which it is added where the file does not have it; empty: it is not
  // added.
  std::string behind = {};
};

// The text with these numbers; what already is written in the same way stays as it is. `file`: its name in
// messages, `rule`: of the errors. Throws InputError with what to write by hand: a value that is not a number
// (an alias, a substitution), that several nodes or names share, or that is missing without a place for it.
DOPPEL_API std::string with_numbers(std::string_view text, const std::string& file,
                                    const std::vector<NumberEdit>& edits, const std::string& rule);

}  // namespace doppel
