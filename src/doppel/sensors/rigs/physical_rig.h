#pragma once
// Physical sensors of a running world. Their values follow from the engine's states alone, so that every engine has
// them: the acceleration over a step is the change of its velocities, with inverse dynamics (Featherstone 2008, table
// 5.1) for the links and for the wrenches between them. A sample is taken at the end of the step that is nearest to its
// time, with the stamp of that instant.
//
// sensor_msgs/Imu: specific force (acceleration minus gravity, m/s^2), angular velocity (rad/s) and orientation at the
// sensor's own point.
//
// geometry_msgs/WrenchStamped: the wrench that a joint, also a fixed one, transmits over the step (N, N m), torque about
// the sensor's own point: the rate of momentum of all beyond the joint, without the parts of gravity and contacts. What
// moves freely and is attached beyond the joint is part of it. Not known are wrenches that Instance::apply_wrench()
// applies beyond the joint, and loads through an attachment to another instance with a fixed base: they are measured as if
// the joint transmitted them.
//
// Sensors of the environment: sensor_msgs/NavSatFix (WGS 84, by the world's place on Earth), sensor_msgs/MagneticField (T, in
// the axes of the frame that the header names), ros_gz_interfaces/Altimeter (m from the height at the start, m/s),
// sensor_msgs/FluidPressure (Pa, of the standard atmosphere) and ros_gz_interfaces/LogicalCameraImage (the instances whose
// origins are in the frustum).
//
// ros_gz_interfaces/Contacts, or for a bumper gazebo_msgs/ContactsState: what touches the sensor's collisions, as of the
// present state, in the frame "world" of TF unless the description names another one; empty when nothing touches, so
// that the end of a touch is seen. Contacts are those of whole links: where one collision of several is named, contacts
// of the others count, too.
//
// The noise of sample n depends on the seed, the sensor and n only, not on subscribers; a bias random walk continues
// across set_sensors(). A sensor without subscribers is not measured.

#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "doppel/base/core/log.h"
#include "doppel/base/core/saved_part.h"
#include "doppel/base/math/geodesy.h"
#include "doppel/export.h"
#include "doppel/physics/contract/engine.h"
#include "doppel/ros/bus/bus.h"
#include "doppel/sensors/rigs/rig_sensor.h"

namespace doppel {

class DOPPEL_API PhysicalRig {
 public:
  // The log outlives the rig.
  PhysicalRig(Bus& bus, const Log& log, const RigOptions& options);
  ~PhysicalRig();
  PhysicalRig(const PhysicalRig&) = delete;
  PhysicalRig& operator=(const PhysicalRig&) = delete;

  // -- between steps
  void between_steps(Time now);
  // Sets the position of the world on Earth, for the sensors that set_sensors() makes afterwards.
  void set_earth(const EarthFrame& earth);
  // Replaces all sensors; those that stay, with their name, type and rate, keep their count of samples and
  // their start, and the messages that wait for a latency if all their values stay. Sensors of other kinds
  // are left out, and with an error those whose topic has another type elsewhere. release_others: called once
  // a topic has another type, to release those of sensors elsewhere that are renewed, too.
  void set_sensors(const std::vector<RigSensor>& sensors, const Engine& engine,
                   const std::function<void()>& release_others = {});
  // The engine has other instances: looks up those of the sensors again. A sensor whose instance comes back begins anew.
  void instances_changed(const Engine& engine);
  // Orientations relative to the start are relative to the present ones from now on.
  void reset(const Engine& engine);
  // The schedules and the messages that wait for a latency; of sensors with the same names.
  void save(SavedSlot& slot) const;
  void restore(const SavedPart& saved);
  [[nodiscard]] std::vector<RigStatus> status() const;
  // Writes the present rates and counts into the list that status() gave; does not allocate.
  void refresh(std::span<doppel_msgs::msg::Sensor> list) const;
  [[nodiscard]] bool empty() const;

  // -- in the loop: no allocation, no throw
  // Notes the state from which the step begins, if a sample is due at its end.
  void before_step(const Engine& engine);
  // Publishes the samples that are due. Returns the time of the next one.
  Time publish(const Engine& engine);
  [[nodiscard]] Time next() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace doppel
