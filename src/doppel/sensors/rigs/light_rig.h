#pragma once
// Cameras, lidars and range sensors of a running world. In the loop a sensor whose sample is due is noted
// with a snapshot of all poses; another thread makes the picture or scan; between two steps its messages
// are published in order, with the stamp of the snapshot. Topics without subscribers are not rendered. If
// that thread does not keep up, samples are dropped and counted. The loop waits for it only in lockstep.
//
// The noise of sample n depends on the seed, the sensor and n alone, so that the same run gives the same bytes at any
// speed and with any readers.

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "doppel/base/core/log.h"
#include "doppel/base/core/saved_part.h"
#include "doppel/export.h"
#include "doppel/physics/contract/engine.h"
#include "doppel/ros/bus/bus.h"
#include "doppel/sensors/rigs/range_values.h"
#include "doppel/sensors/rigs/rig_sensor.h"

namespace doppel {

class DOPPEL_API LightRig {
 public:
  // The log outlives the rig.
  LightRig(Bus& bus, const Log& log, const RigOptions& options);
  ~LightRig();
  LightRig(const LightRig&) = delete;
  LightRig& operator=(const LightRig&) = delete;

  // -- between steps
  // Sets the values from which controllers read ranges of the sensors that set_sensors() makes afterwards.
  void set_ranges(std::shared_ptr<RangeValues> ranges);
  // Replaces all sensors; those that stay keep their count of samples, and the messages that wait for a
  // latency if their values stay, too. Sensors of other kinds are left out, and with an error those whose
  // topic has another type elsewhere.
  void set_sensors(const std::vector<RigSensor>& sensors, const Engine& engine);
  // Lets other nodes use the topics with other types; set_sensors() follows.
  void release_topics();
  // The engine has other instances: looks up those of the sensors again.
  void instances_changed(const Engine& engine);
  void between_steps(Time now);
  void reset(Time now);
  // The schedules and the messages that wait for a latency; of sensors with the same names. Samples that
  // are being made are part of it in lockstep only; restore() drops those of the present.
  void save(SavedSlot& slot);
  void restore(const SavedPart& saved);
  [[nodiscard]] std::vector<RigStatus> status() const;
  // Writes the present rates and counts into the list that status() gave; does not allocate.
  void refresh(std::span<doppel_msgs::msg::Sensor> list) const;
  // The number of failed samples of a sensor of that list.
  [[nodiscard]] std::uint64_t failed(std::size_t sensor) const;
  [[nodiscard]] bool empty() const;
  [[nodiscard]] std::uint64_t rays_cast() const;

  // -- in the loop: no allocation, no throw; waits in lockstep only
  void after_step(Time now, const Engine& engine);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace doppel
