#include "doppel/base/mcap/mcap_records.h"

#include <fmt/format.h>

#include <array>
#include <bit>
#include <cstring>

#include "doppel/base/core/diagnostic.h"
#include "doppel/base/core/overloaded.h"

namespace doppel {
namespace {

static_assert(std::endian::native == std::endian::little);

// Writes the fields of records in their order.
class FieldWriter {
 public:
  explicit FieldWriter(std::vector<std::byte>& out) : out_(out) {}

  template <class T>
  requires std::is_arithmetic_v<T>
  void operator()(const T& value) { raw(&value, sizeof value); }
  void operator()(McapOp code) { (*this)(static_cast<std::uint8_t>(code)); }
  void operator()(std::string_view text) {
    (*this)(static_cast<std::uint32_t>(text.size()));
    raw(text.data(), text.size());
  }
  template <class Key, class Value>
  void operator()(const McapMap<Key, Value>& map) {
    const std::size_t start = out_.size();
    (*this)(std::uint32_t{0});
    for (const auto& [key, value] : map) {
      (*this)(key);
      (*this)(value);
    }
    const auto length = static_cast<std::uint32_t>(out_.size() - start - sizeof(std::uint32_t));
    std::memcpy(&out_[start], &length, sizeof length);
  }
  template <class Length>
  void sized(McapBytes& bytes) {
    (*this)(static_cast<Length>(bytes.size()));
    rest(bytes);
  }
  void rest(McapBytes& bytes) { raw(bytes.data(), bytes.size()); }

 private:
  void raw(const void* data, std::size_t size) {
    const auto* const bytes = static_cast<const std::byte*>(data);
    out_.insert(out_.end(), bytes, bytes + size);
  }
  std::vector<std::byte>& out_;
};

// Reads them, and knows where in the file they end too early.
class FieldReader {
 public:
  FieldReader(McapBytes content, std::uint64_t offset) : content_(content), offset_(offset) {}

