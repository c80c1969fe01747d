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

// The longest latency timer of an adapter, ms, with which a bus makes some hundred cycles a second.
inline constexpr int kMaxLatencyTimer = 2;

// The group that may open a file, by name or number; empty: there is no such file.
DOPPEL_API std::string group_of(const std::filesystem::path& file);

// The process that has a file open, "doppel (pid 4711)"; empty: none that this user may see.
DOPPEL_API std::string process_with_open(const std::filesystem::path& file);

}  // namespace doppel
