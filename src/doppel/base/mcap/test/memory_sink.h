#pragma once
// MCAP files in memory, for tests.

#include <string_view>
#include <vector>

#include "doppel/base/mcap/mcap_writer.h"

namespace doppel::mcap_testing {

struct MemorySink : McapSink {
  void write(McapBytes added) override { bytes.insert(bytes.end(), added.begin(), added.end()); }
  std::vector<std::byte> bytes;
};

inline std::vector<std::byte> bytes_of(std::string_view text) {
  const auto* const first = reinterpret_cast<const std::byte*>(text.data());
  return {first, first + text.size()};
}

}  // namespace doppel::mcap_testing
