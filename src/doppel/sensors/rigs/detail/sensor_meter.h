#pragma once
// The values of one physical sensor, as numbers: the same for its topic and for controllers.

#include <algorithm>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "doppel/base/math/geodesy.h"
#include "doppel/physics/contract/engine.h"
#include "doppel/sensors/models/noise.h"
#include "doppel/sensors/rigs/detail/instance_motion.h"
#include "doppel/sensors/rigs/rig_sensor.h"

namespace doppel {

// The state from which sensors are computed, at the end of a step.
struct PhysicalState {
  const Engine& engine;
  Time now{}, stamp{};  // of the loop; of headers
  std::vector<std::optional<InstanceMotion>>&
      motions;                           // [instances]; those that were noted are differentiated
  const std::vector<Contact>& before;    // contacts of the state from which the step begins
  const std::vector<Contact>& contacts;  // of the present state
};

// Construction parameters of a SensorMeter, besides its sensor.
struct MeterSettings {
  CounterRandom random;
  double period = 0;  // s between samples
  EarthFrame earth;
};

class SensorMeter {
 public:
  // `count`: number of values.
  SensorMeter(const RigSensor& sensor, std::size_t count)
      : sensor_(sensor), frame_(sensor.frame), values_(count, 0.0) {}
  virtual ~SensorMeter() = default;
  SensorMeter(const SensorMeter&) = delete;
  SensorMeter& operator=(const SensorMeter&) = delete;

  [[nodiscard]] const std::string& frame() const { return frame_; }  // of the values' axes; after bind()
  [[nodiscard]] int instance() const { return instance_; }
  // Of the last sample, in the order of reading_names().
  [[nodiscard]] std::span<const double> values() const { return values_; }

  // -- what a sample needs
  [[nodiscard]] virtual bool needs_contacts_before() const { return false; }
  [[nodiscard]] virtual bool needs_all_motions() const { return false; }

  // -- between steps
  virtual void bind(const Engine& /*engine*/, int instance) { instance_ = instance; }
  virtual void restart(const Engine& /*engine*/) {
    for (ChannelNoise& channel : noise_) channel.restart();
  }
  // Continues in place of one of the same type of sensor, from sample `next` on.
  virtual void resume(const SensorMeter& before, std::uint64_t next) {
    for (std::size_t i = 0; i < std::min(noise_.size(), before.noise_.size()); ++i)
      noise_[i].resume(before.noise_[i], next);
  }

  // The state that changes from sample to sample, for a saved state.
  struct Memory {
    std::vector<std::uint64_t> walks;                        // [channels] ChannelNoise::begin()
    Eigen::Matrix3d R_WStart = Eigen::Matrix3d::Identity();  // of an IMU
    double reference = 0;                                    // m, of an altimeter
    std::vector<double> values;
  };
  virtual void save(Memory& out) const {
    out.walks.clear();
    for (const ChannelNoise& channel : noise_) out.walks.push_back(channel.begin());
    out.values = values_;
  }
  virtual void restore(const Memory& saved) {
    for (std::size_t i = 0; i < std::min(noise_.size(), saved.walks.size()); ++i)
      noise_[i].set_begin(saved.walks[i]);
    if (saved.values.size() == values_.size()) values_ = saved.values;
  }

  // -- in the loop: no allocation
  virtual void measure(const PhysicalState& state, std::uint64_t sample) = 0;

 protected:
  void write(std::size_t first, const Eigen::Vector3d& v) {
    for (std::size_t i = 0; i < 3; ++i) values_[first + i] = v[static_cast<Eigen::Index>(i)];
  }
  void write_rotation(std::size_t first, const Eigen::Matrix3d& R) {
    const Eigen::Quaterniond q(R);
    const double parts[] = {q.x(), q.y(), q.z(), q.w()};
    for (std::size_t i = 0; i < 4; ++i) values_[first + i] = parts[i];
  }

  // Of the next channel.
  void add_noise(const NoiseDescription& noise, const MeterSettings& settings) {
    const auto channel = static_cast<std::uint32_t>(noise_.size());
    noise_.emplace_back(noise, settings.random, channel, settings.period);
  }
  // With the noise of this sample of a channel, or of three channels from `first` on.
  [[nodiscard]] double noisy(std::size_t channel, double value, std::uint64_t sample) {
    return noise_[channel].apply(value, sample);
  }
  [[nodiscard]] Eigen::Vector3d noisy_vector(std::size_t first, const Eigen::Vector3d& value,
                                             std::uint64_t sample) {
    return {noisy(first, value.x(), sample), noisy(first + 1, value.y(), sample),
            noisy(first + 2, value.z(), sample)};
  }

  const RigSensor sensor_;
  std::string frame_;
  int instance_ = -1;
  std::vector<double> values_;

 private:
  std::vector<ChannelNoise> noise_;  // [channels]
};

inline double variance_of(const NoiseDescription& noise) {
  return noise.stddev * noise.stddev;
}

// nullptr: not a sensor whose values are numbers.
std::unique_ptr<SensorMeter> make_meter(const RigSensor& sensor, const MeterSettings& settings);
std::unique_ptr<SensorMeter> make_imu_meter(const RigSensor& sensor, const MeterSettings& settings);
std::unique_ptr<SensorMeter> make_wrench_meter(const RigSensor& sensor, const MeterSettings& settings);
// nullptr: a logical camera.
std::unique_ptr<SensorMeter> make_environment_meter(const RigSensor& sensor, const MeterSettings& settings);

}  // namespace doppel
