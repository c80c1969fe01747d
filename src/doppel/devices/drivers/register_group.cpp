// Servos with registers: Feetech's and Dynamixel's.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "doppel/devices/drivers/detail/servo_group.h"

namespace doppel {
namespace {

constexpr double kGoalTolerance = 0.02;  // rad, between a servo's goal and where it is
constexpr double kWatchdogUnit = 0.02;   // s, of Dynamixel's bus watchdog
constexpr int kHealthEvery = 10;         // cycles
constexpr double kVoltageSlack = 0.5;    // V
constexpr Duration kStartTimeout{
    50'000'000};                              // a host on a busy machine is late by some tens of milliseconds
constexpr Duration kCycleTimeout{5'000'000};  // USB adapters take up to some milliseconds

class RegisterGroup final : public ServoGroup {
 public:
  RegisterGroup(const ServoSetup& setup, ByteLink& link)
      : setup_(setup), bus_(link, setup.protocol, setup.rate) {
    for (const JointServo& one : setup_.joints) servos_.push_back({one.id, one.model});
  }

  Status connect() override {
    const StartTimeout timeout(bus_);
    bus_.notice_echo();
    std::vector<std::string> problems;
    for (const JointServo& one : setup_.joints) identify(one, problems);
    if (!problems.empty()) return Status::refused(fmt::format("{}", fmt::join(problems, "; ")));
    bus_.begin_cycle(servos_, setup_.fast_reads);
    return {};
  }

  Status start(double torque) override {
    const StartTimeout timeout(bus_);
    for (const JointServo& one : setup_.joints) {
      if (!one.enabled) continue;
      if (Status ready = place_goal(one, torque); !ready) return ready;
    }
    for (const JointServo& one : setup_.joints) {
      if (one.enabled && !write(one, ServoRole::torque_enable, 1)) {
        // No servo keeps its torque for long because another one is silent.
        bus_.set_patience(kCycleTimeout);
        static_cast<void>(relax());
        return Status::refused(silent(one, "does not confirm its torque"));
      }
      if (one.enabled && one.model->find(ServoRole::watchdog) != nullptr)
        static_cast<void>(write(one, ServoRole::watchdog, std::lround(setup_.watchdog / kWatchdogUnit)));
    }
    return {};
  }

  // A servo that does not say so counts as holding: less torque than it has would let its joint fall, and the
  // whole torque moves no joint, because its goal is where it stands.
  bool has_torque() override {
    const StartTimeout timeout(bus_);
    return std::ranges::any_of(setup_.joints, [&](const JointServo& one) {
      return one.enabled && bus_.read(one.id, *one.model->find(ServoRole::torque_enable)).value_or(1) != 0;
    });
  }
  Status relax() override {
    Status out;
    for (const JointServo& one : setup_.joints) {
      if (!write(one, ServoRole::torque_enable, 0))
        out = Status::refused(silent(one, "does not confirm that its torque is off"));
    }
    return out;
  }

  Status release(std::size_t joint) override {
    const JointServo& one = setup_.joints[joint];
    // A watchdog that trips while no goals come would refuse that of the catch.
    if (one.model->find(ServoRole::watchdog) != nullptr && !write(one, ServoRole::watchdog, 0))
      return Status::refused(silent(one, "does not answer"));
    if (!write(one, ServoRole::torque_enable, 0))
      return Status::refused(silent(one, "does not confirm that its torque is off"));
    return {};
  }

  // Not confirmed goals are not switched on: the servo would jump to the one from before the release.
  std::optional<double> catch_joint(std::size_t joint) override {
    const JointServo& one = setup_.joints[joint];
    const auto present = bus_.read(one.id, *one.model->find(ServoRole::present_position));
    if (!present || !write(one, ServoRole::goal_position, *present)) return std::nullopt;
    if (!write(one, ServoRole::torque_enable, 1)) return std::nullopt;
    // Without its watchdog the servo would hold for ever when the host ends.
    if (one.model->find(ServoRole::watchdog) != nullptr &&
        !write(one, ServoRole::watchdog, std::lround(setup_.watchdog / kWatchdogUnit)))
      return std::nullopt;
    return one.model->angle(*present);
  }

  bool set_torque(double share) override {
    bool all = true;
    for (const JointServo& one : setup_.joints) {
      if (one.enabled) all = write_torque(one, share) && all;
    }
    return all;
  }

  std::size_t read(std::span<ServoReading> readings) override {
    const std::size_t fresh = bus_.read_all(readings);
    // Slow values of one servo at a time, in cycles that have room for another answer.
    if (++cycles_ % kHealthEvery == 0 && fresh == readings.size())
      static_cast<void>(bus_.read_health(readings));
    return fresh;
  }

  bool write(std::span<const ServoGoal> goals) override { return bus_.write_goals(goals); }

  [[nodiscard]] bool believes() const override { return false; }
  [[nodiscard]] const BusCounts& counts() const override { return bus_.counts(); }

 private:
  // Nothing depends on the time of a cycle until the servos hold their pose.
  class StartTimeout {
   public:
    explicit StartTimeout(ServoBus& bus) : bus_(bus) { bus_.set_patience(kStartTimeout); }
    ~StartTimeout() { bus_.set_patience(kCycleTimeout); }
    StartTimeout(const StartTimeout&) = delete;
    StartTimeout& operator=(const StartTimeout&) = delete;

   private:
    ServoBus& bus_;
  };

