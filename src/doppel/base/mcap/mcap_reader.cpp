#include "doppel/base/mcap/mcap_reader.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <map>
#include <queue>
#include <tuple>

#include "doppel/base/mcap/detail/damage.h"

namespace doppel {
namespace {

constexpr std::uint64_t kFooterSize = kMcapPrefixSize + 2 * sizeof(std::uint64_t) + sizeof(std::uint32_t);

template <class Info>
const Info* find_id(const std::vector<Info>& infos, std::uint16_t id) {
  const auto found = std::ranges::lower_bound(infos, id, {}, &Info::id);
  return found != infos.end() && found->id == id ? &*found : nullptr;
}

template <class Info>
void insert_id(std::vector<Info>& infos, Info info) {
  const auto behind = std::ranges::lower_bound(infos, info.id, {}, &Info::id);
  if (behind == infos.end() || behind->id != info.id) infos.insert(behind, std::move(info));
}

McapSchemaInfo info_of(const McapSchema& schema) {
  return {schema.id,
          std::string(schema.name),
          std::string(schema.encoding),
          {schema.data.begin(), schema.data.end()}};
}

McapChannelInfo info_of(const McapChannel& channel) {
  McapChannelInfo out{
      channel.id, channel.schema_id, std::string(channel.topic), std::string(channel.message_encoding), {},
      {}};
  for (const auto& [key, value] : channel.metadata) out.metadata.emplace_back(key, value);
  return out;
}

McapChunkInfo info_of(const McapChunkIndex& index) {
  return {index.start_time,
          index.end_time,
          index.chunk_offset,
          index.chunk_length,
          index.compressed_size,
          index.uncompressed_size,
          std::string(index.compression)};
}

// Gathers what a file contains from its records.
class Gatherer {
 public:
  McapContents out;

  void add_summary(const McapRecord& record) {
    if (const auto* schema = std::get_if<McapSchema>(&record)) insert_id(out.schemas, info_of(*schema));
    if (const auto* channel = std::get_if<McapChannel>(&record)) insert_id(out.channels, info_of(*channel));
    if (const auto* index = std::get_if<McapChunkIndex>(&record)) out.chunks.push_back(info_of(*index));
    if (const auto* part = std::get_if<McapAttachmentIndex>(&record))
      out.attachments.push_back({part->offset, part->length, std::string(part->name)});
    if (const auto* part = std::get_if<McapMetadataIndex>(&record))
      out.metadata.push_back({part->offset, part->length, std::string(part->name)});
    if (const auto* statistics = std::get_if<McapStatistics>(&record)) add_statistics(*statistics);
  }

  void add_data(const McapScanned& found) {
    if (const auto* header = std::get_if<McapHeader>(&found.record)) {
      out.profile = header->profile;
      out.library = header->library;
    } else if (const auto* chunk = std::get_if<McapChunk>(&found.record)) {
      add_chunk(*chunk, found);
    } else if (const auto* attachment = std::get_if<McapAttachment>(&found.record)) {
      out.attachments.push_back({found.offset, found.length, std::string(attachment->name)});
    } else if (const auto* metadata = std::get_if<McapMetadata>(&found.record)) {
      out.metadata.push_back({found.offset, found.length, std::string(metadata->name)});
    } else if (const auto* message = std::get_if<McapMessage>(&found.record)) {
      out.has_loose_messages = true;
      count(*message);
    } else if (found.code == McapOp::schema || found.code == McapOp::channel) {
      add_summary(found.record);
    }
  }

  // The counts of a scan.
  void finish_scan() {
    for (McapChannelInfo& channel : out.channels) channel.message_count = counts_[channel.id];
  }

 private:
  void add_statistics(const McapStatistics& statistics) {
    out.message_count = statistics.message_count;
    out.start_time = statistics.start_time;
    out.end_time = statistics.end_time;
    // An empty map is no statement; a channel that is not in a filled one has no messages.
    if (statistics.channel_message_counts.empty()) return;
    for (McapChannelInfo& channel : out.channels) channel.message_count = 0;
    for (const auto& [id, number] : statistics.channel_message_counts) {
      for (McapChannelInfo& channel : out.channels) {
        if (channel.id == id) channel.message_count = number;
      }
    }
  }

