#pragma once
// A link of bytes to devices: a serial port, a TCP connection, or an emulated bus, which has the clock of a
// simulation. Buses are read and written in loops: no function allocates or throws.

#include <cstdint>
#include <span>
#include <string>

#include "doppel/base/core/time.h"
#include "doppel/export.h"

namespace doppel {

class DOPPEL_API ByteLink {
 public:
  virtual ~ByteLink() = default;

  // The link's clock: the system's monotonic one, or that of a simulation.
  [[nodiscard]] virtual Time now() const = 0;
  // Sends all bytes, in order. False: the link is lost, or its buffer has been full for too long.
  virtual bool write(std::span<const std::uint8_t> bytes) = 0;
  // Waits until bytes have come or the clock has reached `deadline`, and returns how many are in `out`. 0:
  // none, or the link is lost.
  virtual std::size_t read(std::span<std::uint8_t> out, Time deadline) = 0;
  // Forgets what has come and was not read.
  virtual void discard() = 0;
  // Waits, as for a servo that needs a pause.
  virtual void wait_until(Time when) = 0;
  [[nodiscard]] virtual bool is_lost() const = 0;

  // -- outside of loops
  [[nodiscard]] virtual const std::string& name() const = 0;  // "/dev/ttyUSB0"
  // Opens it again after it was lost. False: it is not there, with the reason.
  virtual bool reopen(std::string& why) = 0;
  // Sets the rate, bit/s. False: the link has none, or not this one.
  virtual bool set_rate(int bits_per_second) = 0;
};

}  // namespace doppel
