// A board with hobby servos, by the servo line. It reports the pulses that it makes; the positions of
// its servos are unknown.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <optional>
#include <system_error>
#include <utility>

#include "doppel/control/hardware/nan.h"
#include "doppel/devices/drivers/detail/servo_group.h"
#include "doppel/devices/drivers/pose_record.h"
#include "doppel/devices/frames/servo_line.h"

namespace doppel {
namespace {

constexpr Duration kBoardPatience{50'000'000};
constexpr Duration kBetweenServos{150'000'000};  // a servo that wakes draws its greatest current
constexpr double kSpeedMargin = 1.2;             // of the joint's speed limit
constexpr double kAccelerationTime = 0.2;        // s, to the speed limit
constexpr std::uint32_t kFirstNonce = 0xD0;
constexpr unsigned kLastRefusal = 19;  // codes from 20 on are events

class LineGroup final : public ServoGroup {
 public:
  LineGroup(const ServoSetup& setup, ByteLink& link) : setup_(setup), link_(link) {}

  Status connect() override {
    if (Status greeted = greet(); !greeted) return greeted;
    for (const JointServo& one : setup_.joints) {
      if (static_cast<unsigned>(one.id) >= identity_.channels)
        return Status::refused(fmt::format("'{}' has the channel {}, and the board has {}", one.joint, one.id,
                                           identity_.channels));
      if (Status limited = limit(one); !limited) return limited;
    }
    const int silence = static_cast<int>(std::lround(1000 * setup_.watchdog));
    if (Status set = ask(fmt::format("W {} hold", silence)); !set) return set;
    if (Status state = ask("Q"); !state) return state;
    learn_pose();
    return {};
  }

  Status start(double /*torque*/) override {
    if (!pose_known_)
      return Status::refused(
          "the board was without power, and the positions of the servos are unknown; confirm the pose of the "
          "arm on the page (Hardware), or with: doppel hardware confirm");
    // From the base to the tip, because each holds up the next ones.
    std::uint32_t mask = 0;
    for (const JointServo& one : setup_.joints) {
      if (!one.enabled) continue;
      mask |= 1U << one.id;
      const bool awake = state_.pulses[static_cast<std::size_t>(one.id)] != 0;
      if (Status enabled = ask(fmt::format("E {}", mask | enabled_mask())); !enabled) return enabled;
      forget_parked_pose();
      if (awake) continue;
      send_targets();
      if (Status answered = await_state(); !answered) return answered;
      link_.wait_until(link_.now() + kBetweenServos);
    }
    const Status state = ask("Q");
    started_ = state.ok();
    return state;
  }

  Status relax() override {
    started_ = false;
    return ask("R");
  }
  bool has_torque() override { return false; }                 // it has no ramp
  bool set_torque(double /*share*/) override { return true; }  // hobby servos have the whole torque or none

  std::size_t read(std::span<ServoReading> readings) override {
    if (!outstanding_) send("Q");
    const bool fresh = await_state().ok();
    for (std::size_t i = 0; i < setup_.joints.size(); ++i) {
      const JointServo& one = setup_.joints[i];
      const double pulse = state_.pulses[static_cast<std::size_t>(one.id)];
      readings[i].fresh = fresh;
      if (!fresh) continue;
      // Without a pulse the servo is where it was confirmed to be.
      readings[i].position = pulse > 0 ? angle_of(one, pulse) : angle_of(one, pose_[i]);
      readings[i].voltage = state_.millivolts > 0 ? 1e-3 * state_.millivolts : kNaN;
      readings[i].when = link_.now();
      readings[i].faults = (state_.flags & ServoLineState::kBrownOut) != 0 ? unsigned{kVoltageFault} : 0U;
    }
    return fresh && refusal().empty() ? readings.size() : 0;
  }

  bool write(std::span<const ServoGoal> goals) override {
    for (std::size_t i = 0; i < goals.size(); ++i) pose_[i] = pulse_of(setup_.joints[i], goals[i].position);
    return send_targets();
  }

  [[nodiscard]] std::string_view refusal() const override {
    if (restarted_) return "the board has lost its power and started again";
    if (!started_) return {};
    if ((state_.flags & ServoLineState::kStopPin) != 0) return "the stop pin of the board is active";
    // Until the next activation, so that nothing is resumed.
    if ((state_.flags & ServoLineState::kWatchdog) != 0)
      return "the board holds, because the host was silent";
    return {};
  }

