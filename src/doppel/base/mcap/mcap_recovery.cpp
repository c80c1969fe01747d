#include "doppel/base/mcap/mcap_recovery.h"

#include <fmt/format.h>

#include <map>
#include <memory>
#include <optional>
#include <set>

#include "doppel/base/core/diagnostic.h"
#include "doppel/base/core/sha256.h"
#include "doppel/base/mcap/mcap_reader.h"

namespace doppel {
namespace {

constexpr std::size_t kMaxProblems = 100;

std::string reason_of(const InputError& problem) {
  return problem.diagnostics().front().message;
}

std::string damaged(const McapAttachment& attachment, const McapScanned& found) {
  return fmt::format("the attachment '{}' at byte {} has another check sum than its data", attachment.name,
                     found.offset);
}

// The schemas and channels of a file, of which none has two meanings and each channel a schema that came
// before.
class Definitions {
 public:
  // The problem of a record; empty: there is none, or it defines nothing.
  std::string add(const McapRecord& record, std::uint64_t offset) {
    if (const auto* schema = std::get_if<McapSchema>(&record)) return add(*schema, offset);
    if (const auto* channel = std::get_if<McapChannel>(&record)) return add(*channel, offset);
    return "";
  }
  [[nodiscard]] bool has_channel(std::uint16_t id) const { return channels_.contains(id); }

 private:
  std::string add(const McapSchema& schema, std::uint64_t offset) {
    if (schema.id == 0)
      return fmt::format("the schema '{}' at byte {} has the number 0, which means none", schema.name,
                         offset);
    return is_same(schemas_[schema.id], schema)
               ? ""
               : fmt::format("the schema {} ('{}') at byte {} is not the one of this number before it",
                             schema.id, schema.name, offset);
  }

  std::string add(const McapChannel& channel, std::uint64_t offset) {
    if (!is_same(channels_[channel.id], channel))
      return fmt::format("the channel {} ('{}') at byte {} is not the one of this number before it",
                         channel.id, channel.topic, offset);
    if (channel.schema_id != 0 && !schemas_.contains(channel.schema_id))
      return fmt::format("the channel {} ('{}') at byte {} is of schema {}, which is not described before it",
                         channel.id, channel.topic, offset, channel.schema_id);
    return "";
  }

  static bool is_same(std::optional<Sha256>& first, const McapRecord& record) {
    std::vector<std::byte> bytes;
    append_record(record, bytes);
    const Sha256 hash = sha256(bytes);
    if (!first) first = hash;
    return *first == hash;
  }

  // The hashes of their records by number, because a record may be large.
  std::map<std::uint16_t, std::optional<Sha256>> schemas_, channels_;
};

// Compares what a file says of itself with what it has.
class Checker {
 public:
  Checker(const McapSource& source, const McapProgress& progress) : source_(source), progress_(progress) {}

  McapCheck run() {
    McapScanner scanner(source_);
    crc_ = mcap_crc(std::as_bytes(std::span(kMcapMagic)));
    try {
      while (const McapScanned* found = scanner.next()) {
        look_at(*found);
        if (progress_ &&
            !progress_(static_cast<double>(scanner.position()) / static_cast<double>(source_.size())))
          return std::move(out_);
      }
    } catch (const InputError& problem) {
      complain(reason_of(problem));
    }
    out_.closed = scanner.complete();
    if (!out_.closed && out_.problems.empty())
      complain(
          fmt::format("the file ends at byte {} without a summary: it was not closed", scanner.position()));
    if (out_.closed) compare_summary();
    return std::move(out_);
  }

 private:
  void complain(std::string what) {
    if (out_.problems.size() < kMaxProblems) out_.problems.push_back(std::move(what));
  }

