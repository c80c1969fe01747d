#pragma once
// The records of MCAP files, version 0. Source: the MCAP format specification (mcap.dev/spec); integers are
// little-endian, times are nanoseconds.
//
// Strings and data of parsed records refer to the bytes that they were parsed from.

#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "doppel/export.h"

namespace doppel {

using McapBytes = std::span<const std::byte>;
template <class Key, class Value>
using McapMap = std::vector<std::pair<Key, Value>>;  // in the order of the file
using McapTexts = McapMap<std::string_view, std::string_view>;

inline constexpr std::size_t kMcapMagicSize = 8;
inline constexpr unsigned char kMcapMagic[kMcapMagicSize] = {0x89, 'M', 'C', 'A', 'P', '0', '\r', '\n'};
inline constexpr std::size_t kMcapPrefixSize = 9;  // of a record: its code and the length of its content

enum class McapOp : std::uint8_t {
  header = 1,
  footer,
  schema,
  channel,
  message,
  chunk,
  message_index,
  chunk_index,
  attachment,
  attachment_index,
  statistics,
  metadata,
  metadata_index,
  summary_offset,
  data_end,
};

struct McapHeader {
  std::string_view profile = {}, library = {};
};
struct McapFooter {
  std::uint64_t summary_start = 0, summary_offset_start = 0;  // 0: there is none
  std::uint32_t summary_crc = 0;                              // 0: not known
};
struct McapSchema {
  std::uint16_t id = 0;
  std::string_view name = {}, encoding = {};
  McapBytes data = {};
};
struct McapChannel {
  std::uint16_t id = 0, schema_id = 0;  // schema 0: none
  std::string_view topic = {}, message_encoding = {};
  McapTexts metadata = {};
};
struct McapMessage {
  std::uint16_t channel_id = 0;
  std::uint32_t sequence = 0;
  std::uint64_t log_time = 0, publish_time = 0;
  McapBytes data = {};
};
struct McapChunk {
  std::uint64_t start_time = 0, end_time = 0, uncompressed_size = 0;
  std::uint32_t uncompressed_crc = 0;
  std::string_view compression = {};
  McapBytes records = {};
};
struct McapMessageIndex {
  std::uint16_t channel_id = 0;
  McapMap<std::uint64_t, std::uint64_t> entries = {};  // time, offset in the chunk's records
};
struct McapChunkIndex {
  std::uint64_t start_time = 0, end_time = 0, chunk_offset = 0, chunk_length = 0;
  McapMap<std::uint16_t, std::uint64_t> message_index_offsets = {};  // by channel
  std::uint64_t message_index_length = 0;
  std::string_view compression = {};
  std::uint64_t compressed_size = 0, uncompressed_size = 0;
};
struct McapAttachment {
  std::uint64_t log_time = 0, create_time = 0;
  std::string_view name = {}, media_type = {};
  McapBytes data = {};
  std::uint32_t crc = 0;
};
struct McapAttachmentIndex {
  std::uint64_t offset = 0, length = 0, log_time = 0, create_time = 0, data_size = 0;
  std::string_view name = {}, media_type = {};
};
struct McapStatistics {
  std::uint64_t message_count = 0;
  std::uint16_t schema_count = 0;
  std::uint32_t channel_count = 0, attachment_count = 0, metadata_count = 0, chunk_count = 0;
  std::uint64_t start_time = 0, end_time = 0;  // of messages; 0 without any
  McapMap<std::uint16_t, std::uint64_t> channel_message_counts = {};
};
struct McapMetadata {
  std::string_view name = {};
  McapTexts texts = {};
};
struct McapMetadataIndex {
  std::uint64_t offset = 0, length = 0;
  std::string_view name = {};
};
struct McapSummaryOffset {
  McapOp group = McapOp::schema;
  std::uint64_t start = 0, length = 0;
};
struct McapDataEnd {
  std::uint32_t data_section_crc = 0;
};

using McapRecord =
    std::variant<McapHeader, McapFooter, McapSchema, McapChannel, McapMessage, McapChunk, McapMessageIndex,
                 McapChunkIndex, McapAttachment, McapAttachmentIndex, McapStatistics, McapMetadata,
                 McapMetadataIndex, McapSummaryOffset, McapDataEnd>;

// Appends a record with its code and length. `padding`: behind the fields of records that may be extended
// (not of messages, chunks, the footer and the end of data), as files of later versions have it.
DOPPEL_API void append_record(const McapRecord& record, std::vector<std::byte>& out, McapBytes padding = {});

// The content of a record of a known code; bytes behind its fields are ignored. Throws InputError, rule
// "mcap.damaged", with the byte where it is too short; also for an unknown code. `offset`: where the content
// begins in the file.
[[nodiscard]] DOPPEL_API McapRecord parse_record(McapOp code, McapBytes content, std::uint64_t offset);

// CRC-32 of IEEE 802.3; `before`: that of the bytes before these, 0 at first.
[[nodiscard]] DOPPEL_API std::uint32_t mcap_crc(McapBytes bytes, std::uint32_t before = 0);

}  // namespace doppel
