#pragma once
// Messages of an MCAP file by time and topic, through its index. A file without one, because it was not
// closed or its writer left it out, is scanned once instead.

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "doppel/base/mcap/mcap_records.h"
#include "doppel/base/mcap/mcap_scanner.h"
#include "doppel/export.h"

namespace doppel {

struct McapSchemaInfo {
  std::uint16_t id = 0;
  std::string name, encoding;
  std::vector<std::byte> data;
};
struct McapChannelInfo {
  std::uint16_t id = 0, schema_id = 0;
  std::string topic, message_encoding;
  std::vector<std::pair<std::string, std::string>> metadata;
  std::optional<std::uint64_t> message_count;  // nullopt: the file does not say
};
struct McapChunkInfo {
  std::uint64_t start_time = 0, end_time = 0, offset = 0, length = 0, compressed_size = 0,
                uncompressed_size = 0;
  std::string compression;
};
struct McapNamedPart {  // an attachment, or metadata
  std::uint64_t offset = 0, length = 0;
  std::string name;
};

struct DOPPEL_API McapContents {
  std::string profile, library;
  std::vector<McapSchemaInfo> schemas;    // ascending ids
  std::vector<McapChannelInfo> channels;  // ascending ids
  std::vector<McapChunkInfo> chunks;      // in the order of the file
  std::vector<McapNamedPart> attachments, metadata;
  std::uint64_t message_count = 0, start_time = 0, end_time = 0;  // ns; of all messages
  bool indexed = false;             // by the file's own summary; else it was scanned
  std::string damage = {};          // of a scan that ended early: why, with the byte
  std::uint64_t whole = 0;          // bytes of whole records from the start on
  bool has_loose_messages = false;  // outside of chunks

  [[nodiscard]] const McapChannelInfo* channel(std::uint16_t id) const;
  [[nodiscard]] const McapSchemaInfo* schema(std::uint16_t id) const;
};

struct McapRange {
  std::uint64_t start = 0, end = UINT64_MAX;  // log times, the end excluded
  std::vector<std::uint16_t> channels = {};   // empty: all
};

class DOPPEL_API McapReader {
 public:
  // Reads the summary, or scans. Throws InputError: what a scan throws about the beginning of the file;
  // "mcap.damaged" for a summary whose crc differs, which `allow_scan` scans instead.
  explicit McapReader(std::unique_ptr<McapSource> source, bool allow_scan = true);
  ~McapReader();
  McapReader(McapReader&&) noexcept;

  [[nodiscard]] const McapContents& contents() const;

  // Messages by log time; equal times in the order of the file. Holds the chunks that overlap the present
  // time, decompressed. Valid until the next call; nullopt: the end. Throws InputError "mcap.damaged",
  // "mcap.compression".
  void seek(McapRange range);
  [[nodiscard]] std::optional<McapMessage> next();

  // The record of an attachment or metadata; valid until the next call. Throws InputError "mcap.damaged".
  [[nodiscard]] McapRecord part(const McapNamedPart& part);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace doppel
