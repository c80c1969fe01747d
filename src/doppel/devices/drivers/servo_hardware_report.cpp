// The driver's report for people: numbers of the cycle, which another thread reads.
#include <algorithm>
#include <array>
#include <cmath>

#include "doppel/devices/drivers/detail/release_watch.h"
#include "doppel/devices/drivers/servo_hardware.h"

namespace doppel {

void ServoHardware::publish_report() {
  const std::span<double> row = reported_->row();
  for (std::size_t i = 0; i < readings_.size(); ++i) {
    const ServoReading& one = readings_[i];
    const std::array<double, kReported> values{
        guards_[i].position(),
        guards_[i].sent_goal(),
        setup_.joints[i].direction * one.velocity / setup_.joints[i].scale,
        one.load,
        one.current,
        one.voltage,
        one.temperature,
        to_seconds(link_->now() - one.when),
        static_cast<double>(one.faults),
        release_->joint == i ? 1.0 : 0.0,
        to_seconds(release_->torque_off[i].time_since_epoch()),
        to_seconds(release_->torque_on[i].time_since_epoch())};
    std::ranges::copy(values, row.begin() + static_cast<std::ptrdiff_t>(i * kReported));
  }
  reported_->leave();
}

bool ServoHardware::report(DeviceReport& out) {
  const DriverState now = state();
  out.state = to_string(now);
  if (gentle_ && now == DriverState::active) out.state = "gentle";
  if (unconfirmed_) out.state = "unconfirmed";
  out.port = setup_.port;
  out.cycles = cycles_.load(std::memory_order_relaxed);
  out.lost = lost_answers_.load(std::memory_order_relaxed);
  out.damaged = damaged_.load(std::memory_order_relaxed);
  out.joints.resize(setup_.joints.size());
  const std::span<const double> row = reported_->newest();
  for (std::size_t i = 0; i < out.joints.size(); ++i) {
    const std::span<const double> values = row.subspan(i * kReported, kReported);
    DeviceReport::Joint& joint = out.joints[i];
    joint.name = setup_.joints[i].joint;
    joint.id = setup_.joints[i].id;
    joint.position = values[0];
    joint.goal = values[1];
    joint.velocity = values[2];
    joint.load = values[3];
    joint.current = values[4];
    joint.voltage = values[5];
    joint.temperature = values[6];
    joint.age = values[7];
    joint.believed = setup_.protocol == ServoProtocol::servo_line;
    joint.released = values[9] > 0;
    joint.torque_off = Time{from_seconds(values[10])};
    joint.torque_on = Time{from_seconds(values[11])};
    joint.faults.clear();
    const auto faults = std::isfinite(values[8]) ? static_cast<unsigned>(values[8]) : 0U;
    for (const ServoFault one :
         {kVoltageFault, kSensorFault, kTemperatureFault, kCurrentFault, kOverloadFault, kMotorFault}) {
      if ((faults & one) != 0)
        joint.faults += (joint.faults.empty() ? "" : ", ") + std::string(fault_word(one));
    }
  }
  return true;
}

}  // namespace doppel
