#include "doppel/base/mcap/mcap_scanner.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "doppel/base/core/diagnostic.h"
#include "doppel/base/core/read_file.h"
#include "doppel/base/mcap/detail/compression.h"
#include "doppel/base/mcap/detail/damage.h"

namespace doppel {
namespace {

[[noreturn]] void unreadable(const std::string& path, const std::string& problem) {
  throw InputError("file.unreadable", make_location(path),
                   fmt::format("'{}' cannot be read: {}", path, problem));
}

class FileSource : public McapSource {
 public:
  explicit FileSource(const std::string& path) : path_(path), file_(open_regular_file(path)) {
    if (!file_.problem.empty()) unreadable(path, file_.problem);
  }
  [[nodiscard]] std::uint64_t size() const override { return file_.size; }
  void read(std::uint64_t offset, std::span<std::byte> out) const override {
    for (std::size_t filled = 0; filled < out.size();) {
      const ssize_t got = pread(file_.descriptor.get(), &out[filled], out.size() - filled,
                                static_cast<off_t>(offset + filled));
      if (got < 0 && errno == EINTR) continue;
      if (got < 0) unreadable(path_, std::strerror(errno));
      if (got == 0) mcap_damaged(fmt::format("the file ends at byte {}, within a record", offset + filled));
      filled += static_cast<std::size_t>(got);
    }
  }

 private:
  std::string path_;
  RegularFile file_;
};

class MemorySource : public McapSource {
 public:
  explicit MemorySource(std::vector<std::byte> bytes) : bytes_(std::move(bytes)) {}
  [[nodiscard]] std::uint64_t size() const override { return bytes_.size(); }
  void read(std::uint64_t offset, std::span<std::byte> out) const override {
    if (offset > bytes_.size() || out.size() > bytes_.size() - offset)
      mcap_damaged(fmt::format("the file ends at byte {}, within a record", bytes_.size()));
    std::copy_n(bytes_.begin() + static_cast<std::ptrdiff_t>(offset), out.size(), out.begin());
  }

