#pragma once
// The host of a bus of servos with registers: Feetech's or Dynamixel's protocol on a link of bytes. Single
// transactions set servos up; the cycle reads all of them with one request and writes their goals with
// another one, or with as many as their frames need. No function allocates once begin_cycle() has been
// called, and none throws.
//
// An answer that comes after its deadline is taken for no other request's (detail/missing_answers.h).

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "doppel/base/core/time.h"
#include "doppel/devices/frames/frame_bytes.h"
#include "doppel/devices/serial/byte_link.h"
#include "doppel/devices/servos/servo_model.h"
#include "doppel/export.h"

namespace doppel {

class PacketCodec;     // detail/packet_codec.h
class MissingAnswers;  // detail/missing_answers.h

struct BusServo {
  int id = 0;
  const ServoModel* model = nullptr;
};

// The report of a servo, at its shaft. NaN: it does not report it, or not yet.
struct DOPPEL_API ServoReading {
  double position;      // rad
  double velocity;      // rad/s
  double load;          // share of its stall torque
  double current;       // A
  double voltage;       // V
  double temperature;   // degrees Celsius
  unsigned faults = 0;  // ServoFault
  Time when{};          // of the link's clock: when it came
  bool fresh = false;   // it came in the last cycle
  ServoReading();
};

struct ServoGoal {
  double position = 0;  // rad
  double velocity = 0;  // rad/s, the speed on the way to it; 0: the servo's fastest
};

struct PingAnswer {
  int id = 0;
  std::uint16_t number = 0;   // of its model
  std::uint8_t firmware = 0;  // Dynamixel: in its answer
  unsigned error = 0;         // the error byte of its answer
  std::size_t answers = 1;    // 2: several servos share this id
};

struct BusCounts {
  std::uint64_t requests = 0;
  std::uint64_t lost = 0;        // answers that did not come
  std::uint64_t bad_checks = 0;  // frames that were damaged
  std::uint64_t noise = 0;       // bytes outside of frames
  std::uint64_t strangers = 0;   // answers that no request was for, or that came too late for theirs
};

class DOPPEL_API ServoBus {
 public:
  // The link outlives the bus. `rate`: bit/s, for the time that bytes need.
  ServoBus(ByteLink& link, ServoProtocol protocol, int rate);
  ~ServoBus();
  ServoBus(const ServoBus&) = delete;
  ServoBus& operator=(const ServoBus&) = delete;

  [[nodiscard]] ByteLink& link() { return link_; }
  [[nodiscard]] ServoProtocol protocol() const { return protocol_; }
  [[nodiscard]] const BusCounts& counts() const { return counts_; }
  void set_rate(int rate) { rate_ = rate; }
  // How long a servo, the adapter and a busy host may take before the first byte of an answer: 50 ms, and
  // less where a cycle cannot wait.
  void set_patience(Duration patience) { patience_ = patience; }
  // Finds out whether the adapter sends the host's own bytes back, which are then skipped.
  void notice_echo();
  [[nodiscard]] bool has_echo() const { return echo_; }

  // -- single transactions, each with `tries` attempts
  [[nodiscard]] std::optional<PingAnswer> ping(int id, int tries = 2);
  // All servos of the bus. Takes some seconds with Feetech's protocol.
  [[nodiscard]] std::vector<PingAnswer> ping_all(int last_id = 252);
  [[nodiscard]] std::optional<std::int64_t> read(int id, const ServoRegister& which, int tries = 3);
  // True: the servo has confirmed this write. A write to the broadcast id has no answer.
  bool write(int id, const ServoRegister& which, std::int64_t value, int tries = 3);
  // Dynamixel only; false: no answer, or the protocol has no reboot.
  bool reboot(int id);
  // The error byte of the last answer.
  [[nodiscard]] unsigned last_error() const { return last_error_; }

  // -- the cycle

  // Sets the servos of the cycle; all have the registers of the first one's model. `fast`: Dynamixel's fast
  // sync read.
  void begin_cycle(std::span<const BusServo> servos, bool fast);
  // Position, velocity and load or current of all servos. A servo that does not answer keeps its values,
  // with `fresh` false. Returns how many are fresh.
  std::size_t read_all(std::span<ServoReading> readings);
  // Voltage, temperature, current and errors of one servo, which change slowly: the next one of the cycle
  // at each call. False: it has not answered.
  bool read_health(std::span<ServoReading> readings);
  // A goal without a position (NaN) is not written. False: the link is lost.
  bool write_goals(std::span<const ServoGoal> goals);

 private:
  struct Answer {
    int id = 0;
    unsigned error = 0;
    std::span<const std::uint8_t> data;
  };
  [[nodiscard]] Time answer_deadline(std::size_t bytes, std::size_t answers) const;
  // Sends the request. False: the link has not taken it.
  bool send();
  // Drops everything up to the echo of the request that was sent. False: it has not come in time, and the
  // request is lost.
  [[nodiscard]] bool drop_echo();
  // The next answer before the deadline; nullopt: none. What has come is read once after the deadline, too.
  std::optional<Answer> receive(Time deadline);
  // Sends the request and waits for the answer of one servo, which has this many bytes of data, or none where
  // it refuses the request.
  std::optional<Answer> transact(int id, std::size_t answer_bytes);
  // How many more bytes to ask these servos for, so that their answers are those of this request; nullopt:
  // the line is not quiet yet.
  std::optional<std::size_t> extra_bytes(std::span<const std::uint8_t> ids, std::size_t size);
  bool settle();
  bool end_doubt();  // true
  // The servo's next answer without data is that of the next request. False: an earlier one may still come.
  bool catch_up(int id, const ServoRegister& any);
  std::optional<std::span<const std::uint8_t>> read_block(int id, std::size_t address, std::size_t size);
  [[nodiscard]] bool is_shared(const PingAnswer& servo);
  // The servos from `begin` on, with one request.
  std::size_t read_some(std::size_t begin, std::size_t count, std::size_t extra,
                        std::span<ServoReading> readings);
  // The block of registers in an answer, which begins with `front` bytes more.
  void decode_motion(std::span<const std::uint8_t> block, unsigned error, std::size_t index,
                     ServoReading& reading) const;
  void encode_goal(const ServoGoal& goal, std::size_t index, std::span<std::uint8_t> block) const;
  void finish_counts();

  ByteLink& link_;
  const ServoProtocol protocol_;
  int rate_;
  Duration patience_;
  bool echo_ = false;
  std::unique_ptr<PacketCodec> codec_;
  const std::unique_ptr<MissingAnswers> missing_;
  struct Expected {
    int id = 0;
    std::size_t size = 0;
  };
  std::optional<Expected> newest_;  // the last answer to the last request, where no missing one is like it
  Time sent_{}, heard_{};           // the last request with an answer; the last answer to an earlier one
  FrameBytes request_;
  BusCounts counts_;
  unsigned last_error_ = 0;

  // The cycle: the block of registers that is read, and the one that is written.
  std::vector<BusServo> servos_;
  std::vector<std::uint8_t> ids_;
  std::vector<std::uint8_t> goals_;  // for each servo its id and block
  std::size_t read_begin_ = 0, read_size_ = 0, write_begin_ = 0, write_size_ = 0;
  std::size_t health_ = 0;  // the servo whose health is read next
  bool fast_ = false;
};

}  // namespace doppel
