// Every type of doppel reads what two independent generators wrote (golden_vectors.txt describes how), gives
// their values, and writes the same bytes.

#include <gtest/gtest.h>

#include <fstream>
#include <map>
#include <nlohmann/json.hpp>

#include "doppel/ros/messages/test/messages_testing.h"

namespace doppel {
namespace {

using messages_testing::hex;
using messages_testing::show;

struct GoldenVector {
  std::string type, variant;
  nlohmann::json values{};
  Bytes bytes{}, big_endian{}, cyclone{};
};

std::vector<GoldenVector> read_vectors() {
  std::ifstream file(DOPPEL_SOURCE_DIR "/tests/ros2/golden_vectors.txt");
  std::vector<GoldenVector> vectors;
  for (std::string line; std::getline(file, line);) {
    const std::size_t space = line.find(' ');
    if (line.empty() || line.starts_with('#')) continue;
    if (line.starts_with('{')) {
      vectors.back().values = nlohmann::json::parse(line);
    } else if (line.starts_with("0001")) {
      vectors.back().bytes = hex(line);
    } else if (line.starts_with("0000")) {
      vectors.back().big_endian = hex(line);
    } else if (line.starts_with("cyclone +")) {
      GoldenVector& last = vectors.back();
      const auto padding = static_cast<std::size_t>(std::stoi(line.substr(9)));
      last.cyclone = last.bytes;
      last.cyclone[3] = static_cast<std::byte>(padding);
      last.cyclone.resize(last.bytes.size() + padding);
    } else {
      vectors.push_back({.type = line.substr(0, space), .variant = line.substr(space + 1)});
    }
  }
  return vectors;
}

void expect_decodes_and_encodes(const TypeSupport& type, const GoldenVector& vector, const Bytes& form) {
  std::string json;
  const Status read = type.cdr_to_json(form, json);
  ASSERT_TRUE(read.ok()) << read.why();
  EXPECT_EQ(nlohmann::json::parse(json), vector.values);
  Bytes again;
  const Status written = type.recode(form, again);
  ASSERT_TRUE(written.ok()) << written.why();
  EXPECT_EQ(show(again), show(vector.bytes));
}

TEST(GoldenVectors, EveryVectorRoundTrips) {
  const std::vector<GoldenVector> vectors = read_vectors();
  ASSERT_FALSE(vectors.empty());
  for (const GoldenVector& vector : vectors) {
    SCOPED_TRACE(vector.type + " " + vector.variant);
    const TypeSupport* type = find_type(vector.type);
    if (type == nullptr) {
      ADD_FAILURE() << "expected the type to exist; regenerate the file with tools/make_golden_vectors";
      continue;
    }
    expect_decodes_and_encodes(*type, vector, vector.bytes);
    expect_decodes_and_encodes(*type, vector, vector.cyclone);
    if (!vector.big_endian.empty()) expect_decodes_and_encodes(*type, vector, vector.big_endian);
  }
}

TEST(GoldenVectors, EveryTypeHasVectors) {
  std::map<std::string, int> count;
  for (const GoldenVector& vector : read_vectors()) ++count[vector.type];
  for (const TypeSupport* type : messages_testing::all_types()) {
    // The generators derive no types for the events of services; those consist of types that have vectors.
    if (type->name.ends_with("_Event")) continue;
    EXPECT_EQ(count[type->name], 2) << "expected two vectors of " << type->name
                                    << "; run tools/make_golden_vectors";
  }
}

// Truncated data is rejected at any length, from any generator, instead of read as something shorter.
TEST(GoldenVectors, TruncationIsRefused) {
  for (const GoldenVector& vector : read_vectors()) {
    SCOPED_TRACE(vector.type + " " + vector.variant);
    const TypeSupport* type = find_type(vector.type);
    if (type == nullptr) continue;  // reported above
    Bytes again;
    for (std::size_t size = 0; size < vector.bytes.size(); ++size) {
      const std::span<const std::byte> cut = std::span(vector.bytes).first(size);
      EXPECT_FALSE(type->recode(cut, again).ok()) << "expected an error for the first " << size << " bytes";
    }
  }
}

}  // namespace
}  // namespace doppel