  [[nodiscard]] bool believes() const override { return true; }
  [[nodiscard]] bool knows_pose() const override { return pose_known_; }
  void take_pose(std::span<const std::pair<std::string, double>> positions) override {
    write_pose_record(pose_record_file(setup_.component, setup_.port),
                      {.boot = identity_.boot, .positions = {positions.begin(), positions.end()}});
    learn_pose();
  }
  [[nodiscard]] const BusCounts& counts() const override { return counts_; }

 private:
  static double us_per_rad(const JointServo& one) { return (one.pulse_max - one.pulse_min) / one.travel; }
  static double pulse_of(const JointServo& one, double angle) {
    const double middle = (one.pulse_min + one.pulse_max) / 2;
    return std::clamp(middle + angle * us_per_rad(one), one.pulse_min, one.pulse_max);
  }
  static double angle_of(const JointServo& one, double pulse) {
    return (pulse - (one.pulse_min + one.pulse_max) / 2) / us_per_rad(one);
  }

  // -- lines
  bool send(std::string_view body) {
    begin_request();
    add_servo_line(body, request_);
    return link_.write(request_.bytes());
  }

  // A board answers in the order of the lines. After an answer that has not come in time, a hello with a new
  // nonce goes ahead, so that what comes before its answer belongs to earlier lines.
  void begin_request() {
    request_.clear();
    ++counts_.requests;
    awaits_hello_ = behind_;
    if (behind_) add_servo_line(fmt::format("H 1 {:X}", ++nonce_), request_);
  }

  bool send_targets() {
    std::array<std::uint16_t, kServoLineChannels> targets{};
    std::size_t count = 0;
    for (std::size_t i = 0; i < setup_.joints.size(); ++i) {
      const auto channel = static_cast<std::size_t>(setup_.joints[i].id);
      if (setup_.joints[i].enabled) targets[channel] = static_cast<std::uint16_t>(std::lround(pose_[i]));
      count = std::max(count, channel + 1);
    }
    behind_ = behind_ || outstanding_;  // the answer to the targets before will come first
    begin_request();
    add_servo_targets(++sequence_, std::span(targets).first(count), request_);
    outstanding_ = link_.write(request_.bytes());
    return outstanding_;
  }

  // The next reply before the deadline; monostate: none. Events are kept, and are no answers. A link returns
  // bytes that are there after the deadline, too: a partner that sends noise without end would keep the host
  // here for ever.
  ServoLineReply receive(Time deadline) {
    for (bool in_time = true;; in_time = link_.now() < deadline) {
      while (const auto body = reader_.next()) {
        ServoLineReply reply = parse_servo_reply(*body);
        if (const auto* const fault = std::get_if<ServoLineFault>(&reply);
            fault != nullptr && fault->code > kLastRefusal)
          continue;
        if (const auto* const identity = std::get_if<ServoLineIdentity>(&reply)) {
          restarted_ = restarted_ || (identity_.boot != 0 && identity->boot != identity_.boot);
          if (identity->nonce != nonce_) continue;
          behind_ = false;
          if (std::exchange(awaits_hello_, false)) continue;
        }
        if (!awaits_hello_ && !std::holds_alternative<std::monostate>(reply)) return reply;
      }
      if (!in_time) return {};
      std::array<std::uint8_t, 256> bytes{};
      const std::size_t count = link_.read(bytes, deadline);
      counts_.bad_checks = reader_.counts().bad_checks;
      counts_.noise = reader_.counts().noise;
      if (count == 0) return {};
      reader_.push(std::span(bytes).first(count));
    }
  }

  Status lose(std::string why) {
    ++counts_.lost;
    behind_ = true;
    return Status::refused(std::move(why));
  }

  Status await_state() {
    const Time deadline = link_.now() + kBoardPatience;
    outstanding_ = false;
    for (;;) {
      const ServoLineReply reply = receive(deadline);
      if (const auto* const state = std::get_if<ServoLineState>(&reply)) {
        state_ = *state;
        return {};
      }
      if (std::holds_alternative<std::monostate>(reply) || link_.now() >= deadline)
        return lose("the board does not answer");
    }
  }

  // Sends a line and waits for what it is answered with.
  Status ask(const std::string& body) {
    behind_ = behind_ || std::exchange(outstanding_, false);
    if (!send(body)) return Status::refused("the link is lost");
    const Time deadline = link_.now() + kBoardPatience;
    for (;;) {
      const ServoLineReply reply = receive(deadline);
      if (const auto* const fault = std::get_if<ServoLineFault>(&reply))
        return Status::refused(fmt::format("the board refuses '{}': {}", body, fault->text));
      const auto* const state = std::get_if<ServoLineState>(&reply);
      if (state != nullptr) state_ = *state;
      const bool is_former = state != nullptr && body != "Q";  // the state that a former request asked for
      if (std::holds_alternative<std::monostate>(reply) || (is_former && link_.now() >= deadline))
        return lose(fmt::format("the board does not answer '{}'", body));
      if (!is_former) return {};
    }
  }

