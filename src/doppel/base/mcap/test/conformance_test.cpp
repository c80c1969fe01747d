// The published conformance variants of the format: written bit for bit, and read back.
#include <gtest/gtest.h>

#include <fstream>
#include <set>
#include <sstream>

#include "doppel/base/core/sha256.h"
#include "doppel/base/mcap/mcap_scanner.h"
#include "doppel/base/mcap/mcap_writer.h"
#include "doppel/base/mcap/test/memory_sink.h"

namespace doppel {
namespace {

using mcap_testing::bytes_of;
using mcap_testing::MemorySink;

struct Variant {
  std::string input;
  std::set<std::string> features;
  std::string hash;
  std::size_t size = 0;
  std::string name;
};

std::vector<Variant> variants() {
  std::ifstream file(std::string(DOPPEL_SOURCE_DIR) + "/src/doppel/base/mcap/test/conformance_variants.txt");
  std::vector<Variant> out;
  for (std::string line; std::getline(file, line);) {
    if (line.starts_with("#")) continue;
    Variant one;
    std::istringstream words(line);
    words >> one.name >> one.hash >> one.size;
    std::istringstream parts(one.name);
    std::getline(parts, one.input, '-');
    for (std::string feature; std::getline(parts, feature, '-');) one.features.insert(feature);
    out.push_back(std::move(one));
  }
  return out;
}

McapWriterOptions options_of(const std::set<std::string>& features) {
  McapWriterOptions out;
  out.profile = out.library = out.compression = "";
  out.chunk_size = features.contains("ch") ? 1U << 20U : 0;
  out.message_index = features.contains("mx");
  out.chunk_index = features.contains("chx");
  out.repeated_schemas = features.contains("rsh");
  out.repeated_channels = features.contains("rch");
  out.statistics = features.contains("st");
  out.attachment_index = features.contains("ax");
  out.metadata_index = features.contains("mdx");
  out.summary_offsets = features.contains("sum");
  if (features.contains("pad")) out.padding = {std::byte{1}, std::byte{0xFF}, std::byte{0xFF}};
  return out;
}

const std::vector<std::byte> kData = bytes_of("\x01\x02\x03");
const std::vector<std::uint64_t> kTimes = {0, 2, 1, 3, 3, 5, 4, 7, 8, 9};

void write_input(const std::string& input, McapWriter& writer) {
  if (input == "OneAttachment") {
    writer.attach({2, 1, "myFile", "application/octet-stream", kData});
  } else if (input == "OneMetadata") {
    writer.add_metadata("myMetadata", {{"foo", "bar"}});
  } else if (input == "OneSchemalessMessage") {
    const auto channel = writer.add_channel(0, "example", "text", {});
    writer.write({channel, 10, 2, 1, kData});
  } else if (input != "NoData") {
    const auto schema = writer.add_schema("Example", "c", bytes_of("\x04\x05\x06"));
    const auto channel = writer.add_channel(schema, "example", "a", {{"foo", "bar"}});
    if (input == "OneMessage") writer.write({channel, 10, 2, 1, kData});
    if (input != "TenMessages") return;
    for (std::uint32_t i = 0; i < kTimes.size(); ++i) writer.write({channel, i, kTimes[i], kTimes[i], kData});
  }
}

// "schema 1 Example", "message 3 at 3", ..., of the data section, also within chunks.
std::vector<std::string> contents(const std::vector<std::byte>& file) {
  std::vector<std::string> out;
  bool is_data = true;
  const auto note = [&](const McapRecord& record) {
    if (const auto* s = std::get_if<McapSchema>(&record))
      out.push_back("schema " + std::to_string(s->id) + " " + std::string(s->name));
    if (const auto* c = std::get_if<McapChannel>(&record))
      out.push_back("channel " + std::string(c->topic) + " " + std::to_string(c->metadata.size()));
    if (const auto* m = std::get_if<McapMessage>(&record)) {
      EXPECT_TRUE(std::ranges::equal(m->data, kData));
      out.push_back("message " + std::to_string(m->sequence) + " at " + std::to_string(m->log_time));
    }
    if (const auto* a = std::get_if<McapAttachment>(&record))
      out.push_back("attachment " + std::string(a->name));
    if (const auto* m = std::get_if<McapMetadata>(&record)) out.push_back("metadata " + std::string(m->name));
    return true;
  };
  const auto source = mcap_source(file);
  McapScanner scanner(*source);
  while (const McapScanned* found = scanner.next()) {
    if (found->code == McapOp::data_end) is_data = false;
    if (!is_data) continue;
    if (const auto* chunk = std::get_if<McapChunk>(&found->record)) {
      for_each_record(chunk_records(*chunk, found->offset), found->offset,
                      [&](const McapRecord& record, std::size_t) { return note(record); });
    } else {
      note(found->record);
    }
  }
  EXPECT_TRUE(scanner.complete());
  return out;
}

std::vector<std::string> expected_contents(const std::string& input) {
  if (input == "NoData") return {};
  if (input == "OneAttachment") return {"attachment myFile"};
  if (input == "OneMetadata") return {"metadata myMetadata"};
  if (input == "OneSchemalessMessage") return {"channel example 0", "message 10 at 2"};
  std::vector<std::string> out{"schema 1 Example", "channel example 1"};
  if (input == "OneMessage") out.emplace_back("message 10 at 2");
  if (input != "TenMessages") return out;
  for (std::size_t i = 0; i < kTimes.size(); ++i)
    out.push_back("message " + std::to_string(i) + " at " + std::to_string(kTimes[i]));
  return out;
}

TEST(McapConformance, EveryPublishedVariantIsWrittenBitForBitAndReadBack) {
  const std::vector<Variant> all = variants();
  ASSERT_EQ(all.size(), 416u);
  for (const Variant& variant : all) {
    MemorySink sink;
    McapWriter writer(sink, options_of(variant.features));
    write_input(variant.input, writer);
    writer.close();
    ASSERT_EQ(sink.bytes.size(), variant.size) << variant.name;
    const std::string_view text(reinterpret_cast<const char*>(sink.bytes.data()), sink.bytes.size());
    ASSERT_EQ(sha256_hex(text), variant.hash) << variant.name;
    ASSERT_EQ(contents(sink.bytes), expected_contents(variant.input)) << variant.name;
  }
}

}  // namespace
}  // namespace doppel