  template <class T>
  requires std::is_arithmetic_v<T>
  void operator()(T& value) { std::memcpy(&value, take(sizeof value).data(), sizeof value); }
  void operator()(McapOp& code) {
    std::uint8_t value = 0;
    (*this)(value);
    code = static_cast<McapOp>(value);
  }
  void operator()(std::string_view& text) {
    std::uint32_t size = 0;
    (*this)(size);
    const McapBytes bytes = take(size);
    text = {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
  }
  template <class Key, class Value>
  void operator()(McapMap<Key, Value>& map) {
    std::uint32_t size = 0;
    (*this)(size);
    const std::uint64_t start = offset_ + next_;
    FieldReader inner(take(size), start);
    while (inner.next_ < inner.content_.size()) {
      auto& [key, value] = map.emplace_back();
      inner(key);
      inner(value);
    }
  }
  template <class Length>
  void sized(McapBytes& bytes) {
    Length size = 0;
    (*this)(size);
    bytes = take(size);
  }
  void rest(McapBytes& bytes) { bytes = take(content_.size() - next_); }

 private:
  McapBytes take(std::uint64_t size) {
    if (size > content_.size() - next_) {
      throw InputError("mcap.damaged", {},
                       fmt::format("a record ends at byte {}, within a field of {} bytes at byte {}",
                                   offset_ + content_.size(), size, offset_ + next_));
    }
    const McapBytes out = content_.subspan(next_, static_cast<std::size_t>(size));
    next_ += static_cast<std::size_t>(size);
    return out;
  }

  McapBytes content_;
  std::uint64_t offset_;
  std::size_t next_ = 0;
};

// The fields of each record, for both directions.
template <class Codec>
void fields(Codec& codec, McapHeader& r) {
  codec(r.profile), codec(r.library);
}
template <class Codec>
void fields(Codec& codec, McapFooter& r) {
  codec(r.summary_start), codec(r.summary_offset_start), codec(r.summary_crc);
}
template <class Codec>
void fields(Codec& codec, McapSchema& r) {
  codec(r.id), codec(r.name), codec(r.encoding);
  codec.template sized<std::uint32_t>(r.data);
}
template <class Codec>
void fields(Codec& codec, McapChannel& r) {
  codec(r.id), codec(r.schema_id), codec(r.topic), codec(r.message_encoding), codec(r.metadata);
}
template <class Codec>
void fields(Codec& codec, McapMessage& r) {
  codec(r.channel_id), codec(r.sequence), codec(r.log_time), codec(r.publish_time);
  codec.rest(r.data);
}
template <class Codec>
void fields(Codec& codec, McapChunk& r) {
  codec(r.start_time), codec(r.end_time), codec(r.uncompressed_size), codec(r.uncompressed_crc);
  codec(r.compression);
  codec.template sized<std::uint64_t>(r.records);
}
template <class Codec>
void fields(Codec& codec, McapMessageIndex& r) {
  codec(r.channel_id), codec(r.entries);
}
template <class Codec>
void fields(Codec& codec, McapChunkIndex& r) {
  codec(r.start_time), codec(r.end_time), codec(r.chunk_offset), codec(r.chunk_length);
  codec(r.message_index_offsets), codec(r.message_index_length), codec(r.compression);
  codec(r.compressed_size), codec(r.uncompressed_size);
}
template <class Codec>
void fields(Codec& codec, McapAttachment& r) {
  codec(r.log_time), codec(r.create_time), codec(r.name), codec(r.media_type);
  codec.template sized<std::uint64_t>(r.data);
  codec(r.crc);
}
template <class Codec>
void fields(Codec& codec, McapAttachmentIndex& r) {
  codec(r.offset), codec(r.length), codec(r.log_time), codec(r.create_time), codec(r.data_size);
  codec(r.name), codec(r.media_type);
}
template <class Codec>
void fields(Codec& codec, McapStatistics& r) {
  codec(r.message_count), codec(r.schema_count), codec(r.channel_count), codec(r.attachment_count);
  codec(r.metadata_count), codec(r.chunk_count), codec(r.start_time), codec(r.end_time);
  codec(r.channel_message_counts);
}
template <class Codec>
void fields(Codec& codec, McapMetadata& r) {
  codec(r.name), codec(r.texts);
}
template <class Codec>
void fields(Codec& codec, McapMetadataIndex& r) {
  codec(r.offset), codec(r.length), codec(r.name);
}
template <class Codec>
void fields(Codec& codec, McapSummaryOffset& r) {
  codec(r.group), codec(r.start), codec(r.length);
}
template <class Codec>
void fields(Codec& codec, McapDataEnd& r) {
  codec(r.data_section_crc);
}

// Codes are those of the alternatives' order, from 1 on.
template <std::size_t... index>
McapRecord parse_alternative(std::size_t alternative, FieldReader& reader, std::index_sequence<index...>) {
  McapRecord out;
  const auto read = [&]<std::size_t i>() {
    if (i != alternative) return;
    fields(reader, out.emplace<i>());
  };
  (read.template operator()<index>(), ...);
  return out;
}

// True for records that later versions may extend.
bool may_grow(McapOp code) {
  return code != McapOp::message && code != McapOp::chunk && code != McapOp::footer &&
         code != McapOp::data_end;
}

// Eight tables, so that eight bytes are one step. Source: Kounavis and Berry, "A systematic approach to
// building high performance software-based CRC generators", 2005.
using CrcTables = std::array<std::array<std::uint32_t, 256>, 8>;
constexpr CrcTables make_crc_tables() {
  CrcTables out{};
  for (std::uint32_t i = 0; i < 256; ++i) {
    std::uint32_t value = i;
    for (int bit = 0; bit < 8; ++bit) value = (value >> 1) ^ ((value & 1) != 0 ? 0xEDB88320U : 0U);
    out[0][i] = value;
  }
  for (std::size_t table = 1; table < 8; ++table) {
    for (std::size_t i = 0; i < 256; ++i) {
      const std::uint32_t value = out[table - 1][i];
      out[table][i] = (value >> 8) ^ out[0][value & 0xFF];
    }
  }
  return out;
}
constexpr CrcTables kCrcTables = make_crc_tables();

}  // namespace

void append_record(const McapRecord& record, std::vector<std::byte>& out, McapBytes padding) {
  const auto code = static_cast<McapOp>(record.index() + 1);
  FieldWriter writer(out);
  writer(code);
  const std::size_t start = out.size();
  writer(std::uint64_t{0});
  // The writer only reads the fields.
  std::visit(
      [&writer](const auto& fixed) { fields(writer, const_cast<std::decay_t<decltype(fixed)>&>(fixed)); },
      record);
  if (may_grow(code)) writer.rest(padding);
  const std::uint64_t length = out.size() - start - sizeof(std::uint64_t);
  std::memcpy(&out[start], &length, sizeof length);
}

McapRecord parse_record(McapOp code, McapBytes content, std::uint64_t offset) {
  const std::size_t alternative = static_cast<std::size_t>(code) - 1;
  if (alternative >= std::variant_size_v<McapRecord>) {
    throw InputError("mcap.damaged", {},
                     fmt::format("the record before byte {} has the code 0x{:02x}, which MCAP does not know",
                                 offset, static_cast<unsigned>(code)));
  }
  FieldReader reader(content, offset);
  return parse_alternative(alternative, reader, std::make_index_sequence<std::variant_size_v<McapRecord>>());
}

std::uint32_t mcap_crc(McapBytes bytes, std::uint32_t before) {
  std::uint32_t crc = ~before;
  const auto* p = reinterpret_cast<const unsigned char*>(bytes.data());
  std::size_t left = bytes.size();
  for (; left >= 8; left -= 8, p += 8) {
    std::uint32_t low = 0, high = 0;
    std::memcpy(&low, p, 4);
    std::memcpy(&high, p + 4, 4);
    low ^= crc;
    crc = kCrcTables[7][low & 0xFF] ^ kCrcTables[6][low >> 8 & 0xFF] ^ kCrcTables[5][low >> 16 & 0xFF] ^
          kCrcTables[4][low >> 24] ^ kCrcTables[3][high & 0xFF] ^ kCrcTables[2][high >> 8 & 0xFF] ^
          kCrcTables[1][high >> 16 & 0xFF] ^ kCrcTables[0][high >> 24];
  }
  for (; left > 0; --left, ++p) crc = (crc >> 8) ^ kCrcTables[0][(crc ^ *p) & 0xFF];
  return ~crc;
}

}  // namespace doppel
