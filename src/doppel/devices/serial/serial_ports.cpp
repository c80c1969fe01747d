#include "doppel/devices/serial/serial_ports.h"

#include <grp.h>
#include <sys/stat.h>

#include <algorithm>
#include <charconv>
#include <fstream>
#include <map>
#include <system_error>

namespace doppel {
namespace {

namespace fs = std::filesystem;

std::string first_line(const fs::path& file) {
  std::ifstream in(file);
  std::string line;
  std::getline(in, line);
  return line;
}

std::vector<fs::path> entries_of(const fs::path& folder) {
  std::vector<fs::path> out;
  std::error_code ignored;
  for (const fs::directory_entry& one : fs::directory_iterator(folder, ignored)) out.push_back(one.path());
  std::ranges::sort(out);
  return out;
}

std::optional<int> number_in(const fs::path& file) {
  const std::string text = first_line(file);
  int out = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), out);
  if (error != std::errc() || end == text.data()) return {};
  return out;
}

// The folder of the USB device above a port's folder in /sys; empty: it is not on USB.
fs::path usb_device(const fs::path& port) {
  std::error_code failed;
  fs::path folder = fs::canonical(port / "device", failed);
  constexpr int kMaxLevels = 6;
  for (int level = 0; !failed && level < kMaxLevels && folder.has_relative_path(); ++level) {
    if (fs::exists(folder / "idVendor", failed)) return folder;
    folder = folder.parent_path();
  }
  return {};
}

std::map<std::string, std::string> names_by_id(const fs::path& root) {
  std::map<std::string, std::string> out;
  for (const fs::path& link : entries_of(root / "dev/serial/by-id")) {
    std::error_code failed;
    const fs::path target = fs::read_symlink(link, failed);
    if (!failed) out.emplace(target.filename(), link);
  }
  return out;
}

bool is_serial(const std::string& name, const fs::path& folder) {
  if (name.starts_with("ttyUSB") || name.starts_with("ttyACM")) return true;
  // The board's own ports: those with a driver behind them, not the many that a kernel reserves.
  if (!name.starts_with("ttyAMA") && !name.starts_with("ttyTHS") && !name.starts_with("ttyS")) return false;
  std::error_code failed;
  return fs::exists(folder / "device/driver", failed) && number_in(folder / "type").value_or(1) != 0;
}

}  // namespace

std::vector<PortInfo> serial_ports(const fs::path& root) {
  const std::map<std::string, std::string> by_id = names_by_id(root);
  std::vector<PortInfo> out;
  for (const fs::path& folder : entries_of(root / "sys/class/tty")) {
    const std::string name = folder.filename();
    if (!is_serial(name, folder)) continue;
    PortInfo port;
    port.path = root / "dev" / name;
    if (const auto link = by_id.find(name); link != by_id.end()) port.by_id = link->second;
    if (const fs::path usb = usb_device(folder); !usb.empty()) {
      port.product = first_line(usb / "product");
      port.maker = first_line(usb / "manufacturer");
      port.usb_id = first_line(usb / "idVendor") + ":" + first_line(usb / "idProduct");
    }
    port.latency_timer = number_in(folder / "device/latency_timer");
    out.push_back(std::move(port));
  }
  return out;
}

int pid_with_open(const fs::path& file) {
  std::error_code failed;
  const fs::path target = fs::canonical(file, failed);
  if (failed) return 0;
  for (const fs::path& process : entries_of("/proc")) {
    const std::string name = process.filename();
    int pid = 0;
    const auto [end, error] = std::from_chars(name.data(), name.data() + name.size(), pid);
    if (error != std::errc() || end != name.data() + name.size()) continue;
    for (const fs::path& open : entries_of(process / "fd")) {
      if (fs::read_symlink(open, failed) == target && !failed) return pid;
    }
  }
  return 0;
}

std::string process_with_open(const fs::path& file) {
  const int pid = pid_with_open(file);
  if (pid == 0) return {};
  return first_line(fs::path("/proc") / std::to_string(pid) / "comm") + " (pid " + std::to_string(pid) + ")";
}

std::string group_of(const std::filesystem::path& file) {
  struct stat status {};
  if (::stat(file.c_str(), &status) != 0) return {};
  const group* const found = ::getgrgid(status.st_gid);
  return found != nullptr ? found->gr_name : std::to_string(status.st_gid);
}

}  // namespace doppel
