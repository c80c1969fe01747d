#pragma once
// Answers of services that say why something is refused.

#include <string>
#include <utility>

#include "doppel/base/core/diagnostic.h"
#include "doppel/base/core/thrown.h"

namespace doppel {

// The first error with what to do, in one line.
inline std::string refusal_text(const InputError& error) {
  const Diagnostic& first = error.diagnostics().front();
  const std::string place = first.where.known() ? first.where.str() + ": " : "";
  return place + first.message + (first.fix.empty() ? "" : "; " + first.fix);
}

// In a handler: of the exception that is handled.
inline std::string text_of_exception() {
  try {
    throw;
  } catch (const InputError& error) {
    return refusal_text(error);
  } catch (...) {
    return thrown_text();
  }
}

template <class Response>
Response refusal(std::string why) {
  Response out;
  out.success = false;
  out.message = std::move(why);
  return out;
}

}  // namespace doppel
