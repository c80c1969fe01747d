#pragma once
// The resident memory of the test program.

#include <unistd.h>

#include <fstream>

namespace doppel {

inline long resident_kilobytes() {
  std::ifstream file("/proc/self/statm");
  long total = 0, resident = 0;
  file >> total >> resident;
  return resident * (sysconf(_SC_PAGESIZE) / 1024);
}

}  // namespace doppel
