#include "doppel/devices/commissioning/bus_check.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "doppel/base/core/output_file.h"
#include "doppel/base/yaml/placed_yaml.h"
#include "doppel/base/yaml/yaml_text.h"

namespace doppel {
namespace {

constexpr std::int64_t kPhaseBit = 16;  // Feetech's Phase, bit 4: the servo counts beyond one turn
constexpr double kSupplySlack = 0.3;    // V
constexpr double kWarm = 60;            // degrees Celsius
const YamlRules kRules{"hardware.backup_syntax", "hardware.backup_unreadable", "hardware.backup_too_large",
                       "hardware.backup", "hardware.backup"};

class Checker {
 public:
  Checker(ServoBus& bus, const ServoSetup& setup) : bus_(bus), setup_(setup) {}

  BusCheck run() {
    for (const JointServo& servo : setup_.joints) check(servo);
    find_others();
    return std::move(out_);
  }

 private:
  void add(Severity severity, const std::string& rule, const JointServo& servo, const std::string& message,
           const std::string& fix = "") {
    out_.findings.push_back({severity, "hardware." + rule,
                             fmt::format("'{}' (id {}): {}", servo.joint, servo.id, message), servo.source,
                             fix});
  }

  // A register that is not read is not judged: the servo does not pass without it.
  std::optional<std::int64_t> read(const JointServo& servo, const ServoRegister& which) {
    const auto out = bus_.read(servo.id, which);
    if (!out && std::exchange(silent_, &servo) != &servo)
      add(Severity::error, "no_answer", servo,
          fmt::format("answers, but not a read of {}, and is not judged as a whole", which.name),
          "its cable and supply, then this check again");
    return out;
  }

  void want(const JointServo& servo, const ServoRegister* which, std::int64_t value, const std::string& why) {
    if (which == nullptr) return;
    const auto present = read(servo, *which);
    if (!present || *present == value) return;
    out_.changes.push_back({servo.joint, servo.id, which, *present, value, why});
  }

  void check(const JointServo& servo) {
    const auto answer = bus_.ping(servo.id, 3);
    if (!answer)
      return add(Severity::error, "no_answer", servo, fmt::format("does not answer at {} bit/s", setup_.rate),
                 "its cable and supply; doppel hardware scan finds other rates and ids");
    if (answer->number != servo.model->number) {
      const ServoModel* const other = find_servo_model(setup_.protocol, answer->number);
      return add(
          Severity::error, "other_model", servo,
          fmt::format("is {} and not {}",
                      other != nullptr ? std::string(other->name) : fmt::format("model {}", answer->number),
                      servo.model->name),
          "write its model into hardware.yaml");
    }
    check_registers(servo);
    check_health(servo);
    if (!servo.calibrated)
      add(Severity::warning, "uncalibrated", servo, "its direction and zero are assumed",
          "doppel hardware nudge, then doppel calibrate --live");
  }

  void check_registers(const JointServo& servo) {
    const ServoModel& model = *servo.model;
    want(servo, model.find(ServoRole::return_delay), 0, "each answer waits for it");
    want(servo, model.find(ServoRole::operating_mode), model.position_mode, "the driver commands positions");
    if (const ServoRegister* const phase = model.find("Phase")) {
      const auto value = read(servo, *phase);
      if (value && (*value & kPhaseBit) != 0)
        out_.changes.push_back({servo.joint, servo.id, phase, *value, *value & ~kPhaseBit,
                                "with bit 4 positions are not those of one turn"});
    }
    check_limits(servo);
  }

  // The servo's own limits are the last ones that hold when everything else fails.
  void check_limits(const JointServo& servo) {
    const ServoModel& model = *servo.model;
    if (servo.recorded) {
      want(servo, model.find(ServoRole::homing_offset), servo.recorded->homing_offset, "of its calibration");
      want(servo, model.find(ServoRole::min_position), servo.recorded->range_min, "of its calibration");
      return want(servo, model.find(ServoRole::max_position), servo.recorded->range_max,
                  "of its calibration");
    }
    const double a = model.ticks(servo.shaft(servo.lower)), b = model.ticks(servo.shaft(servo.upper));
    const double low = std::min(a, b), high = std::max(a, b),
                 last = static_cast<double>(model.ticks_per_turn - 1);
    if (low < 0 || high > last)
      return add(Severity::error, "beyond_turn", servo,
                 fmt::format("its limits are the ticks {:.0f} to {:.0f}, and the servo has 0 to {:.0f}", low,
                             high, last),
                 "check its zero (offset), or narrow the joint's <limit>");
    if (!servo.calibrated) return;
    want(servo, model.find(ServoRole::min_position), std::llround(std::floor(low)),
         "the joint's lower limit");
    want(servo, model.find(ServoRole::max_position), std::llround(std::ceil(high)),
         "the joint's upper limit");
  }

