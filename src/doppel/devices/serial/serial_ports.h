#pragma once
// The serial ports of this machine.

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "doppel/export.h"

namespace doppel {

struct PortInfo {
  std::string path;     // "/dev/ttyUSB0"
  std::string by_id;    // "/dev/serial/by-id/...", which stays the same at another socket; empty: none
  std::string product;  // "CP2102 USB to UART Bridge Controller", as the device says; empty: it does not
  std::string maker;
  std::string usb_id;                // "10c4:ea60"; empty: not on USB
  std::optional<int> latency_timer;  // ms, of FTDI adapters: bytes wait that long
};

// USB serial ports and those of the board, by path. `root`: the root of /dev and /sys, for tests.
DOPPEL_API std::vector<PortInfo> serial_ports(const std::filesystem::path& root = "/");

// The emulated ports of this user's running programs, by path; `product` names the device. Removes the notes
// of programs that no longer exist.
DOPPEL_API std::vector<PortInfo> emulated_ports();

// The note by which other programs of this user find an emulated port, until the destructor. Where the
// run-time folder cannot be used there is none.
class DOPPEL_API EmulatedPortNote {
 public:
  EmulatedPortNote(const std::string& path, const std::string& product);
  ~EmulatedPortNote();
  EmulatedPortNote(const EmulatedPortNote&) = delete;
  EmulatedPortNote& operator=(const EmulatedPortNote&) = delete;

 private:
  std::filesystem::path file_;
};

// The longest latency timer of an adapter, ms, with which a bus makes some hundred cycles a second.
inline constexpr int kMaxLatencyTimer = 2;

// The group that may open a file, by name or number; empty: there is no such file.
DOPPEL_API std::string group_of(const std::filesystem::path& file);

// The process that has a file open, by its number, and as "doppel (pid 4711)"; 0 or empty: none that this
// user may see.
DOPPEL_API int pid_with_open(const std::filesystem::path& file);
DOPPEL_API std::string process_with_open(const std::filesystem::path& file);

}  // namespace doppel
