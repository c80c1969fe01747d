#pragma once
// Links that are file descriptors of this system: serial ports, TCP connections, pseudo-terminals.

#include <memory>
#include <string>
#include <utility>

#include "doppel/devices/serial/byte_link.h"
#include "doppel/export.h"

namespace doppel {

inline constexpr int kDefaultRate = 115200;  // bit/s

// Opens "/dev/ttyUSB0", "/dev/serial/by-id/...", the other end of a pseudo-terminal, or "tcp://host:port".
// A port is opened for this process alone (TIOCEXCL, and a lock), without hang-up at its end, so that
// opening it does not reset the board behind it. Throws InputError: the port is not there, with those that
// are; another process has it, which one; no permission, with the group; the rate is none that it has; the
// host does not answer.
DOPPEL_API std::unique_ptr<ByteLink> open_link(const std::string& address,
                                               int bits_per_second = kDefaultRate);

class DOPPEL_API FileLink : public ByteLink {
 public:
  ~FileLink() override;
  FileLink(const FileLink&) = delete;
  FileLink& operator=(const FileLink&) = delete;

  [[nodiscard]] Time now() const override;
  bool write(std::span<const std::uint8_t> bytes) override;
  std::size_t read(std::span<std::uint8_t> out, Time deadline) override;
  void discard() override;
  void wait_until(Time when) override;
  [[nodiscard]] bool is_lost() const override { return file_ < 0; }
  [[nodiscard]] const std::string& name() const override { return name_; }
  bool reopen(std::string& why) override;
  bool set_rate(int /*bits_per_second*/) override { return false; }

 protected:
  explicit FileLink(std::string name) : name_(std::move(name)) {}
  // A new file descriptor, non-blocking. Throws InputError.
  virtual int open_file() = 0;
  // True: an end of file or an error is not the end of the link.
  [[nodiscard]] virtual bool stays_open() const { return false; }
  // The last program that had the other end of a file that stays open has closed it.
  virtual void on_other_end_closed() {}
  void close_file();

  std::string name_;
  int file_ = -1;

 private:
  bool other_end_open_ = false;
  bool wait_for(short events, Time deadline);
};

// The end of an emulated device. Other programs open the file name() as a serial port.
class DOPPEL_API PseudoTerminal final : public FileLink {
 public:
  // Throws std::system_error.
  PseudoTerminal();
  // The rate that the other end has set, bit/s; 0: it is not known.
  [[nodiscard]] int rate() const;

 private:
  int open_file() override;
  [[nodiscard]] bool stays_open() const override { return true; }
  void on_other_end_closed() override;
};

}  // namespace doppel
