#pragma once
// The services of one robot's arms (arms.h). The loop's thread.

#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "doppel/base/core/log.h"
#include "doppel/export.h"
#include "doppel/ros/bus/bus.h"
#include "doppel/twin/arms/arm_snapshot.h"

namespace doppel {

class DOPPEL_API ArmServices {
 public:
  // `snapshot`: on the loop's thread, for each request; nullopt: there is no robot now. `log` and `bus`
  // outlive the services.
  ArmServices(Bus& bus, const Log& log, const std::string& name_space,
              std::function<std::optional<ArmSnapshot>()> snapshot);
  ~ArmServices();
  ArmServices(const ArmServices&) = delete;
  ArmServices& operator=(const ArmServices&) = delete;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace doppel
