#pragma once
// The error of a damaged file.

#include <string>

#include "doppel/base/core/diagnostic.h"

namespace doppel {

[[noreturn]] inline void mcap_damaged(const std::string& why, const std::string& fix = "") {
  throw InputError("mcap.damaged", {}, why, fix);
}

}  // namespace doppel
