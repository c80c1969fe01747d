#include "doppel/base/mcap/mcap_writer.h"

#include <algorithm>
#include <utility>

#include "doppel/base/mcap/detail/compression.h"

namespace doppel {
namespace {

void widen(std::uint64_t& start, std::uint64_t& end, std::uint64_t time, bool is_first) {
  start = is_first ? time : std::min(start, time);
  end = is_first ? time : std::max(end, time);
}

void append(const std::vector<std::byte>& bytes, std::vector<std::byte>& out) {
  out.insert(out.end(), bytes.begin(), bytes.end());
}

McapBytes magic() {
  return std::as_bytes(std::span(kMcapMagic));
}

}  // namespace

McapWriter::McapWriter(McapSink& sink, McapWriterOptions options)
    : sink_(sink), options_(std::move(options)) {
  bytes_.assign(magic().begin(), magic().end());
  append_record(McapHeader{options_.profile, options_.library}, bytes_, options_.padding);
  hand_out(bytes_);
}

void McapWriter::hand_out(std::vector<std::byte>& bytes) {
  data_crc_ = mcap_crc(bytes, data_crc_);
  sink_.write(bytes);
  size_ += bytes.size();
  bytes.clear();
}

// Into the chunk, or without chunks into the file.
void McapWriter::add_record(const McapRecord& record) {
  if (options_.chunk_size > 0) {
    append_record(record, chunk_records_);
  } else {
    append_record(record, bytes_, options_.padding);
    hand_out(bytes_);
    messages_out_ = statistics_.message_count;
  }
}

std::uint16_t McapWriter::add_schema(std::string_view name, std::string_view encoding, McapBytes data) {
  const McapSchema schema{++schemas_, name, encoding, data};
  ++statistics_.schema_count;
  add_record(schema);
  append_record(schema, schema_records_, options_.padding);
  return schemas_;
}

std::uint16_t McapWriter::add_channel(std::uint16_t schema, std::string_view topic,
                                      std::string_view message_encoding, const McapTexts& metadata) {
  const McapChannel channel{++channels_, schema, topic, message_encoding, metadata};
  ++statistics_.channel_count;
  add_record(channel);
  append_record(channel, channel_records_, options_.padding);
  return channels_;
}

void McapWriter::write(const McapMessage& message) {
  widen(statistics_.start_time, statistics_.end_time, message.log_time, statistics_.message_count == 0);
  ++statistics_.message_count;
  auto& counts = statistics_.channel_message_counts;
  const auto [count, is_new] = count_of_.try_emplace(message.channel_id, counts.size());
  if (is_new) counts.emplace_back(message.channel_id, 0);
  ++counts[count->second].second;
  if (options_.chunk_size > 0) {
    widen(chunk_start_time_, chunk_end_time_, message.log_time, !chunk_has_messages_);
    chunk_has_messages_ = true;
    if (options_.message_index) {
      auto& entries = chunk_index_[message.channel_id];
      if (entries.empty()) chunk_channels_.push_back(message.channel_id);
      entries.emplace_back(message.log_time, chunk_records_.size());
    }
  }
  add_record(message);
  if (options_.chunk_size > 0 && chunk_records_.size() >= options_.chunk_size) flush();
}

void McapWriter::attach(McapAttachment attachment) {
  flush();
  // The crc is that of the fields before it.
  append_record(attachment, bytes_);
  attachment.crc = mcap_crc(
      McapBytes(bytes_).subspan(kMcapPrefixSize, bytes_.size() - kMcapPrefixSize - sizeof attachment.crc));
  bytes_.clear();
  append_record(attachment, bytes_, options_.padding);
  if (options_.attachment_index) {
    append_record(McapAttachmentIndex{size_, bytes_.size(), attachment.log_time, attachment.create_time,
                                      attachment.data.size(), attachment.name, attachment.media_type},
                  attachment_indexes_, options_.padding);
  }
  ++statistics_.attachment_count;
  hand_out(bytes_);
}

void McapWriter::add_metadata(std::string_view name, const McapTexts& texts) {
  flush();
  append_record(McapMetadata{name, texts}, bytes_, options_.padding);
  if (options_.metadata_index)
    append_record(McapMetadataIndex{size_, bytes_.size(), name}, metadata_indexes_, options_.padding);
  ++statistics_.metadata_count;
  hand_out(bytes_);
}

// The message indexes behind the chunk, which ends at `size_` plus what is in `bytes`.
void McapWriter::append_indexes(McapChunkIndex& index, std::vector<std::byte>& bytes) {
  const std::size_t start = bytes.size();
  for (const std::uint16_t channel : chunk_channels_) {
    auto& entries = chunk_index_[channel];
    index.message_index_offsets.emplace_back(channel, size_ + bytes.size());
    append_record(McapMessageIndex{channel, std::move(entries)}, bytes, options_.padding);
    entries.clear();
  }
  chunk_channels_.clear();
  index.message_index_length = bytes.size() - start;
}

void McapWriter::flush() {
  if (chunk_records_.empty()) return;
  std::vector<std::byte> compressed;
  compress(options_.compression, options_.level, chunk_records_, compressed);
  const McapChunk chunk{chunk_start_time_,        chunk_end_time_,      chunk_records_.size(),
                        mcap_crc(chunk_records_), options_.compression, compressed};
  McapChunkIndex index{chunk.start_time, chunk.end_time, size_};
  append_record(chunk, bytes_);
  index.chunk_length = bytes_.size();
  append_indexes(index, bytes_);
  index.compression = options_.compression;
  index.compressed_size = compressed.size();
  index.uncompressed_size = chunk_records_.size();
  if (options_.chunk_index) append_record(index, chunk_indexes_, options_.padding);
  ++statistics_.chunk_count;
  hand_out(bytes_);
  messages_out_ = statistics_.message_count;
  chunk_records_.clear();
  chunk_start_time_ = chunk_end_time_ = 0;
  chunk_has_messages_ = false;
}

std::vector<std::byte> McapWriter::summary() {
  std::vector<std::byte> out, offsets;
  const std::uint64_t start = size_;
  const auto group = [&](McapOp code, const std::vector<std::byte>& records) {
    if (records.empty()) return;
    append_record(McapSummaryOffset{code, start + out.size(), records.size()}, offsets, options_.padding);
    append(records, out);
  };
  if (options_.repeated_schemas) group(McapOp::schema, schema_records_);
  if (options_.repeated_channels) group(McapOp::channel, channel_records_);
  if (options_.statistics) {
    std::vector<std::byte> record;
    append_record(statistics_, record, options_.padding);
    group(McapOp::statistics, record);
  }
  group(McapOp::metadata_index, metadata_indexes_);
  group(McapOp::attachment_index, attachment_indexes_);
  group(McapOp::chunk_index, chunk_indexes_);
  McapFooter footer{out.empty() ? 0 : start};
  if (options_.summary_offsets && !offsets.empty()) {
    footer.summary_offset_start = start + out.size();
    append(offsets, out);
  }
  append_record(footer, out);
  // The crc covers everything before itself.
  footer.summary_crc = mcap_crc(McapBytes(out).first(out.size() - sizeof footer.summary_crc));
  out.resize(out.size() - kMcapPrefixSize - 2 * sizeof(std::uint64_t) - sizeof footer.summary_crc);
  append_record(footer, out);
  out.insert(out.end(), magic().begin(), magic().end());
  return out;
}

void McapWriter::close() {
  flush();
  append_record(McapDataEnd{data_crc_}, bytes_);
  hand_out(bytes_);
  std::vector<std::byte> end = summary();
  hand_out(end);
}

}  // namespace doppel
