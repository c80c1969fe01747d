#pragma once
// One camera, lidar or range sensor of a rig: its topics, and how a sample becomes their messages.

#include <array>
#include <bitset>
#include <limits>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "doppel/base/math/pose_motion.h"
#include "doppel/ros/bus/bus.h"
#include "doppel/sensors/models/counter_random.h"
#include "doppel/sensors/models/sample_schedule.h"
#include "doppel/sensors/render/ray_caster.h"
#include "doppel/sensors/rigs/detail/sensor_names.h"
#include "doppel/sensors/rigs/range_values.h"

namespace doppel {

// A topic of a sensor. Messages are encoded by the worker.
class Outlet {
 public:
  virtual ~Outlet() = default;
  [[nodiscard]] virtual bool wanted() const = 0;
  virtual void publish(const std::shared_ptr<const Bytes>& cdr, Time stamp) const = 0;
};

template <Message M>
class TopicOutlet : public Outlet {
 public:
  explicit TopicOutlet(Publisher<M> publisher) : publisher_(publisher) {}
  [[nodiscard]] bool wanted() const override { return publisher_.has_listeners(); }
  void publish(const std::shared_ptr<const Bytes>& cdr, Time stamp) const override {
    publisher_.publish_encoded(cdr, stamp);
  }

 private:
  Publisher<M> publisher_;
};

class ObjectLabels;

// A set of outputs of a sensor: without memory of its own, because the loop copies it.
inline constexpr std::size_t kMaxOutlets = 511;
using OutletSet = std::bitset<kMaxOutlets + 1>;  // and the range

// The data of a sample that the loop records.
struct LightSample {
  std::size_t sensor = 0;  // in the rig
  std::uint64_t number = 0;
  OutletSet wanted = {};  // outlets that are read, and the range
  PoseMotion link = {};   // of the sensor
  int body = -1;          // of the link, in the scene
  // Written by the worker: X_WB of all bodies, and what its scene's surfaces belong to.
  std::span<const Pose> bodies = {};
  const ObjectLabels* objects = nullptr;
};

struct LightMessage {
  std::size_t outlet = 0;
  std::shared_ptr<const Bytes> cdr;
  std::uint64_t hash = 0;  // of the bytes, by the worker
};

class LightSensor {
 public:
  LightSensor(const RigSensor& sensor, const RigOptions& options)
      : sensor_(sensor),
        random_(options.seed, sensor_key(sensor)),
        period_(SampleSchedule(sensor.description.rate, options.step).period()) {}
  virtual ~LightSensor() = default;
  LightSensor(const LightSensor&) = delete;
  LightSensor& operator=(const LightSensor&) = delete;

  // The worker's thread. `stamp`: of the headers.
  virtual void make(const RayCaster& caster, const LightSample& sample, Time stamp,
                    std::vector<LightMessage>& out) = 0;

  [[nodiscard]] const RigSensor& sensor() const { return sensor_; }
  [[nodiscard]] const std::vector<std::string>& topics() const { return topics_; }
  [[nodiscard]] OutletSet wanted() const {
    OutletSet out;
    for (std::size_t i = 0; i < outlets_.size(); ++i) out[i] = outlets_[i]->wanted();
    out[kRangeBit] = range_ && range_->readers > 0;
    return out;
  }
  [[nodiscard]] const Outlet& outlet(std::size_t index) const { return *outlets_[index]; }

  // -- between steps, while there are no jobs
  // The range that controllers read, of a range sensor.
  void report_to(std::shared_ptr<RangeValues::Value> range) { range_ = std::move(range); }
  // The first sample follows.
  virtual void restart() {
    if (range_) range_->range = std::numeric_limits<double>::quiet_NaN();
  }
  // Continues in place of a former sensor of the same name and type, from sample `next` on.
  virtual void resume(const LightSensor& /*before*/, std::uint64_t /*next*/) {}
  // The state that changes from sample to sample.
  struct Memory {
    std::uint64_t walk = 0;  // ChannelNoise::begin()
    double range = std::numeric_limits<double>::quiet_NaN();
  };
  [[nodiscard]] virtual Memory memory() const {
    Memory out;
    if (range_) out.range = range_->range;
    return out;
  }
  virtual void restore(const Memory& saved) {
    if (range_) range_->range = saved.range;
  }

 protected:
  static constexpr std::size_t kRangeBit = kMaxOutlets;  // in LightSample::wanted, above the outlets

  // The topic of an output; `own`: that of its kind. Returns the outlet's index. Throws InputError for more
  // than kMaxOutlets.
  template <Message M>
  std::size_t add_outlet(Node& node, const std::string& output, const std::string& own);
  void check_outlets() const;  // throws InputError if there is no room for another one
  [[nodiscard]] std::string frame() const { return sensor_.frame; }

  RigSensor sensor_;
  CounterRandom random_;
  double period_;  // s, of the samples
  std::vector<std::unique_ptr<Outlet>> outlets_;
  std::vector<std::string> topics_;
  std::shared_ptr<RangeValues::Value> range_;  // nullptr: of no range sensor
};

template <Message M>
std::size_t LightSensor::add_outlet(Node& node, const std::string& output, const std::string& own) {
  check_outlets();
  const std::string topic = sensor_topic(sensor_, output, own);
  Qos qos;
  qos.depth = 5;
  qos.best_effort = sensor_.description.best_effort;
  outlets_.push_back(std::make_unique<TopicOutlet<M>>(node.advertise<M>(topic, qos)));
  topics_.push_back(topic);
  return outlets_.size() - 1;
}

// nullptr: not a sensor of light.
std::unique_ptr<LightSensor> make_light_sensor(Node& node, const RigSensor& sensor,
                                               const RigOptions& options);
std::unique_ptr<LightSensor> make_camera_output(Node& node, const RigSensor& sensor,
                                                const RigOptions& options);
std::unique_ptr<LightSensor> make_lidar_output(Node& node, const RigSensor& sensor,
                                               const RigOptions& options);
std::unique_ptr<LightSensor> make_range_output(Node& node, const RigSensor& sensor,
                                               const RigOptions& options);

}  // namespace doppel
