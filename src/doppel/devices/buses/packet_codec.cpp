#include "doppel/devices/buses/detail/packet_codec.h"

#include "doppel/devices/frames/dynamixel_frame.h"
#include "doppel/devices/frames/feetech_frame.h"

namespace doppel {
namespace {

// Both protocols have these instructions.
constexpr std::uint8_t kPing = 0x01, kRead = 0x02, kWrite = 0x03;
constexpr std::uint8_t kSyncRead = 0x82, kSyncWrite = 0x83;

// Requests are the same in both protocols, but for the width of addresses and sizes and the frame around
// them.
class RegisterCodec : public PacketCodec {
 public:
  void add_ping(int id, FrameBytes& out) const override { add_frame(id, kPing, {}, out); }
  void add_read(int id, std::size_t address, std::size_t size, FrameBytes& out) const override {
    FrameBytes parameters = block(address, size);
    add_frame(id, kRead, parameters.bytes(), out);
  }
  void add_write(int id, std::size_t address, std::span<const std::uint8_t> data,
                 FrameBytes& out) const override {
    FrameBytes parameters;
    add_number(address, parameters);
    parameters.add(data);
    add_frame(id, kWrite, parameters.bytes(), out);
  }
  void add_sync_read(std::span<const std::uint8_t> ids, std::size_t address, std::size_t size, bool fast,
                     FrameBytes& out) override {
    FrameBytes parameters = block(address, size);
    parameters.add(ids);
    add_frame(kBroadcast, sync_read_instruction(fast, size), parameters.bytes(), out);
  }
  void add_sync_write(std::span<const std::uint8_t> blocks, std::size_t address, std::size_t size,
                      FrameBytes& out) const override {
    FrameBytes parameters = block(address, size);
    parameters.add(blocks);
    add_frame(kBroadcast, kSyncWrite, parameters.bytes(), out);
  }

 protected:
  static constexpr int kBroadcast = 0xFE;
  virtual void add_frame(int id, std::uint8_t instruction, std::span<const std::uint8_t> parameters,
                         FrameBytes& out) const = 0;
  // Adds an address or a size.
  virtual void add_number(std::size_t number, FrameBytes& out) const = 0;
  virtual std::uint8_t sync_read_instruction(bool /*fast*/, std::size_t /*size*/) { return kSyncRead; }

 private:
  [[nodiscard]] FrameBytes block(std::size_t address, std::size_t size) const {
    FrameBytes out;
    add_number(address, out);
    add_number(size, out);
    return out;
  }
};

class FeetechCodec final : public RegisterCodec {
 public:
  [[nodiscard]] std::size_t max_read(std::size_t /*size*/, bool /*fast*/) const override {
    return kFeetechMaxParameters - kBlock;
  }
  [[nodiscard]] std::size_t max_written(std::size_t size) const override {
    return (kFeetechMaxParameters - kBlock) / (1 + size);
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
  void add_frame(int id, std::uint8_t instruction, std::span<const std::uint8_t> parameters,
                 FrameBytes& out) const override {
    add_feetech_frame({static_cast<std::uint8_t>(id), instruction, parameters}, out);
  }
  void add_number(std::size_t number, FrameBytes& out) const override {
    out.add(static_cast<std::uint8_t>(number & 0xFF));
  }
  static constexpr std::size_t kBlock = 2;  // bytes of an address and a size
  FeetechReader reader_;
};

class DynamixelCodec final : public RegisterCodec {
 public:
  [[nodiscard]] std::size_t max_read(std::size_t size, bool fast) const override {
    return fast ? kDynamixelMaxParameters / (kFastAround + size) : kDynamixelMaxParameters - kBlock;
  }
  [[nodiscard]] std::size_t max_written(std::size_t size) const override {
    return (kDynamixelMaxParameters - kBlock) / (1 + size);
  }
  bool add_reboot(int id, FrameBytes& out) const override {
    add_frame(id, static_cast<std::uint8_t>(DynamixelInstruction::reboot), {}, out);
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
  void add_frame(int id, std::uint8_t instruction, std::span<const std::uint8_t> parameters,
                 FrameBytes& out) const override {
    add_dynamixel_frame({static_cast<std::uint8_t>(id), instruction, parameters}, out);
  }
  void add_number(std::size_t number, FrameBytes& out) const override {
    out.add_word(static_cast<std::uint16_t>(number));
  }
  std::uint8_t sync_read_instruction(bool fast, std::size_t size) override {
    fast_size_ = fast ? size : 0;
    return fast ? static_cast<std::uint8_t>(DynamixelInstruction::fast_sync_read) : kSyncRead;
  }
  // The next servo of a fast answer.
  std::optional<Status> next_part() {
    if (!in_parts_) return {};
    const std::optional<FastPart> part = reader_.fast_part(part_++, fast_size_);
    in_parts_ = part.has_value();
    if (!part) return {};
    return Status{part->id, part->error, part->data};
  }

  static constexpr std::size_t kBlock = 4;       // bytes of an address and a size
  static constexpr std::size_t kFastAround = 4;  // of one servo's part of a fast answer: errors, id, CRC
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
