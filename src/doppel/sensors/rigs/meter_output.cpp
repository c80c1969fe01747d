// Messages from the values of meters.
#include <algorithm>

#include "doppel/ros/messages/ros_gz_interfaces.h"
#include "doppel/ros/messages/sensor_msgs.h"
#include "doppel/sensors/rigs/detail/delay_line.h"
#include "doppel/sensors/rigs/detail/physical_sensor.h"

namespace doppel {
namespace {

using geometry_msgs::msg::WrenchStamped;
using ros_gz_interfaces::msg::Altimeter;
using sensor_msgs::msg::FluidPressure;
using sensor_msgs::msg::Imu;
using sensor_msgs::msg::MagneticField;
using sensor_msgs::msg::NavSatFix;
using Values = std::span<const double>;

// A message's other fields, which do not change.
Imu blank_imu(const ImuDescription& imu) {
  Imu out;
  for (std::size_t i = 0; i < 3; ++i) {
    out.linear_acceleration_covariance[4 * i] = variance_of(imu.linear_acceleration[i]);
    out.angular_velocity_covariance[4 * i] = variance_of(imu.angular_velocity[i]);
    out.orientation_covariance[4 * i] = variance_of(imu.orientation);
  }
  // REP 145: there is no orientation.
  if (!imu.orientation_enabled) out.orientation_covariance = {-1};
  return out;
}

MagneticField blank_field(const EnvironmentDescription& field) {
  MagneticField out;
  for (std::size_t i = 0; i < 3; ++i) out.magnetic_field_covariance[4 * i] = variance_of(field.noise[i]);
  return out;
}

NavSatFix blank_fix(const EnvironmentDescription& satellites) {
  NavSatFix out;
  const bool known = satellites.noise[0].stddev > 0 || satellites.noise[1].stddev > 0;
  out.position_covariance_type =
      known ? NavSatFix::COVARIANCE_TYPE_DIAGONAL_KNOWN : NavSatFix::COVARIANCE_TYPE_UNKNOWN;
  return out;
}

void fill(Values from, Imu& out) {
  out.orientation = {from[0], from[1], from[2], from[3]};
  out.angular_velocity = {from[4], from[5], from[6]};
  out.linear_acceleration = {from[7], from[8], from[9]};
}
void fill(Values from, WrenchStamped& out) {
  out.wrench.force = {from[0], from[1], from[2]};
  out.wrench.torque = {from[3], from[4], from[5]};
}
void fill(Values from, NavSatFix& out) {
  out.status.status = static_cast<std::int8_t>(from[0]);
  out.status.service = static_cast<std::uint16_t>(from[1]);
  out.latitude = from[2];
  out.longitude = from[3];
  out.altitude = from[4];
  for (std::size_t i = 0; i < 3; ++i) out.position_covariance[4 * i] = from[5 + i];
}
void fill(Values from, MagneticField& out) {
  out.magnetic_field = {from[0], from[1], from[2]};
}
void fill(Values from, Altimeter& out) {
  out.vertical_position = from[0];
  out.vertical_velocity = from[1];
  out.vertical_reference = from[2];
}
void fill(Values from, FluidPressure& out) {
  out.fluid_pressure = from[0];
  out.variance = from[1];
}

template <Message M>
class MeterOutput : public PhysicalSensor {
 public:
  MeterOutput(Node& node, const RigSensor& sensor, std::unique_ptr<SensorMeter> meter, double period,
              const char* output, M blank = {})
      : PhysicalSensor(sensor),
        meter_(std::move(meter)),
        message_(std::move(blank)),
        delayed_(sensor.description.latency, period, {{}, std::vector(meter_->values().size(), 0.0)}) {
    publisher_ = advertise<M>(node, output);
    set_frame();
  }

  [[nodiscard]] bool wanted() const override { return publisher_.has_listeners(); }
  [[nodiscard]] bool needs_contacts_before() const override { return meter_->needs_contacts_before(); }
  [[nodiscard]] bool needs_all_motions() const override { return meter_->needs_all_motions(); }

