#include "app/verbs/live_positions.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "app/verbs/controllers.h"
#include "app/verbs/robot_watch.h"
#include "app/verbs/shell.h"
#include "doppel/base/core/names.h"
#include "doppel/base/core/text.h"
#include "doppel/review/calibration/resting_position.h"

namespace doppel::app {
namespace {

using Clock = std::chrono::steady_clock;

constexpr Duration kMaxWait = from_seconds(RestingPosition::kMaxWait);
constexpr Duration kBetween = from_seconds(RestingPosition::kMinBetween);

// `next`: the next sample; NaN: there is none.
double position_at_rest(const std::string& joint, const std::function<double()>& next) {
  const auto until = Clock::now() + kMaxWait;
  RestingPosition position;
  while (Clock::now() < until) {
    if (const auto found = position.take(next())) return *found;
  }
  throw position.refusal(joint);
}

class RobotPositions final : public LivePositions {
 public:
  explicit RobotPositions(const Connection& connection)
      : shell_(connection), watch_(shell_.twin(), find_manager(shell_.twin(), "")) {}

  [[nodiscard]] std::string source() const override { return "the running robot"; }
  [[nodiscard]] std::vector<std::string> joints() const override {
    std::vector<std::string> out;
    for (const auto& [name, sample] : watch_.joints()) out.push_back(name);
    return out;
  }
  double position(const std::string& joint) override {
    drop_old_messages();
    return position_at_rest(joint, [&] {
      Client::Received message;
      if (!shell_.twin().next(message, Clock::now() + kMaxWait) || !watch_.take(message))
        return std::numeric_limits<double>::quiet_NaN();
      return watch_.position(joint).value_or(std::numeric_limits<double>::quiet_NaN());
    });
  }

 private:
  // Those that came while a person moved the arm.
  void drop_old_messages() {
    Client::Received message;
    while (shell_.twin().next(message, Clock::now())) static_cast<void>(watch_.take(message));
  }

  Shell shell_;
  RobotWatch watch_;
};

class ServoPositions final : public LivePositions {
 public:
  explicit ServoPositions(OpenBus open) : open_(std::move(open)), readings_(open_.setup.joints.size()) {
    std::vector<BusServo> servos;
    for (const JointServo& one : open_.setup.joints) servos.push_back({one.id, one.model});
    open_.bus->begin_cycle(servos, false);
  }

  // True: a servo holds, and a hand cannot move it.
  [[nodiscard]] bool any_torque() {
    return std::ranges::any_of(open_.setup.joints, [&](const JointServo& one) {
      return open_.bus->read(one.id, *one.model->find(ServoRole::torque_enable)).value_or(0) != 0;
    });
  }
  void release() {
    for (const JointServo& one : open_.setup.joints)
      static_cast<void>(open_.bus->write(one.id, *one.model->find(ServoRole::torque_enable), 0));
  }

  [[nodiscard]] std::string source() const override {
    return fmt::format("the servos on {}, without torque", open_.link->name());
  }
  [[nodiscard]] std::vector<std::string> joints() const override {
    std::vector<std::string> out;
    for (const JointServo& one : open_.setup.joints) out.push_back(one.joint);
    return out;
  }
  double position(const std::string& joint) override {
    const auto servo = std::ranges::find(open_.setup.joints, joint, &JointServo::joint);
    if (servo == open_.setup.joints.end())
      throw InputError("calibrate.joint", {},
                       fmt::format("no servo drives '{}'{}", joint, did_you_mean(joint, joints())));
    const auto index = static_cast<std::size_t>(servo - open_.setup.joints.begin());
    return position_at_rest(joint, [&] {
      open_.link->wait_until(open_.link->now() + kBetween);
      static_cast<void>(open_.bus->read_all(readings_));
      return readings_[index].fresh ? servo->joint_position(readings_[index].position)
                                    : std::numeric_limits<double>::quiet_NaN();
    });
  }

 private:
  OpenBus open_;
  std::vector<ServoReading> readings_;
};

std::unique_ptr<LivePositions> open_servos(const HardwareOptions& options, bool yes) {
  auto out = std::make_unique<ServoPositions>(open_bus(options));
  if (out->any_torque()) {
    if (!confirmed("the torque goes off, and what it holds falls; is the arm supported?", yes))
      return nullptr;
    out->release();
  }
  return out;
}

}  // namespace

std::unique_ptr<LivePositions> open_live_positions(const HardwareOptions& options, bool yes) {
  const bool number =
      !options.port.empty() && std::ranges::all_of(options.port, [](char c) { return c >= '0' && c <= '9'; });
  if (number)
    return std::make_unique<RobotPositions>(
        Connection{.port = static_cast<int>(parse_number(options.port).value_or(0))});
  try {
    return open_servos(options, yes);
  } catch (const InputError& problem) {
    const Diagnostic& first = problem.diagnostics().front();
    const bool runs =
        first.rule == "hardware.port_in_use" && first.message.find("doppel") != std::string::npos;
    if (!runs && first.rule != "hardware.no_registers") throw;
    return std::make_unique<RobotPositions>(Connection{});
  }
}

}  // namespace doppel::app