  void look_at(const McapScanned& found) {
    if (const auto* end = std::get_if<McapDataEnd>(&found.record)) {
      if (end->data_section_crc != 0 && end->data_section_crc != crc_)
        complain(fmt::format("the data before byte {} have another check sum than is written there",
                             found.offset));
      is_data_ = false;
    }
    define(found.record, found.offset);
    if (!is_data_) return;
    crc_ = mcap_crc(found.bytes, crc_);
    if (const auto* chunk = std::get_if<McapChunk>(&found.record)) look_into(*chunk, found);
    if (const auto* index = std::get_if<McapMessageIndex>(&found.record)) compare(*index, found.offset);
    if (const auto* message = std::get_if<McapMessage>(&found.record)) count(*message, found.offset);
    if (const auto* attachment = std::get_if<McapAttachment>(&found.record)) {
      if (!is_whole(*attachment, found.bytes.subspan(kMcapPrefixSize))) complain(damaged(*attachment, found));
    }
  }

  void look_into(const McapChunk& chunk, const McapScanned& found) {
    ++out_.chunks;
    in_chunk_.clear();
    try {
      for_each_record(chunk_records(chunk, found.offset), found.offset,
                      [&](const McapRecord& record, std::size_t place) {
                        define(record, found.offset);
                        if (const auto* message = std::get_if<McapMessage>(&record)) {
                          count(*message, found.offset);
                          in_chunk_[message->channel_id].insert({message->log_time, place});
                        }
                        return true;
                      });
    } catch (const InputError& problem) {
      complain(reason_of(problem));
    }
    chunk_offsets_.insert(found.offset);
  }

  void define(const McapRecord& record, std::uint64_t offset) {
    if (std::string problem = definitions_.add(record, offset); !problem.empty())
      complain(std::move(problem));
  }

  // The index of a channel, which comes behind its chunk, has the time and the place of each of its messages.
  void compare(const McapMessageIndex& index, std::uint64_t offset) {
    const Messages listed(index.entries.begin(), index.entries.end());
    if (listed != in_chunk_[index.channel_id])
      complain(
          fmt::format("the message index of channel {} at byte {} does not list the messages of its chunk",
                      index.channel_id, offset));
  }

  void count(const McapMessage& message, std::uint64_t offset) {
    ++out_.messages;
    if (!definitions_.has_channel(message.channel_id))
      complain(fmt::format("a message at byte {} is of channel {}, which is not described before it", offset,
                           message.channel_id));
  }

  void compare_summary() {
    try {
      const McapReader reader(wrap(source_), false);
      const McapContents& summary = reader.contents();
      if (!summary.indexed) return;
      if (summary.message_count != out_.messages && out_.problems.empty())
        complain(fmt::format("the summary counts {} messages, but there are {}", summary.message_count,
                             out_.messages));
      for (const McapChunkInfo& chunk : summary.chunks) {
        if (!chunk_offsets_.contains(chunk.offset))
          complain(fmt::format("the summary has a chunk at byte {}, where there is none", chunk.offset));
      }
    } catch (const InputError& problem) {
      complain(reason_of(problem));
    }
  }

  // A source that somebody else holds.
  static std::unique_ptr<McapSource> wrap(const McapSource& source) {
    struct Borrowed : McapSource {
      explicit Borrowed(const McapSource& the_source) : source(the_source) {}
      [[nodiscard]] std::uint64_t size() const override { return source.size(); }
      void read(std::uint64_t offset, std::span<std::byte> out) const override { source.read(offset, out); }
      const McapSource& source;
    };
    return std::make_unique<Borrowed>(source);
  }

  const McapSource& source_;
  const McapProgress& progress_;
  McapCheck out_;
  bool is_data_ = true;
  std::uint32_t crc_ = 0;
  Definitions definitions_;
  using Messages =
      std::set<std::pair<std::uint64_t, std::uint64_t>>;  // log time, offset in the chunk's records
  std::map<std::uint16_t, Messages> in_chunk_;            // of the last chunk, by channel
  std::set<std::uint64_t> chunk_offsets_;
};

class Recoverer {
 public:
  Recoverer(const McapSource& source, McapSink& sink, McapWriterOptions options, const McapProgress& progress)
      : source_(source), sink_(sink), options_(std::move(options)), progress_(progress) {}