  void bind(const Engine& engine, int instance) override {
    PhysicalSensor::bind(engine, instance);
    meter_->bind(engine, instance);
    set_frame();
  }
  void restart(const Engine& engine) override {
    meter_->restart(engine);
    delayed_.clear();
  }
  void resume(const PhysicalSensor& before, std::uint64_t next) override {
    const auto* former = dynamic_cast<const MeterOutput*>(&before);
    if (former == nullptr) return;
    meter_->resume(*former->meter_, next);
    if (same_values(sensor_, former->sensor_)) delayed_.resume(former->delayed_);
  }

  void save(SavedSlot& slot) const override {
    Saved& out = value_in<Saved>(slot);
    out.hash = hash_;
    meter_->save(out.meter);
    out.delayed = delayed_;
  }
  void restore(const SavedPart& saved) override {
    const Saved* const before = value_of<Saved>(&saved);
    if (before == nullptr) return;
    hash_ = before->hash;
    meter_->restore(before->meter);
    delayed_ = before->delayed;
  }

  void publish(const PhysicalState& state, std::uint64_t sample) override {
    meter_->measure(state, sample);
    for (const double value : meter_->values()) hash_value(value);
    if (!delayed_.delays()) return send(meter_->values(), to_time_msg(state.stamp), state.now);
    Sample& next = delayed_.add(state.now);
    std::ranges::copy(meter_->values(), next.values.begin());
    next.stamp = to_time_msg(state.stamp);
  }

  void release(Time now) override {
    delayed_.release(now, [&](const Sample& sample) { send(sample.values, sample.stamp, now); });
  }
  [[nodiscard]] Time next_release() const override { return delayed_.next_release(); }

 private:
  struct Sample {
    builtin_interfaces::msg::Time stamp;
    std::vector<double> values;
  };

  struct Saved {
    std::uint64_t hash = 0;
    SensorMeter::Memory meter;
    DelayLine<Sample> delayed;
  };

  void set_frame() {
    frame_ = meter_->frame();
    message_.header.frame_id = frame_;
  }
  void send(Values values, const builtin_interfaces::msg::Time& stamp, Time now) {
    message_.header.stamp = stamp;
    fill(values, message_);
    publisher_.publish(message_, now);
  }

  const std::unique_ptr<SensorMeter> meter_;
  M message_;
  Publisher<M> publisher_;
  DelayLine<Sample> delayed_;
};

}  // namespace

std::unique_ptr<PhysicalSensor> make_meter_output(Node& node, const RigSensor& sensor,
                                                  const MeterSettings& settings) {
  const auto& what = sensor.description.what;
  std::unique_ptr<SensorMeter> meter = make_meter(sensor, settings);
  if (!meter) return nullptr;
  const auto output = [&]<class M>(const char* name, M blank) -> std::unique_ptr<PhysicalSensor> {
    return std::make_unique<MeterOutput<M>>(node, sensor, std::move(meter), settings.period, name,
                                            std::move(blank));
  };
  if (const auto* imu = std::get_if<ImuDescription>(&what)) return output("imu", blank_imu(*imu));
  if (std::holds_alternative<ForceTorqueDescription>(what)) return output("wrench", WrenchStamped{});
  const auto& environment = std::get<EnvironmentDescription>(what);
  switch (environment.kind) {
    case EnvironmentKind::navsat:
      return output("fix", blank_fix(environment));
    case EnvironmentKind::magnetometer:
      return output("magnetic", blank_field(environment));
    case EnvironmentKind::altimeter:
      return output("altimeter", Altimeter{});
    case EnvironmentKind::air_pressure:
      return output("air_pressure", FluidPressure{});
    case EnvironmentKind::logical_camera:
    case EnvironmentKind::pose:
      break;
  }
  return nullptr;
}

}  // namespace doppel
