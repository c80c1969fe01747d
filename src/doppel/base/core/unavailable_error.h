#pragma once

#include "doppel/base/core/diagnostic.h"
#include "doppel/export.h"

namespace doppel {

// Valid input that asks for what this machine does not have now, such as a port that another process has:
// exit code 1.
class DOPPEL_API UnavailableError : public InputError {
 public:
  using InputError::InputError;
};

}  // namespace doppel
