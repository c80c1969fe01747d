#include "doppel/devices/serial/detail/terminal_rate.h"

#include <asm/termbits.h>
#include <sys/ioctl.h>

#include <cerrno>

namespace doppel {

int set_raw_terminal(int file, int bits_per_second) {
  termios2 settings{};
  if (::ioctl(file, TCGETS2, &settings) != 0) return errno;
  settings.c_iflag = IGNPAR;
  settings.c_oflag = 0;
  settings.c_lflag = 0;
  // BOTHER: any rate. Without HUPCL, the end of this process does not pull DTR, which resets many boards.
  settings.c_cflag = CS8 | CREAD | CLOCAL | BOTHER;
  settings.c_ispeed = settings.c_ospeed = static_cast<speed_t>(bits_per_second);
  settings.c_cc[VMIN] = 1;  // with 0, a read without bytes looks like the end of the file
  settings.c_cc[VTIME] = 0;
  if (::ioctl(file, TCSETS2, &settings) != 0) return errno;
  // A driver takes the nearest rate that it has, without an error.
  termios2 set{};
  if (::ioctl(file, TCGETS2, &set) != 0) return errno;
  const auto wanted_rate = static_cast<speed_t>(bits_per_second);
  const speed_t difference =
      set.c_ospeed > wanted_rate ? set.c_ospeed - wanted_rate : wanted_rate - set.c_ospeed;
  constexpr speed_t kTolerance = 50;  // a part of 1/50: UARTs read up to some 3 % beside theirs
  return difference * kTolerance > wanted_rate ? EINVAL : 0;
}

bool flush_terminal(int file, bool sent) {
  return ::ioctl(file, TCFLSH, sent ? TCIOFLUSH : TCIFLUSH) == 0;
}

void start_output(int file) {
  static_cast<void>(::ioctl(file, TCXONC, TCOON));
}

int terminal_rate(int file) {
  termios2 settings{};
  if (::ioctl(file, TCGETS2, &settings) != 0) return 0;
  return static_cast<int>(settings.c_ospeed);
}

}  // namespace doppel
