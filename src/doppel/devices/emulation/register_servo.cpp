#include "doppel/devices/emulation/register_servo.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace doppel {
namespace {

constexpr double kAmbient = 25;           // degrees Celsius
constexpr double kHeatRise = 60;          // at the whole load, for ever
constexpr double kHeatTime = 240;         // s
constexpr double kSupplyDrop = 0.06;      // of the rated voltage, at the whole load
constexpr std::int64_t kSetMiddle = 128;  // Feetech's Torque_Enable
constexpr std::uint8_t kAlert = 0x80;     // of Dynamixel's error byte
constexpr std::int64_t kWatchdogFired = -1;
constexpr Duration kWatchdogUnit{20'000'000};
constexpr double kPercent = 0.01, kProtectionUnit = 0.01;  // s
constexpr double kDynamixelOverload = 0.9;                 // share of the stall torque
constexpr double kPushBand = 0.1;  // rad of error, with which a blocked motor pushes with all its torque
constexpr Duration kDynamixelOverloadTime{3'000'000'000};
constexpr int kVoltageBit = 0, kHotBit = 2, kOverloadBit = 5;  // of the errors, in both protocols

}  // namespace

RegisterServo::RegisterServo(const ServoModel& model, int id)
    : model_(&model), temperature_(kAmbient), supply_(model.rated_voltage) {
  std::size_t end = 0;
  for (const ServoRegister& one : model.registers) end = std::max<std::size_t>(end, one.address + one.size);
  table_.assign(end, 0);
  for (const ServoRegister& one : model.registers) put(one, one.initial);
  set("Model_Number", model.number);
  set(ServoRole::id, id);
  set(ServoRole::baud_rate, model.default_baud_index);
  set(ServoRole::goal_position, model.centre);
  actual_ = model.centre;
}

int RegisterServo::id() const {
  return static_cast<int>(value(ServoRole::id));
}

int RegisterServo::rate() const {
  return model_->rate_of(value(ServoRole::baud_rate)).value_or(0);
}

std::int64_t RegisterServo::raw(const ServoRegister& which) const {
  return decode_register(which, std::span(table_).subspan(which.address, which.size));
}

void RegisterServo::put(const ServoRegister& which, std::int64_t value) {
  encode_register(which, value, std::span(table_).subspan(which.address, which.size));
}

std::int64_t RegisterServo::value(ServoRole role) const {
  return raw(*model_->find(role));
}
std::int64_t RegisterServo::value(std::string_view name) const {
  return raw(*model_->find(name));
}
void RegisterServo::set(ServoRole role, std::int64_t value) {
  put(*model_->find(role), value);
}
void RegisterServo::set(std::string_view name, std::int64_t value) {
  put(*model_->find(name), value);
}

std::span<const std::uint8_t> RegisterServo::bytes(std::size_t address, std::size_t size) const {
  if (address + size > table_.size()) return {};
  return std::span(table_).subspan(address, size);
}

AccessError RegisterServo::check(const ServoRegister& which, std::int64_t value) const {
  const bool feetech = model_->protocol == ServoProtocol::feetech;
  if (!which.writable) return AccessError::access;
  if (which.eeprom) {
    const bool open =
        feetech ? this->value(ServoRole::lock) == 0 : this->value(ServoRole::torque_enable) == 0;
    if (!open) return AccessError::access;
  }
  if (feetech) return AccessError::none;
  if (latched_ && &which == model_->find(ServoRole::torque_enable) && value != 0) return AccessError::access;
  if (silenced_ && &which == model_->find(ServoRole::goal_position)) return AccessError::range;
  if (&which == model_->find(ServoRole::goal_position) &&
      (value < position_limit(ServoRole::min_position) || value > position_limit(ServoRole::max_position)))
    return AccessError::limit;
  return AccessError::none;
}

AccessError RegisterServo::write(std::size_t address, std::span<const std::uint8_t> bytes) {
  if (address + bytes.size() > table_.size()) return AccessError::range;
  AccessError out = AccessError::none;
  for (const ServoRegister& one : model_->registers) {
    const std::size_t end = one.address + one.size;
    if (one.address < address || end > address + bytes.size()) continue;
    const std::int64_t value = decode_register(one, bytes.subspan(one.address - address, one.size));
    const AccessError refused = check(one, value);
    if (refused != AccessError::none) {
      if (out == AccessError::none) out = refused;
      continue;
    }
    put(one, value);
    written(one);
  }
  return out;
}

void RegisterServo::keep_write(std::size_t address, std::span<const std::uint8_t> bytes) {
  kept_address_ = address;
  kept_write_.assign(bytes.begin(), bytes.end());
  show_kept_write();
}

AccessError RegisterServo::do_kept_write() {
  const std::vector<std::uint8_t> kept = std::exchange(kept_write_, {});
  show_kept_write();
  return kept.empty() ? AccessError::none : write(kept_address_, kept);
}

void RegisterServo::show_kept_write() {
  constexpr std::string_view kRegister = "Registered_Instruction";  // Dynamixel's alone
  if (model_->find(kRegister) != nullptr) set(kRegister, kept_write_.empty() ? 0 : 1);
}

void RegisterServo::written(const ServoRegister& which) {
  const ServoRegister* const torque = model_->find(ServoRole::torque_enable);
  const ServoRegister* const watchdog = model_->find(ServoRole::watchdog);
  if (&which == watchdog) silenced_ = false;
  if (&which != torque) return;
  if (model_->protocol == ServoProtocol::feetech && raw(which) == kSetMiddle) {
    set(ServoRole::homing_offset, actual_ - model_->centre);
    set(ServoRole::present_position, model_->centre);
    put(which, 0);
    return;
  }
  // Dynamixel begins where it is.
  if (model_->protocol == ServoProtocol::dynamixel && raw(which) != 0)
    set(ServoRole::goal_position, value(ServoRole::present_position));
}

void RegisterServo::restart() {
  for (const ServoRegister& one : model_->registers) {
    if (!one.eeprom) put(one, one.initial);
  }
  set(ServoRole::goal_position, actual_ - value(ServoRole::homing_offset));
  latched_ = silenced_ = false;
  overloaded_ = Duration{};
  kept_write_.clear();
}

std::uint8_t RegisterServo::error_byte(AccessError access) const {
  const auto errors = static_cast<std::uint8_t>(value(ServoRole::errors));
  if (model_->protocol == ServoProtocol::feetech) return errors;
  return static_cast<std::uint8_t>(static_cast<std::uint8_t>(access) | (errors != 0 ? kAlert : 0));
}

Duration RegisterServo::return_delay() const {
  return Duration(2000 * value(ServoRole::return_delay));  // units of 2 us, in both protocols
}

bool RegisterServo::answers_writes() const {
  if (model_->protocol == ServoProtocol::feetech) return value("Response_Status_Level") != 0;
  return value("Status_Return_Level") == 2;
}

std::int64_t RegisterServo::position_limit(ServoRole role) const {
  const std::int64_t low = value(ServoRole::min_position), high = value(ServoRole::max_position);
  // Equal limits mean none: a servo of several turns.
  if (low >= high) return role == ServoRole::min_position ? 0 : model_->ticks_per_turn - 1;
  return role == ServoRole::min_position ? low : high;
}

// -- the motor

void RegisterServo::guard_load(double load, Duration period, bool overload) {
  const bool feetech = model_->protocol == ServoProtocol::feetech;
  const double threshold =
      feetech ? kPercent * static_cast<double>(value("Overload_Torque")) : kDynamixelOverload;
  const Duration patience =
      feetech ? from_seconds(kProtectionUnit * static_cast<double>(value("Protection_Time")))
              : kDynamixelOverloadTime;
  overloaded_ = std::abs(load) >= threshold ? overloaded_ + period : Duration{};
  if (overload || overloaded_ > patience) latched_ = true;
  set_error(kOverloadBit, latched_);
  if (latched_) set(ServoRole::torque_enable, 0);
}

void RegisterServo::set_error(int bit, bool on) {
  const std::int64_t mask = std::int64_t{1} << bit, errors = value(ServoRole::errors) & ~mask;
  set(ServoRole::errors, on ? errors | mask : errors);
}

void RegisterServo::guard_silence(Time now) {
  const ServoRegister* const watchdog = model_->find(ServoRole::watchdog);
  if (watchdog == nullptr || silenced_) return;
  const std::int64_t units = raw(*watchdog);
  if (units <= 0 || now - host_seen_ <= units * kWatchdogUnit) return;
  silenced_ = true;
  held_ = value(ServoRole::present_position);
  put(*watchdog, kWatchdogFired);
}

void RegisterServo::report(const MotorState& state, double load, Duration period,
                           std::optional<double> temperature) {
  const double rate = to_seconds(period) / kHeatTime;
  temperature_ += rate * (kAmbient + kHeatRise * load * load - temperature_);
  const double shown = temperature.value_or(temperature_);
  const ServoRegister& position = *model_->find(ServoRole::present_position);
  put(position, actual_ - value(ServoRole::homing_offset));
  set(ServoRole::present_velocity, std::llround(state.velocity / model_->velocity_unit));
  if (model_->find(ServoRole::present_load) != nullptr)
    set(ServoRole::present_load, std::llround(load / model_->load_unit));
  if (model_->find(ServoRole::present_current) != nullptr && model_->current_unit > 0)
    set(ServoRole::present_current, std::llround(load * model_->stall_current / model_->current_unit));
  const double voltage = supply_ * (1 - kSupplyDrop * std::abs(load));
  set(ServoRole::present_voltage, std::llround(voltage / model_->voltage_unit));
  set(ServoRole::present_temperature, std::llround(shown));
  constexpr std::int64_t kStill = 5;
  set(ServoRole::moving, std::abs(value(ServoRole::present_velocity)) > kStill ? 1 : 0);
  const auto limit = [&](std::string_view name) { return static_cast<double>(value(name)); };
  const bool feetech = model_->protocol == ServoProtocol::feetech;
  set_error(kHotBit, shown >= limit(feetech ? "Max_Temperature_Limit" : "Temperature_Limit"));
  const double units = voltage / model_->voltage_unit;
  set_error(kVoltageBit, units > limit("Max_Voltage_Limit") || units < limit("Min_Voltage_Limit"));
}

void RegisterServo::step(Time now, Duration period, const MotorState& state, const Disturbance& disturbance,
                         MotorDrive& drive) {
  const double sign = disturbance.flipped ? -1 : 1;
  const MotorState measured{sign * (state.position + disturbance.slip), sign * state.velocity,
                            sign * state.effort};
  if (!disturbance.stuck) blocked_.reset();
  if (disturbance.stuck && !blocked_) blocked_ = state.position;
  const double share = std::clamp(
      static_cast<double>(value(ServoRole::torque_limit)) / static_cast<double>(model_->whole_torque), 0.0,
      1.0);
  // The block carries what the motor pushes, which the physics does not see.
  const double pushed = std::clamp((goal_shaft_ - measured.position) / kPushBand, -share, share);
  const bool on = value(ServoRole::torque_enable) != 0;
  const double load =
      blocked_ ? (on ? pushed : 0.0) : std::clamp(measured.effort / model_->stall_torque, -1.0, 1.0);
  actual_ = std::llround(model_->ticks(measured.position));
  report(measured, load, period, disturbance.temperature);
  guard_load(load, period, disturbance.overload);
  guard_silence(now);

  const std::int64_t goal = silenced_ ? held_ : value(ServoRole::goal_position);
  const std::int64_t kept =
      std::clamp(goal, position_limit(ServoRole::min_position), position_limit(ServoRole::max_position));
  goal_shaft_ = model_->angle(kept + value(ServoRole::homing_offset));
  const double speed = static_cast<double>(value(ServoRole::goal_velocity)) * model_->velocity_unit;
  drive.on = blocked_ || value(ServoRole::torque_enable) != 0;
  drive.goal = blocked_ ? *blocked_ : sign * goal_shaft_ - disturbance.slip;
  drive.velocity = speed > 0 ? std::min(speed, model_->no_load_speed) : model_->no_load_speed;
  drive.effort = model_->stall_torque * (blocked_ ? 1.0 : share);
  const ServoRegister& gain = *model_->find(ServoRole::position_gain);
  drive.gain = blocked_ ? 1.0 : static_cast<double>(raw(gain)) / static_cast<double>(gain.initial);
}

}  // namespace doppel
