#pragma once
// The form of a protocol's requests and answers; the bus decides when they are sent and awaited.

#include <cstdint>
#include <memory>
#include <optional>
#include <span>

#include "doppel/devices/frames/frame_bytes.h"
#include "doppel/devices/servos/servo_model.h"

namespace doppel {

class PacketCodec {
 public:
  struct Status {
    int id = 0;
    unsigned error = 0;
    std::span<const std::uint8_t> data;  // valid until the next call
  };

  virtual ~PacketCodec() = default;

  // -- requests, added to `out`
  virtual void add_ping(int id, FrameBytes& out) const = 0;
  virtual void add_read(int id, std::size_t address, std::size_t size, FrameBytes& out) const = 0;
  virtual void add_write(int id, std::size_t address, std::span<const std::uint8_t> data,
                         FrameBytes& out) const = 0;
  virtual void add_sync_read(std::span<const std::uint8_t> ids, std::size_t address, std::size_t size,
                             bool fast, FrameBytes& out) = 0;
  // `blocks`: for each servo its id and `size` bytes.
  virtual void add_sync_write(std::span<const std::uint8_t> blocks, std::size_t address, std::size_t size,
                              FrameBytes& out) const = 0;
  // The servos that one sync read of `size` bytes, or one sync write, can have.
  [[nodiscard]] virtual std::size_t max_read(std::size_t size, bool fast) const = 0;
  [[nodiscard]] virtual std::size_t max_written(std::size_t size) const = 0;
  // False: the protocol has none.
  virtual bool add_reboot(int id, FrameBytes& out) const = 0;

  // -- answers
  virtual std::size_t push(std::span<const std::uint8_t> bytes) = 0;
  virtual std::optional<Status> next() = 0;
  virtual void clear() = 0;
  [[nodiscard]] virtual const StreamCounts& counts() const = 0;
  // Bytes of an answer with `size` bytes of data. Of a fast read: of all answers together.
  [[nodiscard]] virtual std::size_t answer_size(std::size_t size) const = 0;
};

[[nodiscard]] std::unique_ptr<PacketCodec> make_packet_codec(ServoProtocol protocol);

}  // namespace doppel
