#pragma once
// One sensor of a PhysicalRig: its topic, and how the states around a step become its message.

#include <array>
#include <bit>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "doppel/bus/bus.h"
#include "doppel/core/log.h"
#include "doppel/messages/geometry_msgs.h"
#include "doppel/sensing/detail/instance_motion.h"
#include "doppel/sensing/detail/sensor_names.h"
#include "doppel/sensors/noise.h"

namespace doppel {

// What sensors are computed from, at the end of a step.
struct PhysicalState {
  const Engine& engine;
  Time now{}, stamp{};  // of the loop; of headers
  std::vector<std::optional<InstanceMotion>>&
      motions;                           // [instances]; those that were noted are differentiated
  const std::vector<Contact>& before;    // contacts of the state from which the step begins
  const std::vector<Contact>& contacts;  // of the present state
};

class PhysicalSensor {
 public:
  PhysicalSensor(const RigSensor& sensor, const RigOptions& options)
      : sensor_(sensor), random_(options.seed, sensor_key(sensor)) {}
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
  // Continues in place of a former sensor of the same name.
  virtual void resume(const PhysicalSensor& /*before*/) {}

  // -- in the loop: no allocation
  virtual void publish(const PhysicalState& state, std::uint64_t sample) = 0;

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

  void hash_vector(const geometry_msgs::msg::Vector3& v) {
    for (const double x : {v.x, v.y, v.z})
      hash_ = (hash_ ^ std::bit_cast<std::uint64_t>(x)) * 0x100000001B3ull;
  }

  RigSensor sensor_;
  std::uint64_t hash_ = 0xCBF29CE484222325ull;
  CounterRandom random_;
  std::string topic_, frame_;
  int instance_ = -1;
};

using VectorNoise = std::array<ChannelNoise, 3>;
// A vector with the noise of this sample on each of its components.
geometry_msgs::msg::Vector3 noisy_vector(VectorNoise& noise, const Eigen::Vector3d& value,
                                         std::uint64_t sample);

// nullptr: not a sensor of this kind. `period`: s between samples.
std::unique_ptr<PhysicalSensor> make_physical_sensor(Node& node, const RigSensor& sensor,
                                                     const RigOptions& options, double period,
                                                     const Log& log);
std::unique_ptr<PhysicalSensor> make_imu_output(Node& node, const RigSensor& sensor,
                                                const RigOptions& options, double period);
std::unique_ptr<PhysicalSensor> make_wrench_output(Node& node, const RigSensor& sensor,
                                                   const RigOptions& options, double period);
std::unique_ptr<PhysicalSensor> make_contact_output(Node& node, const RigSensor& sensor,
                                                    const RigOptions& options, const Log& log);

}  // namespace doppel
