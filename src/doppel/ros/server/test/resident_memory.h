#pragma once
// The resident memory of the test program.

#include <unistd.h>

#include <fstream>

namespace doppel {

// The bound of a growth in kB: sanitizers delay freeing.
constexpr long growth_bound(long kilobytes) {
#if defined(__SANITIZE_THREAD__) || defined(__SANITIZE_ADDRESS__)
  constexpr long kDelayed = 2'000'000;
#else
  constexpr long kDelayed = 0;
#endif
  return kilobytes + kDelayed;
}

inline long resident_kilobytes() {
  std::ifstream file("/proc/self/statm");
  long total = 0, resident = 0;
  file >> total >> resident;
  return resident * (sysconf(_SC_PAGESIZE) / 1024);
}

}  // namespace doppel
