// A partner that is late with one answer, behind a socket and behind a pseudo-terminal: no later request
// takes that answer for its own, and none takes an echo for one.
#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <tuple>
#include <vector>

#include "doppel/devices/buses/servo_bus.h"
#include "doppel/devices/frames/dynamixel_frame.h"
#include "doppel/devices/frames/feetech_frame.h"
#include "doppel/devices/serial/file_link.h"

namespace doppel {
namespace {

constexpr std::uint8_t kPing = 1, kRead = 2, kWrite = 3, kReboot = 8, kSyncRead = 0x82;
constexpr int kLate = 40, kStall = 200;  // ms; the bus waits for 5 ms
constexpr int kLateEcho = 8;             // ms: the bus would still wait for an answer
constexpr int kEveryServo = 0xFE;        // the id of a broadcast
constexpr std::uint8_t kSwallowed = 99;  // a write of this value has no answer

// The partner's end of a link of bytes.
class PartnerEnd {
 public:
  virtual ~PartnerEnd() = default;
  [[nodiscard]] virtual std::string address() const = 0;
  virtual std::size_t read(std::span<std::uint8_t> out) = 0;  // waits some milliseconds
  virtual void write(std::span<const std::uint8_t> bytes) = 0;
};

class SocketEnd final : public PartnerEnd {
 public:
  SocketEnd() : listener_(::socket(AF_INET, SOCK_STREAM, 0)) {
    address_.sin_family = AF_INET;
    address_.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof address_;
    auto* const name = reinterpret_cast<sockaddr*>(&address_);
    EXPECT_EQ(::bind(listener_, name, size), 0);
    EXPECT_EQ(::listen(listener_, 1), 0);
    ::getsockname(listener_, name, &size);
  }
  ~SocketEnd() override {
    ::close(connection_);
    ::close(listener_);
  }
  [[nodiscard]] std::string address() const override {
    return "tcp://127.0.0.1:" + std::to_string(ntohs(address_.sin_port));
  }
  std::size_t read(std::span<std::uint8_t> out) override {
    pollfd one{connection_ >= 0 ? connection_ : listener_, POLLIN, 0};
    if (::poll(&one, 1, 5) <= 0) return 0;
    if (connection_ < 0) {
      connection_ = ::accept(listener_, nullptr, nullptr);
      const int on = 1;  // otherwise a second answer waits for the acknowledgement of the first one
      static_cast<void>(::setsockopt(connection_, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on));
    }
    const ssize_t count = ::recv(connection_, out.data(), out.size(), MSG_DONTWAIT);
    return count > 0 ? static_cast<std::size_t>(count) : 0;
  }
  void write(std::span<const std::uint8_t> bytes) override {
    static_cast<void>(::send(connection_, bytes.data(), bytes.size(), MSG_NOSIGNAL));
  }

 private:
  int listener_, connection_ = -1;
  sockaddr_in address_{};
};

class TerminalEnd final : public PartnerEnd {
 public:
  [[nodiscard]] std::string address() const override { return terminal_.name(); }
  std::size_t read(std::span<std::uint8_t> out) override {
    return terminal_.read(out, terminal_.now() + std::chrono::milliseconds(5));
  }
  void write(std::span<const std::uint8_t> bytes) override { static_cast<void>(terminal_.write(bytes)); }

 private:
  PseudoTerminal terminal_;
};

struct Request {
  int id = 0;
  std::uint8_t instruction = 0;
  std::vector<std::uint8_t> parameters;
};

// Servos whose present position is the number of the request that reads it, from 1 on. Requests are answered
// in their order, and the next answer after a delay in ms.
class Partner {
 public:
  Partner(ServoProtocol protocol, bool behind_socket)
      : protocol_(protocol),
        model_(*find_servo_model(protocol == ServoProtocol::feetech ? "STS3215" : "XL430-W250")) {
    if (behind_socket) {
      end_ = std::make_unique<SocketEnd>();
    } else {
      end_ = std::make_unique<TerminalEnd>();
    }
    thread_ = std::thread([this] { serve(); });
  }
  ~Partner() {
    ends_ = true;
    thread_.join();
  }
  [[nodiscard]] std::string address() const { return end_->address(); }
  [[nodiscard]] const ServoModel& model() const { return model_; }
  std::atomic<int> delay{0};
  std::atomic<bool> reboots{false};  // false: a reboot has no answer
  std::atomic<bool> echo{false};     // the adapter sends the host's bytes back
  std::atomic<int> echo_delay{0};    // ms, of the next echo
  std::atomic<int> absent{-1};       // no servo has this id

