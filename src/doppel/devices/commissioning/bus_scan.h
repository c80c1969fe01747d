#pragma once
// Which devices answer on a link, by protocol and rate.

#include <functional>
#include <string>
#include <vector>

#include "doppel/devices/buses/servo_bus.h"
#include "doppel/devices/serial/byte_link.h"
#include "doppel/devices/servos/servo_model.h"
#include "doppel/export.h"

namespace doppel {

struct FoundDevice {
  ServoProtocol protocol = ServoProtocol::feetech;
  int rate = 0;  // bit/s
  PingAnswer answer;
  const ServoModel* model = nullptr;  // nullptr: a model that is not known, or a board
  ServoReading reading;               // NaN where it did not say
  std::uint32_t boot = 0;             // of a board: the id of its present start
  std::string board;                  // of a servo line: "doppel-servo 1.0.0, 6 channels, 61 ns"
};

struct ScanOptions {
  std::vector<ServoProtocol> protocols = {ServoProtocol::feetech, ServoProtocol::dynamixel,
                                          ServoProtocol::servo_line};
  std::vector<int> rates = {};  // empty: all that the protocol's servos have
  int last_id = 252;
  // Called with the share that is done and what is tried; false: the scan ends. May be empty.
  std::function<bool(double done, const std::string& trying)> progress = {};
};

// Nothing is written to a device. Ends with the first protocol and rate at which devices answer, because a
// bus has one.
[[nodiscard]] DOPPEL_API std::vector<FoundDevice> scan_link(ByteLink& link, const ScanOptions& options);

// The rates of a protocol's devices, the usual one first.
[[nodiscard]] DOPPEL_API std::vector<int> usual_rates(ServoProtocol protocol);

}  // namespace doppel