  void add_chunk(const McapChunk& chunk, const McapScanned& found) {
    const std::vector<std::byte> records = chunk_records(chunk, found.offset);
    McapChunkInfo info{0,
                       0,
                       found.offset,
                       found.length,
                       chunk.records.size(),
                       records.size(),
                       std::string(chunk.compression)};
    bool any = false;
    for_each_record(records, found.offset, [&](const McapRecord& record, std::size_t) {
      if (const auto* message = std::get_if<McapMessage>(&record)) {
        info.start_time = any ? std::min(info.start_time, message->log_time) : message->log_time;
        info.end_time = any ? std::max(info.end_time, message->log_time) : message->log_time;
        any = true;
        count(*message);
      } else {
        add_summary(record);
      }
      return true;
    });
    out.chunks.push_back(std::move(info));
  }

  void count(const McapMessage& message) {
    const bool is_first = out.message_count++ == 0;
    out.start_time = is_first ? message.log_time : std::min(out.start_time, message.log_time);
    out.end_time = is_first ? message.log_time : std::max(out.end_time, message.log_time);
    ++counts_[message.channel_id];
  }

  std::map<std::uint16_t, std::uint64_t> counts_;
};

McapContents scan(const McapSource& source) {
  Gatherer gatherer;
  McapScanner scanner(source);
  try {
    while (const McapScanned* found = scanner.next()) {
      if (found->code == McapOp::data_end) break;
      gatherer.add_data(*found);
      gatherer.out.whole = scanner.position();
    }
  } catch (const InputError& problem) {
    gatherer.out.damage = problem.diagnostics().front().message;
  }
  gatherer.finish_scan();
  return std::move(gatherer.out);
}

// nullopt: the file has no footer, or none with a summary of its chunks.
std::optional<McapContents> read_summary(const McapSource& source) {
  constexpr std::uint64_t kEnd = kFooterSize + kMcapMagicSize;
  if (source.size() < kMcapMagicSize + kEnd) return std::nullopt;
  const std::uint64_t footer_offset = source.size() - kEnd;
  std::vector<std::byte> end(kEnd);
  source.read(footer_offset, end);
  const McapBytes bytes(end);
  if (std::memcmp(&end[kFooterSize], kMcapMagic, kMcapMagicSize) != 0 || end[0] != std::byte{2})
    return std::nullopt;
  const auto footer = std::get<McapFooter>(
      parse_record(McapOp::footer, bytes.subspan(kMcapPrefixSize, kFooterSize - kMcapPrefixSize),
                   footer_offset + kMcapPrefixSize));
  if (footer.summary_start == 0) return std::nullopt;
  if (footer.summary_start >= footer_offset || footer_offset - footer.summary_start > kMaxMcapRecord)
    mcap_damaged(fmt::format("the footer names byte {} as the summary's", footer.summary_start));
  std::vector<std::byte> summary(static_cast<std::size_t>(footer_offset - footer.summary_start));
  source.read(footer.summary_start, summary);
  const McapBytes until_crc = bytes.first(kFooterSize - sizeof footer.summary_crc);
  if (footer.summary_crc != 0 && mcap_crc(until_crc, mcap_crc(summary)) != footer.summary_crc)
    mcap_damaged("the summary has another check sum than the footer says");
  Gatherer gatherer;
  for (std::size_t next = 0; next < summary.size();) {
    if (summary.size() - next < kMcapPrefixSize) mcap_damaged("the summary ends within a record");
    std::uint64_t length = 0;
    std::memcpy(&length, &summary[next + 1], sizeof length);
    const auto code = static_cast<McapOp>(summary[next]);
    next += kMcapPrefixSize;
    if (length > summary.size() - next) mcap_damaged("the summary ends within a record");
    if (code <= McapOp::data_end) {
      gatherer.add_summary(parse_record(code,
                                        McapBytes(summary).subspan(next, static_cast<std::size_t>(length)),
                                        footer.summary_start + next));
    }
    next += static_cast<std::size_t>(length);
  }
  gatherer.out.indexed = true;
  gatherer.out.whole = source.size();
  return std::move(gatherer.out);
}

}  // namespace

const McapChannelInfo* McapContents::channel(std::uint16_t id) const {
  return find_id(channels, id);
}
const McapSchemaInfo* McapContents::schema(std::uint16_t id) const {
  return find_id(schemas, id);
}

// Not in an anonymous namespace, because McapReader::Impl, which contains it, has external linkage.
// One message of a chunk that is held, by its time and its place in the file.
struct McapEntry {
  std::uint64_t time = 0;
  std::uint64_t chunk = 0, offset = 0;  // index of the chunk, offset in its records
  bool operator>(const McapEntry& other) const {
    return std::tie(time, chunk, offset) > std::tie(other.time, other.chunk, other.offset);
  }
};

struct McapReader::Impl {
  std::unique_ptr<McapSource> source;
  McapContents contents;