  void check_health(const JointServo& servo) {
    const ServoModel& model = *servo.model;
    const auto value = [&](ServoRole role) { return read(servo, *model.find(role)); };
    if (const auto volts = value(ServoRole::present_voltage)) {
      const double supply = static_cast<double>(*volts) * model.voltage_unit;
      if (supply < model.min_voltage - kSupplySlack || supply > model.max_voltage + kSupplySlack)
        add(Severity::error, "supply", servo,
            fmt::format("has a supply of {:.1f} V, and is made for {:.1f} to {:.1f} V", supply,
                        model.min_voltage, model.max_voltage),
            "another supply, or another servo");
    }
    const auto degrees = value(ServoRole::present_temperature);
    if (degrees && static_cast<double>(*degrees) >= kWarm)
      add(Severity::warning, "warm", servo, fmt::format("is at {} degrees Celsius", *degrees), "let it cool");
    const auto errors = value(ServoRole::errors);
    const unsigned faults = errors ? model.faults(*errors) : 0;
    for (const ServoFault one : {kSensorFault, kCurrentFault, kOverloadFault, kMotorFault}) {
      if ((faults & one) == 0) continue;
      add(Severity::error, "servo_fault", servo, fmt::format("reports a fault: {}", fault_word(one)),
          setup_.protocol == ServoProtocol::dynamixel ? "free the joint, then doppel hardware reboot"
                                                      : "free the joint, then switch its power off and on");
    }
  }

  // Servos that no joint has.
  void find_others() {
    if (setup_.protocol != ServoProtocol::dynamixel) return;  // a broadcast to Feetech's takes seconds
    for (const PingAnswer& answer : bus_.ping_all()) {
      if (std::ranges::find(setup_.joints, answer.id, &JointServo::id) != setup_.joints.end()) continue;
      out_.findings.push_back(
          {Severity::note,
           "hardware.stranger",
           fmt::format("a servo with id {} is on the bus, and no joint has it", answer.id),
           {},
           ""});
    }
  }

  ServoBus& bus_;
  const ServoSetup& setup_;
  BusCheck out_;
  const JointServo* silent_ = nullptr;  // the last one that has not answered a read
};

void refuse(const RegisterChange& change, const std::string& what, const std::string& fix) {
  throw InputError("hardware.not_written", {},
                   fmt::format("{} of '{}' (id {}) {}", change.which->name, change.joint, change.id, what),
                   fix);
}

}  // namespace

bool BusCheck::passed() const {
  return changes.empty() && std::ranges::none_of(findings, [](const Diagnostic& one) {
           return one.severity == Severity::error;
         });
}

BusCheck check_bus(ServoBus& bus, const ServoSetup& setup) {
  return Checker(bus, setup).run();
}

void apply_changes(ServoBus& bus, const ServoSetup& setup, const std::vector<RegisterChange>& changes,
                   const std::filesystem::path& backup) {
  const auto model_of = [&](int id) { return std::ranges::find(setup.joints, id, &JointServo::id)->model; };
  for (const RegisterChange& one : changes) {
    const auto torque = bus.read(one.id, *model_of(one.id)->find(ServoRole::torque_enable));
    if (!torque) refuse(one, "cannot be written: the servo does not answer", "its cable and supply");
    if (*torque != 0)
      refuse(one, "cannot be written while its torque is on", "support the arm, then doppel hardware relax");
  }
  std::string text =
      "# Registers before doppel hardware check --fix; back with: doppel hardware restore TARGET THIS_FILE\n";
  for (const RegisterChange& one : changes)
    text += fmt::format("- {{id: {}, register: {}, value: {}, joint: {}}}\n", one.id, one.which->name,
                        one.before, yaml_text(one.joint));
  write_whole(backup, text);
  for (const RegisterChange& one : changes) {
    const ServoRegister* const lock = model_of(one.id)->find(ServoRole::lock);
    if (lock != nullptr && !bus.write(one.id, *lock, 0))
      refuse(one, "was not written: the servo does not answer", "");
    const bool written = bus.write(one.id, *one.which, one.after);
    if (lock != nullptr) static_cast<void>(bus.write(one.id, *lock, 1));
    if (!written || bus.read(one.id, *one.which) != one.after)
      refuse(one, "was not taken by the servo", fmt::format("the former values are in {}", backup.string()));
  }
}

std::vector<RegisterChange> changes_back(ServoBus& bus, const ServoSetup& setup,
                                         const std::filesystem::path& backup) {
  const PlacedYaml root = load_yaml(backup, kRules, "backup of registers");
  std::vector<RegisterChange> out;
  Diagnostics errors;
  const JointServo* silent = nullptr;  // the last one that has not answered
  for (const PlacedYaml& one : root.items) {
    const int id = std::atoi(one["id"].text.c_str());
    const auto servo = std::ranges::find(setup.joints, id, &JointServo::id);
    const ServoRegister* const which =
        servo == setup.joints.end() ? nullptr : servo->model->find(std::string_view(one["register"].text));
    if (which == nullptr || !which->writable) {
      errors.error(
          "hardware.backup", one.where,
          fmt::format("there is no servo {} with a register '{}'", one["id"].text, one["register"].text),
          "use the file that doppel hardware check --fix wrote for this robot");
      continue;
    }
    const auto present = bus.read(id, *which);
    if (!present && std::exchange(silent, &*servo) != &*servo)
      errors.error("hardware.no_answer", one.where,
                   fmt::format("'{}' (id {}) does not answer a read of {}", servo->joint, id, which->name),
                   "its cable and supply, then this restore again");
    const std::int64_t value = std::atoll(one["value"].text.c_str());
    if (present && *present != value) out.push_back({servo->joint, id, which, *present, value, "as before"});
  }
  errors.throw_if_errors();
  return out;
}

}  // namespace doppel
