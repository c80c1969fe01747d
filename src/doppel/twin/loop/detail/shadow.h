#pragma once
// The twin of a robot with real hardware. Modes shadow and rehearse: while a controller commands the
// hardware, the drives of the instance get the same position commands after the limits, and joints without
// one hold their measured position; otherwise, and in mode follow, the instance is written to the measured
// positions. Nothing of it sends anything to the hardware. With the gate of the loop.

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "doppel/control/manager/controller_manager.h"
#include "doppel/physics/contract/engine.h"
#include "doppel/scenario/schema/scenario.h"

namespace doppel {

class Shadow {
 public:
  // The manager outlives the shadow.
  Shadow(const ControllerManager& manager, const Model& model, MirrorMode mode);

  // In the loop, before each step.
  void before_step(Instance robot);
  // The instance's q with the measured positions in it; valid until the next call.
  [[nodiscard]] std::span<const double> measured_q(const Instance& robot);
  [[nodiscard]] bool is_measured(int joint) const;
  // The last step was one with the commands of the hardware.
  [[nodiscard]] bool is_commanded() const { return commanded_; }

 private:
  struct Joint {
    int joint = -1;
    std::size_t q = 0, v = 0;
    std::string position, velocity;  // the interfaces
  };
  [[nodiscard]] double position(const Joint& joint) const;  // NaN: not read
  void command(Instance robot) const;
  void follow(Instance robot);

  const ControllerManager& manager_;
  const MirrorMode mode_;
  std::vector<Joint> joints_;
  std::vector<double> q_, v_;
  bool commanded_ = false;
};

}  // namespace doppel