  Status greet() {
    identity_ = {};
    restarted_ = behind_ = awaits_hello_ = outstanding_ = false;
    link_.discard();
    reader_.clear();
    // A board that has just got its power needs a moment.
    constexpr int kTries = 20;
    for (int i = 0; i < kTries; ++i) {
      if (!send(fmt::format("H 1 {:X}", ++nonce_))) return Status::refused("the link is lost");
      const ServoLineReply reply = receive(link_.now() + kBoardPatience);
      if (const auto* const fault = std::get_if<ServoLineFault>(&reply))
        return Status::refused(fmt::format("the board refuses the hello: {}", fault->text));
      const auto* const identity = std::get_if<ServoLineIdentity>(&reply);
      if (identity == nullptr) continue;
      identity_ = *identity;
      identity_.firmware = {};  // a view into the line
      restarted_ = false;
      return {};
    }
    return Status::refused(
        fmt::format("no board answers at {} bit/s; is its firmware doppel_servo?", setup_.rate));
  }

  Status limit(const JointServo& one) {
    const double a = pulse_of(one, one.shaft(one.lower)), b = pulse_of(one, one.shaft(one.upper));
    const double speed = kSpeedMargin * one.velocity * one.scale * us_per_rad(one);
    return ask(fmt::format("C {} {:.0f} {:.0f} {:.0f} {:.0f}", one.id, std::floor(std::min(a, b)),
                           std::ceil(std::max(a, b)), std::ceil(speed),
                           std::ceil(speed / kAccelerationTime)));
  }

  // The pose of the servos: at the pulses that the board makes, or where a person has seen them since it has
  // power.
  void learn_pose() {
    pose_.assign(setup_.joints.size(), 0);
    pose_known_ = true;
    const auto record = read_pose_record(pose_record_file(setup_.component, setup_.port));
    const bool valid = record && (record->boot == identity_.boot || record->parked);
    for (std::size_t i = 0; i < pose_.size(); ++i) {
      const JointServo& one = setup_.joints[i];
      const double pulse = state_.pulses[static_cast<std::size_t>(one.id)];
      pose_[i] = pulse > 0 ? pulse : (one.pulse_min + one.pulse_max) / 2;
      if (pulse > 0) continue;
      const std::optional<double> position = valid ? position_in(*record, one.joint) : std::nullopt;
      if (position) pose_[i] = pulse_of(one, one.shaft(*position));
      if (!position && setup_.confirm_pose) pose_known_ = false;
    }
  }

  // A parked pose counts after any loss of power, and the arm leaves it now.
  void forget_parked_pose() const {
    const std::filesystem::path file = pose_record_file(setup_.component, setup_.port);
    const auto record = read_pose_record(file);
    std::error_code ignored;
    if (record && record->parked) std::filesystem::remove(file, ignored);
  }

  static std::optional<double> position_in(const PoseRecord& record, const std::string& joint) {
    const auto found = std::ranges::find(record.positions, joint, &std::pair<std::string, double>::first);
    if (found == record.positions.end()) return {};
    return found->second;
  }

  [[nodiscard]] std::uint32_t enabled_mask() const {
    std::uint32_t out = 0;
    for (std::size_t channel = 0; channel < state_.channels; ++channel) {
      if (state_.pulses[channel] != 0) out |= 1U << channel;
    }
    return out;
  }

  const ServoSetup& setup_;
  ByteLink& link_;
  ServoLineReader reader_;
  FrameBytes request_;
  BusCounts counts_;
  ServoLineIdentity identity_;
  ServoLineState state_;
  std::vector<double> pose_;  // us, by the joints of the setup
  bool pose_known_ = false;
  bool started_ = false;
  bool outstanding_ = false;  // a request whose state has not come
  bool behind_ = false;       // an answer has not come in time, and may still come
  bool awaits_hello_ = false;
  std::uint32_t nonce_ = kFirstNonce;  // of the last hello
  bool restarted_ = false;             // the board has lost its power since the hello
  std::uint32_t sequence_ = 0;
};

}  // namespace

std::unique_ptr<ServoGroup> make_line_group(const ServoSetup& setup, ByteLink& link) {
  return std::make_unique<LineGroup>(setup, link);
}

}  // namespace doppel
