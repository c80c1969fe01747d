#pragma once
// Writes an MCAP file record by record:
//
//   McapWriter writer(sink, {});
//   const auto schema = writer.add_schema("std_msgs/msg/String", "ros2msg", text);
//   const auto channel = writer.add_channel(schema, "/chatter", "cdr", {});
//   writer.write({channel, 0, log_time, publish_time, cdr});
//   writer.close();
//
// The same calls give the same bytes. What was handed to the sink is readable, also of a file that is never
// closed: a scanner finds it (mcap_scanner.h).

#include <map>
#include <string>
#include <vector>

#include "doppel/base/mcap/mcap_records.h"
#include "doppel/export.h"

namespace doppel {

class DOPPEL_API McapSink {
 public:
  virtual ~McapSink() = default;
  // Appends. May throw, for instance when the disk is full; the writer is then of no use.
  virtual void write(McapBytes bytes) = 0;
};

struct McapWriterOptions {
  std::string profile = "ros2", library = "doppel";
  std::size_t chunk_size = 1U << 20U;             // bytes of records after which a chunk ends; 0: no chunks
  std::string compression = "zstd";               // "lz4", "" for none
  int level = 1;                                  // of zstd
  bool message_index = true, chunk_index = true;  // of chunks
  bool repeated_schemas = true, repeated_channels = true, statistics = true, attachment_index = true,
       metadata_index = true, summary_offsets = true;  // of the summary
  std::vector<std::byte> padding = {};                 // append_record(); not within chunks
};

class DOPPEL_API McapWriter {
 public:
  // Writes the beginning of the file. `sink` outlives the writer.
  McapWriter(McapSink& sink, McapWriterOptions options);

  // The number of the schema, from 1 on.
  std::uint16_t add_schema(std::string_view name, std::string_view encoding, McapBytes data);
  // schema: 0 for none.
  std::uint16_t add_channel(std::uint16_t schema, std::string_view topic, std::string_view message_encoding,
                            const McapTexts& metadata);
  // Precondition: channel_id is that of add_channel().
  void write(const McapMessage& message);
  // Its crc is computed.
  void attach(McapAttachment attachment);
  void add_metadata(std::string_view name, const McapTexts& texts);

  // Ends the chunk, so that its messages are in the file.
  void flush();
  // Writes the summary. Nothing may be added afterwards.
  void close();

  [[nodiscard]] std::uint64_t size() const { return size_; }  // bytes handed to the sink
  [[nodiscard]] std::size_t pending() const {
    return chunk_records_.size();
  }  // bytes of records in the chunk
  [[nodiscard]] std::uint64_t message_count() const { return statistics_.message_count; }
  [[nodiscard]] std::uint64_t messages_out() const { return messages_out_; }  // those that the sink has taken

 private:
  void add_record(const McapRecord& record);
  void hand_out(std::vector<std::byte>& bytes);
  void append_indexes(McapChunkIndex& index, std::vector<std::byte>& bytes);
  std::vector<std::byte> summary();

  McapSink& sink_;
  McapWriterOptions options_;
  std::uint64_t size_ = 0;
  std::uint32_t data_crc_ = 0;
  std::vector<std::byte> bytes_;  // what is handed out next
  std::vector<std::byte> chunk_records_;
  std::uint64_t chunk_start_time_ = 0, chunk_end_time_ = 0;
  bool chunk_has_messages_ = false;
  std::vector<std::uint16_t> chunk_channels_;  // in the order of their first message
  std::map<std::uint16_t, McapMap<std::uint64_t, std::uint64_t>> chunk_index_;  // time, offset
  std::uint16_t schemas_ = 0, channels_ = 0;
  // The groups of the summary, encoded.
  std::vector<std::byte> schema_records_, channel_records_, metadata_indexes_, attachment_indexes_,
      chunk_indexes_;
  McapStatistics statistics_;
  std::uint64_t messages_out_ = 0;
  std::map<std::uint16_t, std::size_t> count_of_;  // index in channel_message_counts
};

}  // namespace doppel
