#pragma once
// An MCAP file in memory.

#include <utility>
#include <vector>

#include "doppel/base/mcap/mcap_writer.h"
#include "doppel/export.h"

namespace doppel {

class DOPPEL_API McapMemorySink : public McapSink {
 public:
  void write(McapBytes bytes) override { bytes_.insert(bytes_.end(), bytes.begin(), bytes.end()); }
  // Precondition: the writer is closed.
  [[nodiscard]] std::vector<std::byte> take() { return std::exchange(bytes_, {}); }

 private:
  std::vector<std::byte> bytes_;
};

}  // namespace doppel
