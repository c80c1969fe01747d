#pragma once
// The records of an MCAP file from its start to its end, without its index: of files that were not closed or
// are damaged, and for checks.

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "doppel/base/mcap/mcap_records.h"
#include "doppel/export.h"

namespace doppel {

// A file, or bytes in memory. Any thread.
class DOPPEL_API McapSource {
 public:
  virtual ~McapSource() = default;
  [[nodiscard]] virtual std::uint64_t size() const = 0;
  // Fills `out`. Throws InputError "mcap.damaged" beyond the end, "file.unreadable" with the system's reason.
  virtual void read(std::uint64_t offset, std::span<std::byte> out) const = 0;
};
// Throws InputError "file.unreadable".
[[nodiscard]] DOPPEL_API std::unique_ptr<McapSource> open_mcap_source(const std::string& path);
[[nodiscard]] DOPPEL_API std::unique_ptr<McapSource> mcap_source(std::vector<std::byte> bytes);

struct McapScanned {
  McapOp code = McapOp::header;
  std::uint64_t offset = 0;  // of the record in the file
  std::uint64_t length = 0;  // with its prefix
  McapBytes bytes;           // all of them
  McapRecord record;
};

inline constexpr std::uint64_t kMaxMcapRecord = 1U << 31U;  // bytes that are held in memory

// Throws InputError "mcap.damaged" at construction: the file does not begin as an MCAP file; of a ROS 1 bag,
// an SQLite bag and other known files with their name.
class DOPPEL_API McapScanner {
 public:
  explicit McapScanner(const McapSource& source);

  // The next record, valid until the next call; those of unknown codes are skipped. nullptr: the end of the
  // file. Throws InputError "mcap.damaged" with the byte: the record ends beyond the file, is longer than
  // kMaxMcapRecord, or its fields are damaged.
  const McapScanned* next();

  // After next() has thrown: moves to the next whole chunk behind the damage. False: there is none.
  bool find_next_chunk();

  // Up to where all records were whole.
  [[nodiscard]] std::uint64_t position() const { return position_; }
  // True once the footer and the magic bytes at the end were read.
  [[nodiscard]] bool complete() const { return complete_; }

 private:
  const McapSource& source_;
  std::uint64_t position_ = kMcapMagicSize;
  bool complete_ = false;
  std::vector<std::byte> bytes_;
  McapScanned scanned_;
};

// True if the check sum of an attachment is that of its fields, or is not given. `content`: of the record,
// without its prefix.
[[nodiscard]] DOPPEL_API bool is_whole(const McapAttachment& attachment, McapBytes content);

// The records within a chunk, decompressed, whose crc is checked. Throws InputError "mcap.damaged",
// "mcap.compression"; MissingModule. `offset`: of the chunk's record, for messages.
[[nodiscard]] DOPPEL_API std::vector<std::byte> chunk_records(const McapChunk& chunk, std::uint64_t offset);

// The record at `next`, which moves behind it; nullopt: of an unknown code. Throws InputError "mcap.damaged".
DOPPEL_API std::optional<McapRecord> next_chunk_record(McapBytes records, std::size_t& next,
                                                       std::uint64_t chunk_offset);

// Calls visit(record, offset in `records`) for each record of a chunk, in their order; false ends it.
template <class Visit>
void for_each_record(McapBytes records, std::uint64_t chunk_offset, Visit&& visit) {
  for (std::size_t next = 0; next < records.size();) {
    const std::size_t start = next;
    const auto found = next_chunk_record(records, next, chunk_offset);
    if (found && !visit(*found, start)) return;
  }
}

}  // namespace doppel
