#pragma once
// The state of a whole twin at one instant: engine, controllers with their hardware, sensors, parts, time
// and hashes. A value that does not change any more; TwinCore::restore() continues from it as from the
// instant at which it was saved.

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "doppel/base/core/time.h"
#include "doppel/export.h"
#include "doppel/physics/contract/engine.h"
#include "doppel/scenario/compile/compiled_scenario.h"
#include "doppel/twin/loop/tickable.h"
#include "doppel/twin/loop/twin_robot.h"

namespace doppel {

class DOPPEL_API SavedState {
 public:
  [[nodiscard]] Time time() const { return time_; }
  [[nodiscard]] std::uint64_t steps() const { return steps_; }
  // Active controllers that do not implement saving, "NAMESPACE/controller": a restore reactivates them.
  [[nodiscard]] const std::vector<std::string>& unsaved_controllers() const { return unsaved_; }

 private:
  friend class TwinCore;
  struct Robot {
    std::string name_space;
    std::shared_ptr<const CompiledRobot> machine;
    TwinRobot::Saved run;
  };

  Time time_{};
  std::uint64_t steps_ = 0, objects_hash_ = 0, gone_hash_ = 0;
  std::uint64_t machine_ = 0;  // CompiledScenario::number
  std::shared_ptr<const std::vector<ModelSensors>> model_sensors_;
  std::unique_ptr<Engine> engine_;
  std::vector<Robot> robots_;
  SavedTicks parts_;
  std::vector<std::string> unsaved_;
};

}  // namespace doppel