  McapRange range;
  std::vector<std::size_t> order;  // of chunks by their start
  std::size_t next_chunk = 0;      // in `order`
  std::priority_queue<McapEntry, std::vector<McapEntry>, std::greater<>> entries;
  struct Held {
    std::vector<std::byte> records;
    std::size_t left = 0;  // entries that are not yet read
  };
  std::map<std::size_t, Held> held;
  std::optional<std::size_t> finished;  // a chunk whose last message was handed out
  std::vector<std::byte> part_bytes;

  // A summary without chunks and with messages is one of a file whose messages are outside of chunks.
  void open(bool allow_scan) {
    (void)McapScanner(*source);  // refuses another beginning
    std::optional<McapContents> summary;
    try {
      summary = read_summary(*source);
    } catch (const InputError&) {
      if (!allow_scan) throw;
    }
    const bool is_usable =
        summary && (!summary->chunks.empty() || summary->message_count == 0) && has_every_channel(*summary);
    contents = is_usable ? *std::move(summary) : scan(*source);
    if (is_usable) read_header();
  }

  // A summary may leave out what its chunks need.
  [[nodiscard]] static bool has_every_channel(const McapContents& summary) {
    return summary.chunks.empty() || !summary.channels.empty();
  }

  void read_header() {
    McapScanner scanner(*source);
    const McapScanned* const first = scanner.next();
    if (first == nullptr || first->code != McapOp::header) return;
    const auto& header = std::get<McapHeader>(first->record);
    contents.profile = header.profile;
    contents.library = header.library;
  }

  [[nodiscard]] bool includes(const McapMessage& message) const {
    return message.log_time >= range.start && message.log_time < range.end &&
           (range.channels.empty() ||
            std::ranges::find(range.channels, message.channel_id) != range.channels.end());
  }

  void take(std::size_t chunk, Held held_records, std::uint64_t offset) {
    for_each_record(held_records.records, offset, [&](const McapRecord& record, std::size_t place) {
      const auto* const message = std::get_if<McapMessage>(&record);
      if (message == nullptr || !includes(*message)) return true;
      entries.push({message->log_time, chunk, place});
      ++held_records.left;
      return true;
    });
    if (held_records.left > 0) held.emplace(chunk, std::move(held_records));
  }

  void load(std::size_t index) {
    const McapChunkInfo& info = contents.chunks[index];
    std::vector<std::byte> bytes;
    const McapRecord record = read_record(info.offset, info.length, bytes);
    const auto* const chunk = std::get_if<McapChunk>(&record);
    if (chunk == nullptr)
      mcap_damaged(fmt::format("the index names byte {} as a chunk's, which it is not", info.offset));
    take(index, {chunk_records(*chunk, info.offset)}, info.offset);
  }

