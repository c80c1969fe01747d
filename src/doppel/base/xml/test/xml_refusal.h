#pragma once
// Helpers that the tests of the parser share.

#include <string>

#include "doppel/base/core/diagnostic.h"
#include "doppel/base/xml/xml.h"

namespace doppel {

// The error with which the text is rejected as "f.xml"; empty if it is accepted.
inline std::string refusal_of(const std::string& text) {
  try {
    parse_xml(text, "f.xml");
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

}  // namespace doppel
