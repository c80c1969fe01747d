#include <fcntl.h>
#include <fmt/format.h>
#include <netdb.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/file.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <system_error>
#include <vector>

#include "doppel/base/core/diagnostic.h"
#include "doppel/base/core/names.h"
#include "doppel/devices/serial/detail/terminal_rate.h"
#include "doppel/devices/serial/file_link.h"
#include "doppel/devices/serial/serial_ports.h"

namespace doppel {
namespace {

constexpr std::string_view kTcp = "tcp://";
constexpr int kConnectPatience = 2000;  // ms

[[noreturn]] void refuse(const std::string& rule, const std::string& message, const std::string& fix) {
  throw InputError("hardware." + rule, {}, message, fix);
}

[[noreturn]] void refuse_missing(const std::string& path) {
  std::vector<std::string> there_are;
  for (const PortInfo& port : serial_ports())
    there_are.push_back(port.by_id.empty() ? port.path : port.by_id);
  for (const PortInfo& port : emulated_ports()) there_are.push_back(port.path);
  refuse("no_port", fmt::format("there is no port {}{}", path, did_you_mean(path, there_are)),
         there_are.empty()
             ? "connect the device, and see its port with: doppel hardware scan; without one: doppel emulate"
             : "doppel hardware scan lists the ports and what answers on them");
}

[[noreturn]] void refuse_busy(const std::string& path) {
  const std::string owner = process_with_open(path);
  refuse("port_in_use",
         fmt::format("{} is in use by {}", path,
                     owner.empty() ? "another process, which this user may not see" : owner),
         "end that process, or use another port");
}

[[noreturn]] void refuse_open(const std::string& path, int error) {
  if (error == ENOENT || error == ENXIO || error == ENODEV) refuse_missing(path);
  if (error == EBUSY) refuse_busy(path);
  if (error == EACCES || error == EPERM) {
    const std::string group = group_of(path);
    refuse("port_permission",
           fmt::format("this user may not open {}: it belongs to the group {}", path, group),
           fmt::format("sudo usermod -aG {} $USER, then log in again", group));
  }
  refuse("port", fmt::format("{} cannot be opened: {}", path, std::strerror(error)), "doppel hardware scan");
}

class SerialPort final : public FileLink {
 public:
  SerialPort(const std::string& path, int bits_per_second) : FileLink(path), rate_(bits_per_second) {
    file_ = open_file();
  }
  bool set_rate(int bits_per_second) override {
    if (is_lost() || set_raw_terminal(file_, bits_per_second) != 0) return false;
    rate_ = bits_per_second;
    flush_terminal(file_, true);
    return true;
  }

 private:
  int open_file() override {
    const int file = ::open(name_.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
    if (file < 0) refuse_open(name_, errno);
    // Both, because root passes TIOCEXCL, and other programs do not look at the lock.
    if (::flock(file, LOCK_EX | LOCK_NB) != 0) {
      ::close(file);
      refuse_busy(name_);
    }
    static_cast<void>(::ioctl(file, TIOCEXCL));
    if (const int error = set_raw_terminal(file, rate_); error != 0) {
      ::close(file);
      if (error == ENOTTY) refuse("port", fmt::format("{} is no serial port", name_), "doppel hardware scan");
      refuse("rate",
             fmt::format("{} does not have the rate {} bit/s: {}", name_, rate_, std::strerror(error)),
             "another rate of the device, or another adapter");
    }
    // Equal levels of DTR and RTS keep the reset circuit of ESP32 boards off. Ports without these lines
    // refuse it.
    constexpr int kLines = TIOCM_DTR | TIOCM_RTS;
    static_cast<void>(::ioctl(file, TIOCMBIC, &kLines));
    flush_terminal(file, true);
    return file;
  }

  int rate_;
};

class TcpLink final : public FileLink {
 public:
  explicit TcpLink(const std::string& address) : FileLink(address) { file_ = open_file(); }

 private:
  int open_file() override {
    const std::string rest = name_.substr(kTcp.size());
    const std::size_t colon = rest.rfind(':');
    if (colon == std::string::npos || colon == 0 || colon + 1 == rest.size())
      refuse("address", fmt::format("'{}' is no address", name_), "write tcp://HOST:PORT");
    const std::string host = rest.substr(0, colon), port = rest.substr(colon + 1);
    addrinfo hints{};
    hints.ai_socktype = SOCK_STREAM;
    addrinfo* found = nullptr;
    if (const int error = ::getaddrinfo(host.c_str(), port.c_str(), &hints, &found); error != 0)
      refuse("address", fmt::format("{}: {}", name_, ::gai_strerror(error)), "check host and port");
    int last_error = 0, file = -1;
    for (const addrinfo* one = found; one != nullptr && file < 0; one = one->ai_next) {
      file = connected(*one, last_error);
    }
    ::freeaddrinfo(found);
    if (file < 0)
      refuse("address", fmt::format("{} does not answer: {}", name_, std::strerror(last_error)),
             "check that the bridge is on, and its host and port");
    const int on = 1;  // each frame leaves at once
    static_cast<void>(::setsockopt(file, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on));
    return file;
  }

  // -1: no connection, with the reason.
  static int connected(const addrinfo& address, int& error) {
    const int file = ::socket(address.ai_family, address.ai_socktype | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
    if (file < 0) {
      error = errno;
      return -1;
    }
    error = ::connect(file, address.ai_addr, address.ai_addrlen) == 0 ? 0 : errno;
    if (error == EINPROGRESS) {
      pollfd one{file, POLLOUT, 0};
      socklen_t size = sizeof error;
      if (::poll(&one, 1, kConnectPatience) <= 0) {
        error = ETIMEDOUT;
      } else if (::getsockopt(file, SOL_SOCKET, SO_ERROR, &error, &size) != 0) {
        error = errno;
      }
    }
    if (error == 0) return file;
    ::close(file);
    return -1;
  }
};

}  // namespace

std::unique_ptr<ByteLink> open_link(const std::string& address, int bits_per_second) {
  if (address.starts_with(kTcp)) return std::make_unique<TcpLink>(address);
  if (address.find("://") != std::string::npos)
    refuse("address", fmt::format("'{}' is no address of a device", address),
           "write /dev/ttyUSB0, /dev/serial/by-id/..., or tcp://HOST:PORT");
  return std::make_unique<SerialPort>(address, bits_per_second);
}

PseudoTerminal::PseudoTerminal() : FileLink("") {
  file_ = open_file();
}

int PseudoTerminal::open_file() {
  const int file = ::posix_openpt(O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
  constexpr std::size_t kMaxPath = 128;
  char path[kMaxPath];
  if (file < 0 || ::grantpt(file) != 0 || ::unlockpt(file) != 0 || ::ptsname_r(file, path, sizeof path) != 0)
    throw std::system_error(errno, std::generic_category(), "a pseudo-terminal");
  // Without this an emulated device would get its own bytes back, as an echo, until a client has set up its
  // end.
  static_cast<void>(set_raw_terminal(file, kDefaultRate));
  name_ = path;
  return file;
}

// A program that has stopped the output of its end (tcflow) leaves it stopped for the next one, which could
// not write. Only that end can start it again.
void PseudoTerminal::on_other_end_closed() {
  const int other_end = ::open(name_.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
  if (other_end < 0) return;
  start_output(other_end);
  ::close(other_end);
}

int PseudoTerminal::rate() const {
  return terminal_rate(file_);
}

}  // namespace doppel
