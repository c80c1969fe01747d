#include "doppel/devices/emulation/emulated_link.h"

#include <algorithm>
#include <array>

namespace doppel {

bool EmulatedLink::write(std::span<const std::uint8_t> bytes) {
  lost_ = lost_ || !devices_.is_plugged();
  if (lost_) return false;
  devices_.receive(bytes, now_, rate_);
  return true;
}

std::size_t EmulatedLink::read(std::span<std::uint8_t> out, Time deadline) {
  lost_ = lost_ || !devices_.is_plugged();
  if (lost_) return 0;
  const std::optional<Time> arrival = devices_.next_arrival();
  if (!arrival || *arrival > deadline) {
    pass(deadline);
    return 0;
  }
  pass(*arrival);
  return devices_.take(out, now_);
}

void EmulatedLink::discard() {
  std::array<std::uint8_t, 64> bytes{};
  while (devices_.take(bytes, now_) > 0) {
  }
}

bool EmulatedLink::reopen(std::string& why) {
  lost_ = !devices_.is_plugged();
  if (lost_) why = name_ + " is unplugged";
  return !lost_;
}

}  // namespace doppel