  McapRecovery run() {
    McapScanner scanner(source_);
    for (bool more = true; more;) {
      const std::uint64_t start = scanner.position();
      try {
        more = step(scanner);
      } catch (const InputError& problem) {
        out_.losses.push_back(reason_of(problem));
        const bool found = scanner.find_next_chunk();
        out_.damaged_bytes += (found ? scanner.position() : source_.size()) - start;
        more = found;
      }
    }
    writer().close();
    return std::move(out_);
  }

 private:
  // False: the data end here.
  bool step(McapScanner& scanner) {
    const McapScanned* const found = scanner.next();
    if (found == nullptr || found->code == McapOp::data_end) return false;
    if (progress_ &&
        !progress_(static_cast<double>(scanner.position()) / static_cast<double>(source_.size()))) {
      out_.cancelled = true;
      return false;
    }
    if (const auto* header = std::get_if<McapHeader>(&found->record)) {
      options_.profile = header->profile;
      options_.library = header->library;
    } else if (const auto* chunk = std::get_if<McapChunk>(&found->record)) {
      take_chunk(*chunk, *found);
    } else if (const auto* attachment = std::get_if<McapAttachment>(&found->record);
               attachment != nullptr && !is_whole(*attachment, found->bytes.subspan(kMcapPrefixSize))) {
      out_.losses.push_back(damaged(*attachment, *found));
      out_.damaged_bytes += found->length;
    } else {
      take(found->record, found->offset);
    }
    return true;
  }

  void take_chunk(const McapChunk& chunk, const McapScanned& found) {
    try {
      for_each_record(chunk_records(chunk, found.offset), found.offset,
                      [&](const McapRecord& record, std::size_t) {
                        take(record, found.offset);
                        return true;
                      });
    } catch (const InputError& problem) {
      out_.losses.push_back(reason_of(problem));
      out_.damaged_bytes += found.length;
    }
  }

  void take(const McapRecord& record, std::uint64_t offset) {
    if (const auto* schema = std::get_if<McapSchema>(&record)) {
      if (schema->id != 0 && !schemas_.contains(schema->id))
        schemas_[schema->id] = writer().add_schema(schema->name, schema->encoding, schema->data);
    } else if (const auto* channel = std::get_if<McapChannel>(&record)) {
      if (channels_.contains(channel->id)) return;
      const auto schema_of = schemas_.find(channel->schema_id);
      channels_[channel->id] =
          writer().add_channel(schema_of == schemas_.end() ? 0 : schema_of->second, channel->topic,
                               channel->message_encoding, channel->metadata);
    } else if (const auto* message = std::get_if<McapMessage>(&record)) {
      take_message(*message, offset);
    } else if (const auto* attachment = std::get_if<McapAttachment>(&record)) {
      writer().attach(*attachment);
      ++out_.attachments;
    } else if (const auto* metadata = std::get_if<McapMetadata>(&record)) {
      writer().add_metadata(metadata->name, metadata->texts);
      ++out_.metadata;
    }
  }

  void take_message(McapMessage message, std::uint64_t offset) {
    const auto channel = channels_.find(message.channel_id);
    if (channel == channels_.end()) {
      if (strays_.insert(message.channel_id).second) {
        out_.losses.push_back(
            fmt::format("messages of channel {}, the first at byte {}, whose description is lost",
                        message.channel_id, offset));
      }
      return;
    }
    message.channel_id = channel->second;
    writer().write(message);
    ++out_.messages;
  }

  // The header comes first in a file, also in a damaged one without it.
  McapWriter& writer() {
    if (!writer_) writer_.emplace(sink_, options_);
    return *writer_;
  }

  const McapSource& source_;
  McapSink& sink_;
  McapWriterOptions options_;
  const McapProgress& progress_;
  std::optional<McapWriter> writer_;
  std::map<std::uint16_t, std::uint16_t> schemas_, channels_;  // ids of the file, and of the copy
  std::set<std::uint16_t> strays_;
  McapRecovery out_;
};

}  // namespace

McapCheck check_mcap(const McapSource& source, const McapProgress& progress) {
  return Checker(source, progress).run();
}

McapRecovery recover_mcap(const McapSource& source, McapSink& sink, McapWriterOptions options,
                          const McapProgress& progress) {
  return Recoverer(source, sink, std::move(options), progress).run();
}

}  // namespace doppel