 private:
  void serve() {
    while (!ends_) {
      std::array<std::uint8_t, 256> bytes{};
      const std::size_t count = end_->read(bytes);
      const std::span<const std::uint8_t> received = std::span(bytes).first(count);
      if (echo && count > 0) {
        std::this_thread::sleep_for(std::chrono::milliseconds(echo_delay.exchange(0)));
        end_->write(received);
      }
      if (protocol_ == ServoProtocol::feetech) {
        feetech_.push(received);
        while (const auto frame = feetech_.next())
          answer({frame->id, frame->code, {frame->parameters.begin(), frame->parameters.end()}});
      } else {
        dynamixel_.push(received);
        while (const auto frame = dynamixel_.next())
          answer({frame->id, frame->instruction, {frame->parameters.begin(), frame->parameters.end()}});
      }
    }
  }

  [[nodiscard]] std::size_t number(const Request& request, std::size_t index) const {
    if (protocol_ == ServoProtocol::feetech) return request.parameters[index];
    return static_cast<std::size_t>(request.parameters[2 * index] | (request.parameters[2 * index + 1] << 8));
  }

  void answer(const Request& request) {
    ++requests_;
    if (request.id == absent || (request.id == kEveryServo && request.instruction == kPing)) return;
    std::this_thread::sleep_for(std::chrono::milliseconds(delay.exchange(0)));
    const std::size_t head = protocol_ == ServoProtocol::feetech ? 2 : 4;
    if (request.instruction == kWrite && request.parameters.back() != kSwallowed) send(request.id, {});
    if (request.instruction == kReboot && reboots) send(request.id, {});
    if (request.instruction == kPing) send(request.id, answer_to_ping());
    if (request.instruction == kRead) send(request.id, registers(number(request, 0), number(request, 1)));
    if (request.instruction != kSyncRead) return;
    for (std::size_t i = head; i < request.parameters.size(); ++i)
      send(request.parameters[i], registers(number(request, 0), number(request, 1)));
  }

  [[nodiscard]] std::vector<std::uint8_t> answer_to_ping() const {
    if (protocol_ == ServoProtocol::feetech) return {};
    return {static_cast<std::uint8_t>(model_.number & 0xFF), static_cast<std::uint8_t>(model_.number >> 8),
            1};
  }

  [[nodiscard]] std::vector<std::uint8_t> registers(std::size_t address, std::size_t size) const {
    std::vector<std::uint8_t> table(256);
    const auto set = [&](const ServoRegister& which, std::int64_t value) {
      encode_register(which, value, std::span(table).subspan(which.address, which.size));
    };
    set(*model_.find(ServoRole::present_position), requests_);
    set(*model_.find("Model_Number"), model_.number);
    set(*model_.find(ServoRole::present_voltage), 120);
    return {table.begin() + static_cast<std::ptrdiff_t>(address),
            table.begin() + static_cast<std::ptrdiff_t>(address + size)};
  }

  void send(int id, const std::vector<std::uint8_t>& data) {
    FrameBytes frame;
    const auto address = static_cast<std::uint8_t>(id);
    if (protocol_ == ServoProtocol::feetech) {
      add_feetech_frame({address, 0, data}, frame);
    } else {
      std::vector<std::uint8_t> parameters{0};
      parameters.insert(parameters.end(), data.begin(), data.end());
      add_dynamixel_frame({address, static_cast<std::uint8_t>(DynamixelInstruction::status), parameters},
                          frame);
    }
    end_->write(frame.bytes());
  }