  static std::string name_of(const JointServo& one) {
    return fmt::format("'{}' (id {}, {})", one.joint, one.id, one.model->name);
  }
  static std::string silent(const JointServo& one, std::string_view what) {
    return fmt::format("{} {}", name_of(one), what);
  }
  bool write(const JointServo& one, ServoRole role, std::int64_t value) {
    if (!bus_.write(one.id, *one.model->find(role), value)) return false;
    return role != ServoRole::torque_enable || value == 0 || !has_refused();
  }
  // Dynamixel's servos also answer a write that they refuse, such as that of the torque after a latched
  // overload, with the reason in the lower bits of the error byte. Its highest bit only says that the
  // register of errors has something to say.
  [[nodiscard]] bool has_refused() const {
    constexpr unsigned kReason = 0x7F;
    return setup_.protocol == ServoProtocol::dynamixel && (bus_.last_error() & kReason) != 0;
  }
  bool write_torque(const JointServo& one, double share) {
    const double most = one.gripper ? setup_.gripper_torque : setup_.torque;
    const double whole = static_cast<double>(one.model->whole_torque);
    return write(one, ServoRole::torque_limit, std::lround(whole * std::min(share, most)));
  }

  // A register that does not answer may have any value, and is a problem.
  std::optional<std::int64_t> ask(const JointServo& one, ServoRole role, std::vector<std::string>& problems) {
    const ServoRegister& which = *one.model->find(role);
    const auto out = bus_.read(one.id, which);
    if (!out) problems.push_back(silent(one, fmt::format("answers, but not a read of {}", which.name)));
    return out;
  }

  void identify(const JointServo& one, std::vector<std::string>& problems) {
    const std::optional<PingAnswer> answer = bus_.ping(one.id, 3);
    if (!answer)
      return problems.push_back(silent(one, fmt::format("does not answer at {} bit/s", setup_.rate)));
    if (answer->number != one.model->number) {
      const ServoModel* const found = find_servo_model(setup_.protocol, answer->number);
      return problems.push_back(silent(
          one,
          fmt::format("is another model: {}", found != nullptr ? std::string(found->name)
                                                               : fmt::format("number {}", answer->number))));
    }
    const auto mode = ask(one, ServoRole::operating_mode, problems);
    if (!mode) return;
    if (*mode != one.model->position_mode)
      problems.push_back(
          silent(one, fmt::format("is in operating mode {} instead of {}; doppel hardware check --fix", *mode,
                                  one.model->position_mode)));
    if (!check_homing(one, problems)) return;
    const auto voltage = ask(one, ServoRole::present_voltage, problems);
    if (!voltage) return;
    const double volts = static_cast<double>(*voltage) * one.model->voltage_unit;
    if (volts < one.model->min_voltage - kVoltageSlack || volts > one.model->max_voltage + kVoltageSlack)
      problems.push_back(
          silent(one, fmt::format("has a supply of {:.1f} V, and is made for {:.1f} to {:.1f} V", volts,
                                  one.model->min_voltage, one.model->max_voltage)));
    const auto errors = ask(one, ServoRole::errors, problems);
    if (errors && (one.model->faults(*errors) & kOverloadFault) != 0)
      problems.push_back(
          silent(one, setup_.protocol == ServoProtocol::dynamixel
                          ? "has latched an overload; doppel hardware reboot, when nothing blocks it"
                          : "has latched an overload; switch its power off and on, when nothing blocks it"));
  }

  // With another homing offset every position means another pose than the calibration recorded. False: the
  // servo does not answer.
  bool check_homing(const JointServo& one, std::vector<std::string>& problems) {
    if (!one.recorded) return true;
    const auto homing = ask(one, ServoRole::homing_offset, problems);
    if (homing && *homing != one.recorded->homing_offset)
      problems.push_back(
          silent(one, fmt::format("has the homing offset {} instead of its calibration's {}; doppel hardware "
                                  "check --fix",
                                  *homing, one.recorded->homing_offset)));
    return homing.has_value();
  }

  // The goal becomes the present position, and is read back, because a servo with another goal would jump
  // to it.
  Status place_goal(const JointServo& one, double torque) {
    // A tripped watchdog refuses goals until it is cleared.
    if (one.model->find(ServoRole::watchdog) != nullptr && !write(one, ServoRole::watchdog, 0))
      return Status::refused(silent(one, "does not answer"));
    const ServoRegister& goal = *one.model->find(ServoRole::goal_position);
    const auto present = bus_.read(one.id, *one.model->find(ServoRole::present_position));
    if (!present || !bus_.write(one.id, goal, *present))
      return Status::refused(silent(one, "does not answer"));
    const auto placed = bus_.read(one.id, goal);
    if (!placed) return Status::refused(silent(one, "does not answer"));
    const double difference = std::abs(one.model->angle(*placed) - one.model->angle(*present));
    if (difference > kGoalTolerance)
      return Status::refused(silent(
          one, fmt::format("keeps a goal that is {:.3f} rad from where it is, and would jump", difference)));
    if (!write_torque(one, torque)) return Status::refused(silent(one, "does not confirm its torque limit"));
    return {};
  }

  const ServoSetup& setup_;
  ServoBus bus_;
  std::vector<BusServo> servos_;
  std::uint64_t cycles_ = 0;
};

}  // namespace

std::unique_ptr<ServoGroup> make_register_group(const ServoSetup& setup, ByteLink& link) {
  return std::make_unique<RegisterGroup>(setup, link);
}

}  // namespace doppel
