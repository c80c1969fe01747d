#pragma once
// One sensor of a PhysicalRig: its topic, and how the states around a step become its message.

#include <array>
#include <bit>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "doppel/base/core/fnv_hash.h"
#include "doppel/base/core/log.h"
#include "doppel/base/core/saved_part.h"
#include "doppel/ros/bus/bus.h"
#include "doppel/ros/messages/geometry_msgs.h"
#include "doppel/sensors/rigs/detail/sensor_meter.h"
#include "doppel/sensors/rigs/detail/sensor_names.h"

namespace doppel {

class PhysicalSensor {
 public:
  explicit PhysicalSensor(const RigSensor& sensor) : sensor_(sensor) {}
  virtual ~PhysicalSensor() = default;
  PhysicalSensor(const PhysicalSensor&) = delete;
  PhysicalSensor& operator=(const PhysicalSensor&) = delete;

  [[nodiscard]] const RigSensor& sensor() const { return sensor_; }
  [[nodiscard]] const std::string& topic() const { return topic_; }
  [[nodiscard]] const std::string& frame() const { return frame_; }
  [[nodiscard]] int instance() const { return instance_; }
  [[nodiscard]] std::uint64_t hash() const { return hash_; }  // over the values published so far

  // -- what a sample needs
  [[nodiscard]] virtual bool wanted() const = 0;
  [[nodiscard]] virtual bool needs_contacts_before() const { return false; }
  [[nodiscard]] virtual bool needs_contacts() const { return false; }
  [[nodiscard]] virtual bool needs_all_motions() const { return false; }

  // -- between steps
  // `instance`: the sensor's index in the engine; -1: it is not there, and no sample is taken.
  virtual void bind(const Engine& /*engine*/, int instance) { instance_ = instance; }
  // The first sample follows; also after bind() of a new sensor.
  virtual void restart(const Engine& /*engine*/) {}
  // Continues in place of a former sensor of the same name, from sample `next` on.
  virtual void resume(const PhysicalSensor& /*before*/, std::uint64_t /*next*/) {}

  // The state that changes from sample to sample (saved_part.h).
  virtual void save(SavedSlot& slot) const = 0;
  virtual void restore(const SavedPart& saved) = 0;

  // -- in the loop: no allocation
  virtual void publish(const PhysicalState& state, std::uint64_t sample) = 0;
  // Publishes the samples whose latency is over.
  virtual void release(Time /*now*/) {}
  [[nodiscard]] virtual Time next_release() const { return Time::max(); }

 protected:
  template <Message M>
  Publisher<M> advertise(Node& node, const std::string& output) {
    const std::string& written = sensor_.description.topic;
    topic_ = sensor_topic(sensor_, output, written.empty() ? sensor_.description.name : written);
    Qos qos;
    qos.depth = 5;
    qos.best_effort = sensor_.description.best_effort;
    return node.advertise<M>(topic_, qos);
  }

  void hash_value(double x) { hash_ = fnv_mixed(hash_, std::bit_cast<std::uint64_t>(x)); }
  void hash_vector(const geometry_msgs::msg::Vector3& v) {
    for (const double x : {v.x, v.y, v.z}) hash_value(x);
  }

  RigSensor sensor_;
  std::uint64_t hash_ = kEmptyHash;
  std::string topic_, frame_;
  int instance_ = -1;
};

// nullptr: not a sensor of this kind.
std::unique_ptr<PhysicalSensor> make_physical_sensor(Node& node, const RigSensor& sensor,
                                                     const MeterSettings& settings, const Log& log);
std::unique_ptr<PhysicalSensor> make_meter_output(Node& node, const RigSensor& sensor,
                                                  const MeterSettings& settings);
std::unique_ptr<PhysicalSensor> make_contact_output(Node& node, const RigSensor& sensor, double period,
                                                    const Log& log);
std::unique_ptr<PhysicalSensor> make_logical_camera_output(Node& node, const RigSensor& sensor,
                                                           double period);

// From the spare ones, which keep their memory.
template <class T>
T taken(std::vector<T>& spare) {
  if (spare.empty()) return {};
  T out = std::move(spare.back());
  spare.pop_back();
  return out;
}

}  // namespace doppel