  const ServoProtocol protocol_;
  const ServoModel& model_;
  std::unique_ptr<PartnerEnd> end_;
  FeetechReader feetech_;
  DynamixelReader dynamixel_;
  std::int64_t requests_ = 0;
  std::atomic<bool> ends_{false};
  std::thread thread_;
};

class LateAnswers : public testing::TestWithParam<std::tuple<ServoProtocol, bool>> {
 protected:
  LateAnswers() { bus_.set_patience(std::chrono::milliseconds(5)); }

  // True: once `done` has been true within a generous time; a busy machine makes more answers late.
  template <class Done>
  static bool within_seconds(Done done) {
    const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(30);
    while (std::chrono::steady_clock::now() < end) {
      if (done()) return true;
    }
    return false;
  }

  // Now and then an answer or an echo is late, or an answer stalls the link for many requests.
  void delay_after(int answers) {
    if (answers == delayed_) return;
    if (answers % 5 == 2) partner_.echo_delay = kLateEcho;
    if (answers % 20 == 5) partner_.delay = kLate;
    if (answers % 20 == 15) partner_.delay = kStall;
    delayed_ = answers;
  }

  // The adapter has an echo from now on. The codec of Dynamixel's protocol knows it without notice.
  void begin_echo() {
    partner_.echo = true;
    ASSERT_TRUE(within_seconds([&] {
      bus_.notice_echo();
      return bus_.has_echo() == (bus_.protocol() == ServoProtocol::feetech);
    }));
  }