  // Messages outside of chunks, as if they were one chunk.
  void load_loose() {
    std::vector<std::byte> records;
    McapScanner scanner(*source);
    while (scanner.position() < contents.whole) {
      const McapScanned* const found = scanner.next();
      if (found == nullptr || found->code == McapOp::data_end) break;
      if (found->code == McapOp::message) append_record(found->record, records);
    }
    take(contents.chunks.size(), {std::move(records)}, 0);
  }

  McapRecord read_record(std::uint64_t offset, std::uint64_t length, std::vector<std::byte>& bytes) {
    if (length < kMcapPrefixSize || length > kMaxMcapRecord || offset > source->size() ||
        length > source->size() - offset)
      mcap_damaged(fmt::format("the index names {} bytes from byte {} on, beyond the file", length, offset));
    bytes.resize(static_cast<std::size_t>(length));
    source->read(offset, bytes);
    std::uint64_t content = 0;
    std::memcpy(&content, &bytes[1], sizeof content);
    if (content != length - kMcapPrefixSize)
      mcap_damaged(fmt::format("the record at byte {} has another length than the index says", offset));
    return parse_record(static_cast<McapOp>(bytes[0]), McapBytes(bytes).subspan(kMcapPrefixSize),
                        offset + kMcapPrefixSize);
  }
};

McapReader::McapReader(std::unique_ptr<McapSource> source, bool allow_scan)
    : impl_(std::make_unique<Impl>()) {
  impl_->source = std::move(source);
  impl_->open(allow_scan);
  seek({});
}
McapReader::~McapReader() = default;
McapReader::McapReader(McapReader&&) noexcept = default;

const McapContents& McapReader::contents() const {
  return impl_->contents;
}

void McapReader::seek(McapRange range) {
  Impl& m = *impl_;
  m.range = std::move(range);
  m.order.clear();
  m.next_chunk = 0;
  m.entries = {};
  m.held.clear();
  m.finished.reset();
  for (std::size_t i = 0; i < m.contents.chunks.size(); ++i) {
    const McapChunkInfo& chunk = m.contents.chunks[i];
    if (chunk.end_time >= m.range.start && chunk.start_time < m.range.end) m.order.push_back(i);
  }
  std::ranges::stable_sort(m.order, {}, [&m](std::size_t i) { return m.contents.chunks[i].start_time; });
  if (m.contents.has_loose_messages) m.load_loose();
}

std::optional<McapMessage> McapReader::next() {
  Impl& m = *impl_;
  if (m.finished) m.held.erase(*m.finished);
  m.finished.reset();
  // A chunk whose messages may be earlier than, or as early as, the next one must be read first.
  while (m.next_chunk < m.order.size() &&
         (m.entries.empty() || m.contents.chunks[m.order[m.next_chunk]].start_time <= m.entries.top().time))
    m.load(m.order[m.next_chunk++]);
  if (m.entries.empty()) return std::nullopt;
  const McapEntry entry = m.entries.top();
  m.entries.pop();
  Impl::Held& held = m.held.at(entry.chunk);
  if (--held.left == 0) m.finished = entry.chunk;
  std::size_t offset = entry.offset;
  return std::get<McapMessage>(*next_chunk_record(held.records, offset, 0));
}

McapRecord McapReader::part(const McapNamedPart& part) {
  McapRecord record = impl_->read_record(part.offset, part.length, impl_->part_bytes);
  const auto* const attachment = std::get_if<McapAttachment>(&record);
  const McapBytes content = McapBytes(impl_->part_bytes).subspan(kMcapPrefixSize);
  if (attachment != nullptr && !is_whole(*attachment, content)) {
    throw InputError("mcap.damaged", {},
                     fmt::format("the attachment '{}' at byte {} has another check sum than its data",
                                 attachment->name, part.offset),
                     "doppel bag recover writes a copy without it");
  }
  return record;
}

}  // namespace doppel
