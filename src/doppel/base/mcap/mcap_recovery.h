#pragma once
// Checks of MCAP files, and copies of what is whole in a damaged one. A file is never changed.

#include <functional>
#include <string>
#include <vector>

#include "doppel/base/mcap/mcap_scanner.h"
#include "doppel/base/mcap/mcap_writer.h"
#include "doppel/export.h"

namespace doppel {

struct McapCheck {
  std::uint64_t messages = 0, chunks = 0;
  bool closed = false;                // its summary was written
  std::vector<std::string> problems;  // with their bytes; empty: all is right
};

// Called with the completed fraction, 0..1; false: ends. May be empty.
using McapProgress = std::function<bool(double)>;

// Every record, check sum and index of the file. Throws what McapScanner throws about its beginning.
[[nodiscard]] DOPPEL_API McapCheck check_mcap(const McapSource& source, const McapProgress& progress = {});

struct McapRecovery {
  std::uint64_t messages = 0, attachments = 0, metadata = 0;
  std::uint64_t damaged_bytes = 0;  // that are in no whole record
  std::vector<std::string> losses;  // each with its byte
  bool cancelled = false;
};

// Writes schemas, channels, messages, attachments and metadata of all whole records, in the order of the
// file, also behind damage. Recovering the result gives the same bytes. Profile and library are those of the
// file, not of `options`.
DOPPEL_API McapRecovery recover_mcap(const McapSource& source, McapSink& sink, McapWriterOptions options,
                                     const McapProgress& progress = {});

}  // namespace doppel