  int delayed_ = 0;
  Partner partner_{std::get<0>(GetParam()), std::get<1>(GetParam())};
  std::unique_ptr<ByteLink> link_ = open_link(partner_.address(), 1000000);
  ServoBus bus_{*link_, std::get<0>(GetParam()), 1000000};
  const ServoRegister& position_ = *partner_.model().find(ServoRole::present_position);
  const ServoRegister& torque_ = *partner_.model().find(ServoRole::torque_enable);
};

TEST_P(LateAnswers, NoReadGetsAnswerOfAnother) {
  int answered = 0;
  EXPECT_TRUE(within_seconds([&] {
    delay_after(answered);
    if (const auto value = bus_.read(1, position_, 1)) {
      EXPECT_EQ(*value, static_cast<std::int64_t>(bus_.counts().requests));
      ++answered;
    }
    return HasFailure() || answered >= 60;
  }));
  EXPECT_GT(bus_.counts().lost, 0U) << "expected that one answer was late";
}

TEST_P(LateAnswers, NoReadGetsEchoOfRequest) {
  begin_echo();
  int answered = 0;
  EXPECT_TRUE(within_seconds([&] {
    delay_after(answered);
    if (const auto value = bus_.read(1, position_, 1)) {
      EXPECT_EQ(*value, static_cast<std::int64_t>(bus_.counts().requests));
      ++answered;
    }
    return HasFailure() || answered >= 60;
  }));
  EXPECT_GT(bus_.counts().lost, 0U) << "expected that one answer was late";
}

// The echo of a ping is the answer of a servo with a fault, byte by byte.
TEST_P(LateAnswers, AbsentServoDoesNotAnswerByEcho) {
  constexpr int kAbsent = 7;
  begin_echo();
  partner_.absent = kAbsent;
  for (int i = 0; i < 20; ++i) {
    partner_.echo_delay = i % 2 == 0 ? kLateEcho : kLate;
    EXPECT_FALSE(bus_.ping(kAbsent, 3)) << "expected no answer to ping " << i;
    ASSERT_TRUE(within_seconds([&] { return bus_.ping(1, 1).has_value(); })) << "expected the bus to recover";
  }
}

TEST_P(LateAnswers, NoWriteIsConfirmedByEarlierAnswer) {
  for (const bool late_write : {false, true}) {
    ASSERT_TRUE(within_seconds([&] { return bus_.write(1, torque_, 1, 1); }))
        << "expected the bus to recover";
    partner_.delay = kLate;
    if (late_write) {
      static_cast<void>(bus_.write(1, torque_, 1, 1));
    } else {
      static_cast<void>(bus_.read(1, position_, 1));
    }
    // For longer than the answer is late.
    const auto end = std::chrono::steady_clock::now() + std::chrono::milliseconds(150);
    while (std::chrono::steady_clock::now() < end)
      EXPECT_FALSE(bus_.write(1, torque_, kSwallowed, 1)) << "a write that no servo has confirmed";
  }
}

TEST_P(LateAnswers, NoRebootIsConfirmedByEarlierAnswer) {
  ASSERT_TRUE(within_seconds([&] { return bus_.write(1, torque_, 1, 1); })) << "expected the bus to recover";
  partner_.delay = kLate;
  static_cast<void>(bus_.write(1, torque_, 1, 1));
  const auto end = std::chrono::steady_clock::now() + std::chrono::milliseconds(150);
  while (std::chrono::steady_clock::now() < end)
    EXPECT_FALSE(bus_.reboot(1)) << "a reboot that no servo has confirmed";
  partner_.reboots = true;
  const bool has_reboot = std::get<0>(GetParam()) == ServoProtocol::dynamixel;
  EXPECT_EQ(has_reboot && within_seconds([&] { return bus_.reboot(1); }), has_reboot);
}

// The voltage and the temperature of Dynamixel's servos have as many bytes as the answer to a ping.
TEST_P(LateAnswers, PingHasNumberOfItsServo) {
  const std::vector<BusServo> servos{{1, &partner_.model()}};
  std::vector<ServoReading> readings(1);
  bus_.begin_cycle(servos, false);
  ASSERT_TRUE(within_seconds([&] { return bus_.ping(1, 1).has_value(); })) << "expected the bus to recover";
  partner_.delay = kLate;
  static_cast<void>(bus_.read_health(readings));
  EXPECT_TRUE(within_seconds([&] {
    const auto answer = bus_.ping(1, 1);
    if (!answer || answer->number == 0) return false;
    EXPECT_EQ(answer->number, partner_.model().number);
    return true;
  }));
}

// A verb that moves one joint slowly has no cycle to keep.
TEST_P(LateAnswers, AnswerOfBusyMachineIsReadWhereNoCycleWaits) {
  constexpr int kBusy = 25;  // ms
  ServoBus bus(*link_, std::get<0>(GetParam()), 1000000);
  EXPECT_TRUE(within_seconds([&] {
    partner_.delay = kBusy;
    return bus.read(1, position_, 1).has_value();
  }));
}

TEST_P(LateAnswers, CycleHasPositionsOfItsOwnRequest) {
  const std::vector<BusServo> servos{{1, &partner_.model()}, {2, &partner_.model()}};
  std::vector<ServoReading> readings(2);
  bus_.begin_cycle(servos, false);
  int whole = 0;
  EXPECT_TRUE(within_seconds([&] {
    delay_after(whole);
    if (bus_.read_all(readings) == 2) ++whole;
    for (const ServoReading& one : readings) {
      if (!one.fresh) continue;
      EXPECT_EQ(std::llround(partner_.model().ticks(one.position)),
                static_cast<std::int64_t>(bus_.counts().requests));
    }
    return HasFailure() || whole >= 60;
  }));
  EXPECT_GT(bus_.counts().lost, 0U) << "expected that one answer was late";
}

std::string name_of_link(const testing::TestParamInfo<std::tuple<ServoProtocol, bool>>& one) {
  return std::string(to_string(std::get<0>(one.param))) + (std::get<1>(one.param) ? "_socket" : "_terminal");
}

INSTANTIATE_TEST_SUITE_P(EveryLink, LateAnswers,
                         testing::Combine(testing::Values(ServoProtocol::feetech, ServoProtocol::dynamixel),
                                          testing::Bool()),
                         name_of_link);

}  // namespace
}  // namespace doppel