 private:
  std::vector<std::byte> bytes_;
};

// Files that people take for a bag of this kind.
void require_magic(const McapSource& source) {
  std::byte start[16] = {};
  const auto size = static_cast<std::size_t>(std::min<std::uint64_t>(source.size(), sizeof start));
  source.read(0, std::span(start).first(size));
  const std::string_view text(reinterpret_cast<const char*>(start), size);
  if (size >= kMcapMagicSize && std::memcmp(start, kMcapMagic, kMcapMagicSize) == 0) return;
  if (text.starts_with("SQLite format 3"))
    mcap_damaged("it is an SQLite bag of rosbag2", "convert it with: ros2 bag convert (to storage_id mcap)");
  if (text.starts_with("#ROSBAG"))
    mcap_damaged("it is a bag of ROS 1", "convert it with: mcap convert IN.bag OUT.mcap");
  if (size == 0) mcap_damaged("the file is empty");
  if (size >= 5 && std::memcmp(start, kMcapMagic, 5) == 0)
    mcap_damaged("it is an MCAP file of another major version than 0, or its beginning is damaged");
  mcap_damaged("it does not begin as an MCAP file");
}

// True if the bytes are a chunk whose sizes and check sum are right. Its first fields are looked at before
// its bytes are read.
bool is_whole_chunk(const McapSource& source, std::uint64_t offset, std::uint64_t length) {
  constexpr std::size_t kFixed = 3 * sizeof(std::uint64_t) + 2 * sizeof(std::uint32_t);
  if (length < kFixed) return false;
  std::byte head[kFixed];
  source.read(offset + kMcapPrefixSize, head);
  std::uint32_t name_size = 0;
  std::memcpy(&name_size, &head[kFixed - sizeof name_size], sizeof name_size);
  if (name_size > 4) return false;  // "zstd"
  std::vector<std::byte> content(static_cast<std::size_t>(length));
  source.read(offset + kMcapPrefixSize, content);
  try {
    const McapRecord record = parse_record(McapOp::chunk, content, offset);
    const auto& chunk = std::get<McapChunk>(record);
    return chunk.uncompressed_crc != 0 && !chunk_records(chunk, offset).empty();
  } catch (const InputError&) {
    return false;
  }
}

}  // namespace

std::unique_ptr<McapSource> open_mcap_source(const std::string& path) {
  return std::make_unique<FileSource>(path);
}

std::unique_ptr<McapSource> mcap_source(std::vector<std::byte> bytes) {
  return std::make_unique<MemorySource>(std::move(bytes));
}

McapScanner::McapScanner(const McapSource& source) : source_(source) {
  require_magic(source);
}

const McapScanned* McapScanner::next() {
  while (!complete_ && position_ < source_.size()) {
    std::byte prefix[kMcapPrefixSize];
    source_.read(position_, prefix);
    std::uint64_t length = 0;
    std::memcpy(&length, prefix + 1, sizeof length);
    if (length > source_.size() - position_ - kMcapPrefixSize) {
      mcap_damaged(fmt::format("the record at byte {} is said to have {} bytes, but the file ends at byte {}",
                               position_, length, source_.size()));
    }
    if (length > kMaxMcapRecord) {
      mcap_damaged(
          fmt::format("the record at byte {} has {} bytes, more than {}", position_, length, kMaxMcapRecord));
    }
    scanned_.code = static_cast<McapOp>(prefix[0]);
    scanned_.offset = position_;
    scanned_.length = kMcapPrefixSize + length;
    const bool is_known = scanned_.code >= McapOp::header && scanned_.code <= McapOp::data_end;
    if (!is_known) {
      if (prefix[0] == std::byte{0})
        mcap_damaged(fmt::format("the record at byte {} has the code 0", position_));
      position_ += scanned_.length;
      continue;
    }
    bytes_.resize(static_cast<std::size_t>(scanned_.length));
    source_.read(position_, bytes_);
    scanned_.bytes = bytes_;
    scanned_.record =
        parse_record(scanned_.code, scanned_.bytes.subspan(kMcapPrefixSize), position_ + kMcapPrefixSize);
    position_ += scanned_.length;
    if (scanned_.code == McapOp::footer) {
      std::byte end[kMcapMagicSize];
      source_.read(position_, end);
      if (std::memcmp(end, kMcapMagic, kMcapMagicSize) != 0)
        mcap_damaged(
            fmt::format("the bytes at the end, from byte {}, are not those of an MCAP file", position_));
      complete_ = true;
    }
    return &scanned_;
  }
  return nullptr;
}

bool McapScanner::find_next_chunk() {
  constexpr std::uint64_t kBlock = 1U << 22U;
  std::vector<std::byte> block;
  for (std::uint64_t start = position_ + 1; start + kMcapPrefixSize < source_.size(); start += kBlock) {
    // Blocks overlap by a prefix.
    block.resize(static_cast<std::size_t>(std::min(kBlock + kMcapPrefixSize, source_.size() - start)));
    source_.read(start, block);
    for (std::size_t i = 0; i + kMcapPrefixSize < block.size(); ++i) {
      if (block[i] != static_cast<std::byte>(McapOp::chunk)) continue;
      std::uint64_t length = 0;
      std::memcpy(&length, &block[i + 1], sizeof length);
      const std::uint64_t offset = start + i;
      if (length > kMaxMcapRecord || length > source_.size() - offset - kMcapPrefixSize) continue;
      if (!is_whole_chunk(source_, offset, length)) continue;
      position_ = offset;
      return true;
    }
  }
  return false;
}

std::vector<std::byte> chunk_records(const McapChunk& chunk, std::uint64_t offset) {
  if (chunk.uncompressed_size > kMaxMcapRecord)
    mcap_damaged(
        fmt::format("the chunk at byte {} is said to have {} bytes", offset, chunk.uncompressed_size));
  std::vector<std::byte> out;
  try {
    out = decompress(chunk.compression, chunk.records, static_cast<std::size_t>(chunk.uncompressed_size));
  } catch (const InputError& problem) {
    const Diagnostic& first = problem.diagnostics().front();
    throw InputError(first.rule, {}, fmt::format("the chunk at byte {}: {}", offset, first.message),
                     first.fix);
  }
  if (chunk.uncompressed_crc != 0 && mcap_crc(out) != chunk.uncompressed_crc)
    mcap_damaged(fmt::format("the chunk at byte {} has another check sum than its records", offset));
  return out;
}

std::optional<McapRecord> next_chunk_record(McapBytes records, std::size_t& next,
                                            std::uint64_t chunk_offset) {
  const auto refuse = [&](const char* why) {
    mcap_damaged(fmt::format("the chunk at byte {}: the record at byte {} of its records {}", chunk_offset,
                             next, why));
  };
  if (records.size() - next < kMcapPrefixSize) refuse("has no whole prefix");
  std::uint64_t length = 0;
  std::memcpy(&length, &records[next + 1], sizeof length);
  if (length > records.size() - next - kMcapPrefixSize) refuse("ends beyond them");
  const auto code = static_cast<McapOp>(records[next]);
  const McapBytes content = records.subspan(next + kMcapPrefixSize, static_cast<std::size_t>(length));
  const std::uint64_t start = next + kMcapPrefixSize;
  next += kMcapPrefixSize + static_cast<std::size_t>(length);
  if (code < McapOp::header || code > McapOp::data_end) return std::nullopt;
  if (code != McapOp::schema && code != McapOp::channel && code != McapOp::message)
    refuse("is of a kind that no chunk has");
  return parse_record(code, content, start);
}

bool is_whole(const McapAttachment& attachment, McapBytes content) {
  // The fields before the crc; bytes behind it belong to later versions.
  const std::size_t size = 3 * sizeof(std::uint64_t) + 2 * sizeof(std::uint32_t) + attachment.name.size() +
                           attachment.media_type.size() + attachment.data.size();
  return attachment.crc == 0 || mcap_crc(content.first(size)) == attachment.crc;
}

}  // namespace doppel
