#include <unistd.h>

#include <algorithm>
#include <string_view>

#include "doppel/review/doctor/detail/probes.h"

namespace doppel::doctor {
namespace {

namespace fs = std::filesystem;

bool runs(std::string_view program) {
  std::error_code unreadable;
  for (const auto& process : fs::directory_iterator("/proc", unreadable)) {
    const std::string pid = process.path().filename().string();
    if (!pid.empty() && std::ranges::all_of(pid, [](char c) { return c >= '0' && c <= '9'; }) &&
        first_line(process.path() / "comm") == program)
      return true;
  }
  return false;
}

}  // namespace

SerialFacts probe_serial() {
  SerialFacts facts;
  for (const PortInfo& info : serial_ports()) {
    if (info.usb_id.empty()) continue;
    facts.ports.push_back({info, group_of(info.path), ::access(info.path.c_str(), R_OK | W_OK) == 0});
  }
  facts.has_modem_manager = runs("ModemManager");
  return facts;
}

}  // namespace doppel::doctor
