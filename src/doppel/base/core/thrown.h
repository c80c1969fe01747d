#pragma once
// The text of an exception of foreign code, such as a plugin library.

#include <exception>
#include <new>
#include <string>

namespace doppel {

// The text of the exception that is being handled, of any type. Precondition: called in a catch clause.
inline std::string thrown_text() {
  try {
    throw;
  } catch (const std::bad_alloc&) {
    return "there is not enough memory";
  } catch (const std::exception& problem) {
    return problem.what();
  } catch (...) {
    return "it threw something other than a std::exception";
  }
}

}  // namespace doppel
