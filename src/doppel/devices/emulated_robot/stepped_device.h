#pragma once
// A hardware component that is part of a simulation beside the engine: its devices move the joints before
// each step.

#include <string_view>

#include "doppel/export.h"
#include "doppel/physics/contract/engine.h"

namespace doppel {

class DOPPEL_API SteppedDevice {
 public:
  virtual ~SteppedDevice() = default;
  // In the loop, before each step of the engine.
  virtual void before_step() = 0;
  // Between steps: a hand brings a joint whose torque is off to this position (rad or m). False: it has no
  // such joint, or there is no hand (HandMotion::guide).
  virtual bool guide(std::string_view /*joint*/, double /*position*/) { return false; }
  // Between steps: continues with another instance of a model with the same joints.
  virtual void rebind(Instance robot) = 0;
};

}  // namespace doppel
