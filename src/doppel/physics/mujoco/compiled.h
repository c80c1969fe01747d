#pragma once
// Private to the MuJoCo back end: compilation of MJCF text, and calls in which an error of MuJoCo does not
// end the process.

#include <mujoco/mujoco.h>

#include <csetjmp>
#include <memory>
#include <string>

#include "doppel/core/diagnostic.h"

namespace doppel {

struct ModelDeleter {
  void operator()(mjModel* model) const { mj_deleteModel(model); }
};
using ModelHandle = std::unique_ptr<mjModel, ModelDeleter>;

// nullptr on failure, with MuJoCo's text in `message`; a warning also leaves its text there.
ModelHandle compile_mjcf(const std::string& mjcf, std::string& message);

namespace mujoco_detail {
// The target to which mju_error of this thread jumps; nullptr: none, and the process ends, because an
// exception must not pass MuJoCo's C frames.
extern thread_local std::jmp_buf* error_exit;
extern thread_local char error_text[256];
void install_handlers();
}  // namespace mujoco_detail

// Runs `call` and returns false if MuJoCo raised an error in it. `call` must own no resources, because the
// error leaves it by a jump.
template <typename Call>
bool guarded(const Call& call) {
  std::jmp_buf here;
  std::jmp_buf* const outer = mujoco_detail::error_exit;
  mujoco_detail::error_exit = &here;
  if (setjmp(here) != 0) {
    mujoco_detail::error_exit = outer;
    return false;
  }
  call();
  mujoco_detail::error_exit = outer;
  return true;
}

}  // namespace doppel
