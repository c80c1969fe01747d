#include "doppel/devices/buses/detail/packet_codec.h"

#include <array>

#include "doppel/devices/frames/dynamixel_frame.h"
#include "doppel/devices/frames/feetech_frame.h"

namespace doppel {
namespace {

std::uint8_t byte_of(std::size_t value) {
  return static_cast<std::uint8_t>(value & 0xFF);
}

class FeetechCodec final : public PacketCodec {
 public:
  void add_ping(int id, FrameBytes& out) const override { add(id, FeetechInstruction::ping, {}, out); }
  void add_read(int id, std::size_t address, std::size_t size, FrameBytes& out) const override {
    add(id, FeetechInstruction::read, std::array{byte_of(address), byte_of(size)}, out);
  }
  void add_write(int id, std::size_t address, std::span<const std::uint8_t> data,
                 FrameBytes& out) const override {
    FrameBytes parameters;
    parameters.add(byte_of(address));
    parameters.add(data);
    add(id, FeetechInstruction::write, parameters.bytes(), out);
  }
  void add_sync_read(std::span<const std::uint8_t> ids, std::size_t address, std::size_t size, bool /*fast*/,
                     FrameBytes& out) override {
    FrameBytes parameters;
    parameters.add(byte_of(address));
    parameters.add(byte_of(size));
    parameters.add(ids);
    add(kFeetechBroadcast, FeetechInstruction::sync_read, parameters.bytes(), out);
  }
  void add_sync_write(std::span<const std::uint8_t> blocks, std::size_t address, std::size_t size,
                      FrameBytes& out) const override {
    FrameBytes parameters;
    parameters.add(byte_of(address));
    parameters.add(byte_of(size));
    parameters.add(blocks);
    add(kFeetechBroadcast, FeetechInstruction::sync_write, parameters.bytes(), out);
  }
  bool add_reboot(int /*id*/, FrameBytes& /*out*/) const override { return false; }

  std::size_t push(std::span<const std::uint8_t> bytes) override { return reader_.push(bytes); }
  std::optional<Status> next() override {
    const std::optional<FeetechFrame> frame = reader_.next();
    if (!frame) return {};
    return Status{frame->id, frame->code, frame->parameters};
  }
  void clear() override { reader_.clear(); }
  [[nodiscard]] const StreamCounts& counts() const override { return reader_.counts(); }
  [[nodiscard]] std::size_t answer_size(std::size_t size) const override { return size + 6; }

 private:
  static void add(int id, FeetechInstruction instruction, std::span<const std::uint8_t> parameters,
                  FrameBytes& out) {
    add_feetech_frame({static_cast<std::uint8_t>(id), static_cast<std::uint8_t>(instruction), parameters},
                      out);
  }
  FeetechReader reader_;
};

class DynamixelCodec final : public PacketCodec {
 public:
  void add_ping(int id, FrameBytes& out) const override { add(id, DynamixelInstruction::ping, {}, out); }
  void add_read(int id, std::size_t address, std::size_t size, FrameBytes& out) const override {
    FrameBytes parameters;
    parameters.add_word(static_cast<std::uint16_t>(address));
    parameters.add_word(static_cast<std::uint16_t>(size));
    add(id, DynamixelInstruction::read, parameters.bytes(), out);
  }
  void add_write(int id, std::size_t address, std::span<const std::uint8_t> data,
                 FrameBytes& out) const override {
    FrameBytes parameters;
    parameters.add_word(static_cast<std::uint16_t>(address));
    parameters.add(data);
    add(id, DynamixelInstruction::write, parameters.bytes(), out);
  }
  void add_sync_read(std::span<const std::uint8_t> ids, std::size_t address, std::size_t size, bool fast,
                     FrameBytes& out) override {
    FrameBytes parameters;
    parameters.add_word(static_cast<std::uint16_t>(address));
    parameters.add_word(static_cast<std::uint16_t>(size));
    parameters.add(ids);
    fast_size_ = fast ? size : 0;
    add(kDynamixelBroadcast, fast ? DynamixelInstruction::fast_sync_read : DynamixelInstruction::sync_read,
        parameters.bytes(), out);
  }
  void add_sync_write(std::span<const std::uint8_t> blocks, std::size_t address, std::size_t size,
                      FrameBytes& out) const override {
    FrameBytes parameters;
    parameters.add_word(static_cast<std::uint16_t>(address));
    parameters.add_word(static_cast<std::uint16_t>(size));
    parameters.add(blocks);
    add(kDynamixelBroadcast, DynamixelInstruction::sync_write, parameters.bytes(), out);
  }
  bool add_reboot(int id, FrameBytes& out) const override {
    add(id, DynamixelInstruction::reboot, {}, out);
    return true;
  }

  std::size_t push(std::span<const std::uint8_t> bytes) override { return reader_.push(bytes); }
  std::optional<Status> next() override {
    if (const std::optional<Status> part = next_part()) return part;
    for (;;) {
      const std::optional<DynamixelFrame> frame = reader_.next();
      if (!frame) return {};
      // The host's own requests come back where the adapter has an echo.
      if (frame->instruction != static_cast<std::uint8_t>(DynamixelInstruction::status)) continue;
      if (frame->parameters.empty()) continue;
      if (frame->id != kDynamixelBroadcast)
        return Status{frame->id, frame->parameters.front(), frame->parameters.subspan(1)};
      part_ = 0;
      in_parts_ = fast_size_ > 0;
      if (const std::optional<Status> part = next_part()) return part;
    }
  }
  void clear() override {
    reader_.clear();
    in_parts_ = false;
  }
  [[nodiscard]] const StreamCounts& counts() const override { return reader_.counts(); }
  [[nodiscard]] std::size_t answer_size(std::size_t size) const override { return size + 11; }

 private:
  static void add(int id, DynamixelInstruction instruction, std::span<const std::uint8_t> parameters,
                  FrameBytes& out) {
    add_dynamixel_frame({static_cast<std::uint8_t>(id), static_cast<std::uint8_t>(instruction), parameters},
                        out);
  }
  // The next servo of a fast answer.
  std::optional<Status> next_part() {
    if (!in_parts_) return {};
    const std::optional<FastPart> part = reader_.fast_part(part_++, fast_size_);
    in_parts_ = part.has_value();
    if (!part) return {};
    return Status{part->id, part->error, part->data};
  }

  DynamixelReader reader_;
  std::size_t fast_size_ = 0, part_ = 0;
  bool in_parts_ = false;
};

}  // namespace

std::unique_ptr<PacketCodec> make_packet_codec(ServoProtocol protocol) {
  if (protocol == ServoProtocol::feetech) return std::make_unique<FeetechCodec>();
  return std::make_unique<DynamixelCodec>();
}

}  // namespace doppel
