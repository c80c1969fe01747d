#include <fmt/format.h>

#include "doppel/review/doctor/findings.h"

namespace doppel::doctor {
namespace {

Finding judge_port(const SerialFacts::Port& port) {
  const PortInfo& info = port.info;
  const std::string name = info.product.empty() ? info.path : fmt::format("{} ({})", info.path, info.product);
  Finding finding{Level::ok, "serial ports", "serial." + info.path, name + " can be opened", "", ""};
  if (!port.permits) {
    finding.level = Level::note;
    finding.what = name + " may not be opened by this user";
    finding.why = "an arm on this port cannot be driven";
    finding.remedy = fmt::format("sudo usermod -aG {} $USER, then log in again",
                                 port.group.empty() ? "dialout" : port.group);
  } else if (info.latency_timer.value_or(0) > kMaxLatencyTimer) {
    finding.level = Level::note;
    finding.what = fmt::format("{}: its adapter keeps bytes for {} ms", name, *info.latency_timer);
    finding.why = fmt::format("a bus on it makes about {} cycles a second", 1000 / *info.latency_timer);
    finding.remedy = "install the udev rule of `doppel man small_computer`";
  }
  return finding;
}

}  // namespace

std::vector<Finding> judge_serial(const SerialFacts& facts) {
  std::vector<Finding> out;
  if (facts.ports.empty())
    out.push_back({Level::ok, "serial ports", "serial", "no USB serial port is connected", "", ""});
  for (const SerialFacts::Port& port : facts.ports) out.push_back(judge_port(port));
  if (facts.has_modem_manager)
    out.push_back(
        {Level::note, "serial ports", "serial.modem_manager", "ModemManager runs",
         "it sends bytes to each new serial port, which servos may take for commands, and has the port "
         "open for some seconds",
         "install the udev rule of `doppel man small_computer`, or end it: systemctl disable --now "
         "ModemManager"});
  return out;
}

}  // namespace doppel::doctor
