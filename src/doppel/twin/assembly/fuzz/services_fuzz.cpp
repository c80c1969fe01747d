// Fuzz target: calls of the simulator's services with extreme numbers. The twin stays finite, or is paused
// with a cause.
#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <cstdlib>

#include "doppel/twin/assembly/fuzz/extreme_calls.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  constexpr std::size_t kMaxBytes = 512;  // some 60 calls
  doppel::test::ExtremeCalls calls(std::span(data, std::min(size, kMaxBytes)));
  const std::string problem = calls.run();
  if (problem.empty()) return 0;
  std::fprintf(stderr, "%s\n", problem.c_str());
  std::abort();
}
