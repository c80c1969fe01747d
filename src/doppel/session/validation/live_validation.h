#pragma once
// The suite of `doppel validate` behind the services of a running twin (session/live/validation_service.h).

#include <memory>
#include <string>

#include "doppel/export.h"
#include "doppel/session/live/audit_result.h"
#include "doppel/session/live/validation_work.h"

namespace doppel {

struct LiveValidationOptions {
  BundledFolders bundled;
  std::string version;   // of doppel, for reports
  std::size_t jobs = 1;  // threads of a run
};

// It writes no files: of gates with a committed answer (validation/tree.txt), a missing one stays missing.
DOPPEL_API std::shared_ptr<ValidationWork> make_live_validation(LiveValidationOptions options);

}  // namespace doppel
