// Links over pseudo-terminals and TCP: bytes both ways, deadlines, loss, and what is said of ports that
// cannot be opened.
#include <arpa/inet.h>
#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <fstream>
#include <optional>
#include <vector>

#include "doppel/base/core/diagnostic.h"
#include "doppel/devices/serial/file_link.h"
#include "doppel/devices/serial/serial_ports.h"

namespace doppel {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;
using Bytes = std::vector<std::uint8_t>;

constexpr Duration kShort{20'000'000}, kLong{2'000'000'000};

Bytes read_some(ByteLink& link, std::size_t count, Duration patience = kLong) {
  Bytes out;
  std::array<std::uint8_t, 64> buffer{};
  const Time deadline = link.now() + patience;
  while (out.size() < count) {
    const std::size_t got =
        link.read(std::span(buffer).first(std::min(buffer.size(), count - out.size())), deadline);
    if (got == 0) break;
    out.insert(out.end(), buffer.begin(), buffer.begin() + static_cast<std::ptrdiff_t>(got));
  }
  return out;
}

std::string error_of(const std::string& address, int rate = kDefaultRate) {
  try {
    open_link(address, rate);
  } catch (const InputError& problem) {
    return problem.what();
  }
  return "no error";
}

TEST(SerialLink, EveryByteComesThroughBothWays) {
  PseudoTerminal device;
  const auto host = open_link(device.name(), 1000000);
  Bytes all(256);
  for (std::size_t i = 0; i < all.size(); ++i) all[i] = static_cast<std::uint8_t>(i);
  ASSERT_TRUE(host->write(all));
  EXPECT_EQ(read_some(device, all.size()), all);
  ASSERT_TRUE(device.write(all));
  EXPECT_EQ(read_some(*host, all.size()), all);
  EXPECT_EQ(device.rate(), 1000000);
}

TEST(SerialLink, ReadEndsAtItsDeadline) {
  PseudoTerminal device;
  const auto host = open_link(device.name());
  const Time begin = host->now();
  EXPECT_TRUE(read_some(*host, 1, kShort).empty());
  EXPECT_GE(host->now() - begin, kShort);
  EXPECT_FALSE(host->is_lost());
}

TEST(SerialLink, LostPortIsLostUntilItIsOpenedAgain) {
  std::optional<PseudoTerminal> device(std::in_place);
  const auto host = open_link(device->name());
  device.reset();
  EXPECT_TRUE(read_some(*host, 1, kLong).empty());
  EXPECT_TRUE(host->is_lost());
  EXPECT_FALSE(host->write(Bytes{1}));
  std::string why;
  EXPECT_FALSE(host->reopen(why));
  EXPECT_THAT(why, HasSubstr("there is no port"));
}

TEST(SerialLink, TerminalWithoutClientStaysOpen) {
  PseudoTerminal device;
  { const auto host = open_link(device.name()); }
  EXPECT_TRUE(read_some(device, 1, kShort).empty());
  EXPECT_FALSE(device.is_lost());
  const auto host = open_link(device.name());
  ASSERT_TRUE(host->write(Bytes{7}));
  EXPECT_EQ(read_some(device, 1), Bytes{7});
}

TEST(SerialLink, OutputThatLastClientHasStoppedContinuesForNext) {
  PseudoTerminal device;
  const int client = ::open(device.name().c_str(), O_RDWR | O_NOCTTY);
  ASSERT_GE(client, 0);
  EXPECT_TRUE(read_some(device, 1, kShort).empty());
  ASSERT_EQ(::tcflow(client, TCOOFF), 0);
  ::close(client);
  EXPECT_TRUE(read_some(device, 1, kShort).empty());
  const auto host = open_link(device.name());
  ASSERT_TRUE(host->write(Bytes{7}));
  EXPECT_EQ(read_some(device, 1), Bytes{7});
}

TEST(SerialLink, SecondOpeningNamesProcessThatHasPort) {
  PseudoTerminal device;
  const auto host = open_link(device.name());
  EXPECT_THAT(error_of(device.name()), HasSubstr("is in use by"));
  EXPECT_THAT(error_of(device.name()), HasSubstr("(pid " + std::to_string(::getpid()) + ")"));
}

TEST(SerialLink, MissingPortIsError) {
  EXPECT_THAT(error_of("/dev/ttyUSB99"), HasSubstr("there is no port /dev/ttyUSB99"));
  EXPECT_THAT(error_of("/etc/passwd"), HasSubstr("is no serial port"));
  EXPECT_THAT(error_of("http://x"), HasSubstr("tcp://HOST:PORT"));
  EXPECT_THAT(error_of("tcp://nowhere"), HasSubstr("tcp://HOST:PORT"));
}

TEST(SerialLink, TcpConnectionCarriesBytes) {
  const int listener = ::socket(AF_INET, SOCK_STREAM, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  ASSERT_EQ(::bind(listener, reinterpret_cast<sockaddr*>(&address), sizeof address), 0);
  ASSERT_EQ(::listen(listener, 1), 0);
  socklen_t size = sizeof address;
  ::getsockname(listener, reinterpret_cast<sockaddr*>(&address), &size);
  const std::string name = "tcp://127.0.0.1:" + std::to_string(ntohs(address.sin_port));
  {
    const auto host = open_link(name);
    const int device = ::accept(listener, nullptr, nullptr);
    ASSERT_TRUE(host->write(Bytes{1, 2, 3}));
    std::array<char, 3> received{};
    EXPECT_EQ(::read(device, received.data(), received.size()), 3);
    EXPECT_EQ(::write(device, "ok", 2), 2);
    EXPECT_EQ(read_some(*host, 2), (Bytes{'o', 'k'}));
    EXPECT_EQ(::write(device, "late", 4), 4);
    EXPECT_EQ(read_some(*host, 1), Bytes{'l'});  // all of it has arrived
    host->discard();
    EXPECT_TRUE(read_some(*host, 1, kShort).empty()) << "expected a socket to forget what has come, too";
    ::close(device);
    EXPECT_TRUE(read_some(*host, 1).empty());
    EXPECT_TRUE(host->is_lost());
  }
  ::close(listener);
  EXPECT_THAT(error_of(name), HasSubstr("does not answer"));
}

void write_file(const fs::path& file, const std::string& text) {
  fs::create_directories(file.parent_path());
  std::ofstream(file) << text;
}

TEST(SerialPorts, UsbPortIsListedWithItsProductAndItsNameById) {
  const fs::path root = fs::temp_directory_path() / ("doppel_ports_" + std::to_string(::getpid()));
  const fs::path usb = root / "sys/devices/usb1/1-2", port = usb / "1-2:1.0/ttyUSB0";
  write_file(usb / "idVendor", "0403\n");
  write_file(usb / "idProduct", "6014\n");
  write_file(usb / "product", "U2D2\n");
  write_file(usb / "manufacturer", "FTDI\n");
  write_file(port / "latency_timer", "16\n");
  write_file(root / "sys/class/tty/tty0/dev", "4:0\n");
  fs::create_directories(root / "sys/class/tty/ttyUSB0");
  fs::create_directory_symlink(port, root / "sys/class/tty/ttyUSB0/device");
  fs::create_directories(root / "dev/serial/by-id");
  fs::create_symlink("../../ttyUSB0", root / "dev/serial/by-id/usb-FTDI_U2D2");
  const std::vector<PortInfo> ports = serial_ports(root);
  ASSERT_EQ(ports.size(), 1U);
  EXPECT_EQ(ports[0].path, root / "dev/ttyUSB0");
  EXPECT_THAT(ports[0].by_id, HasSubstr("usb-FTDI_U2D2"));
  EXPECT_EQ(ports[0].product, "U2D2");
  EXPECT_EQ(ports[0].usb_id, "0403:6014");
  EXPECT_EQ(ports[0].latency_timer, 16);
  fs::remove_all(root);
}

}  // namespace
}  // namespace doppel
