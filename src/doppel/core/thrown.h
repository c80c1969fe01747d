#pragma once
// What code from outside threw, as text.

#include <exception>
#include <string>

namespace doppel {

// Of the exception that is being handled, whatever its type. Precondition: called in a catch clause.
inline std::string thrown_text() {
  try {
    throw;
  } catch (const std::exception& problem) {
    return problem.what();
  } catch (...) {
    return "it threw something other than a std::exception";
  }
}

}  // namespace doppel
