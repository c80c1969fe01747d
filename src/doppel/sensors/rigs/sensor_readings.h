#pragma once
// Present values of physical sensors for controllers, by the interface names of ros2_control: those of the sensors' topics
// (physical_rig.h), computed from the engine's states whenever they are read. Without a step before, as after a reset or
// after the state was written, accelerations are zero; in the step in which instances come or go, values stay.
//
// The noise of the reading in period n since the start or the last reset depends on the seed, the sensor and n alone, and is
// not that of the topic.

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "doppel/base/core/saved_part.h"
#include "doppel/base/core/time.h"
#include "doppel/base/math/geodesy.h"
#include "doppel/export.h"
#include "doppel/physics/contract/engine.h"
#include "doppel/sensors/models/reading_names.h"
#include "doppel/sensors/rigs/range_values.h"
#include "doppel/sensors/rigs/rig_sensor.h"

namespace doppel {

class DOPPEL_API SensorReadings {
 public:
  // period: of the readings. A sensor of which reading_names() is empty has no values. ranges: of the rig that measures range
  // sensors, which are measured while these readings exist; nullptr: they read NaN.
  SensorReadings(const std::vector<RigSensor>& sensors, const RigOptions& options, const EarthFrame& earth,
                 Duration period, RangeValues* ranges = nullptr);
  ~SensorReadings();
  SensorReadings(const SensorReadings&) = delete;
  SensorReadings& operator=(const SensorReadings&) = delete;

  // -- between steps
  // Looks up the instances of the sensors. The first time, the present state is that of the start.
  void bind(const Engine& engine);
  // The present state is that of the start: orientations refer to it, and the noise begins anew.
  void restart(const Engine& engine);
  // The state of instances was written: it is not that of a step. Starts and noise stay.
  void state_written();
  // Continues in place of others: sensors of the same name and type keep their start and their noise. now: of the engine.
  void resume(const SensorReadings& before, Time now);

  // The state that changes from reading to reading, for readings of the same sensors (saved_part.h). To be
  // restored after the state of the engine.
  void save(SavedSlot& slot) const;
  void restore(const SavedPart& saved);

  // -- in the loop: no allocation, no throw
  // Notes the state from which a step begins, at whose end the values may be read.
  void before_step(const Engine& engine);
  // Computes the values of the present state, once for each instant.
  void read(const Engine& engine);
  // Of the last read(), in the order of reading_names(); NaN: the sensor's instance is not in the engine.
  [[nodiscard]] std::span<const double> values(std::size_t sensor) const;
  // True if the values are a function of the states and the seed. Not those of a range, which depend on when
  // its sample is finished, without lockstep.
  [[nodiscard]] bool repeatable(std::size_t sensor) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace doppel
