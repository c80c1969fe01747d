#pragma once
// Private to the MuJoCo back end: compilation of MJCF text, and calls in which an error of MuJoCo does not
// end the process.

#include <mujoco/mujoco.h>

#include <memory>
#include <stdexcept>
#include <string>

#include "doppel/base/core/diagnostic.h"

namespace doppel {

struct ModelDeleter {
  void operator()(mjModel* model) const { mj_deleteModel(model); }
};
using ModelHandle = std::unique_ptr<mjModel, ModelDeleter>;

// nullptr on failure, with MuJoCo's text in `message`; a warning also leaves its text there. Throws
// InputError "physics.no_room".
ModelHandle compile_mjcf(const std::string& mjcf, std::string& message);

// An error that MuJoCo raised (mju_error).
class MujocoError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

namespace mujoco_detail {
extern thread_local char error_text[256];  // of the last MujocoError of this thread
void install_handlers();
}  // namespace mujoco_detail

// Runs `call` and returns false if MuJoCo raised an error in it.
template <typename Call>
bool guarded(const Call& call) {
  try {
    call();
  } catch (const MujocoError&) {
    return false;
  }
  return true;
}

}  // namespace doppel
