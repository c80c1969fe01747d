// Types created at run time from descriptions: equality with the compiled ones, and hostile descriptions.

#include "doppel/ros/messages/described_type.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "doppel/ros/messages/rcl_interfaces.h"
#include "doppel/ros/messages/sensor_msgs.h"
#include "doppel/ros/messages/type_hash.h"
#include "messages_testing.h"

namespace doppel {
namespace {

using testing::HasSubstr;
using testing::StartsWith;
using type_description_interfaces::msg::Field;
using type_description_interfaces::msg::IndividualTypeDescription;

Field field(std::string name, int type_id, std::string nested = "", std::uint64_t capacity = 0,
            std::uint64_t string_capacity = 0) {
  Field out;
  out.name = std::move(name);
  out.type.type_id = static_cast<std::uint8_t>(type_id);
  out.type.nested_type_name = std::move(nested);
  out.type.capacity = capacity;
  out.type.string_capacity = string_capacity;
  return out;
}

TypeDescriptionMessage message(std::vector<Field> fields,
                               std::vector<IndividualTypeDescription> referenced = {}) {
  TypeDescriptionMessage out;
  out.type_description.type_name = "my_msgs/msg/Top";
  out.type_description.fields = std::move(fields);
  out.referenced_type_descriptions = std::move(referenced);
  return out;
}

std::string error_of(const TypeDescriptionMessage& described) {
  Status status;
  EXPECT_EQ(described_type(described, status), nullptr);
  EXPECT_FALSE(status);
  return status.why();
}

TEST(DescribedType, DescribedTypeEqualsCompiledType) {
  std::mt19937 random(5);
  for (const TypeSupport* compiled : messages_testing::all_types()) {
    const TypeDescriptionMessage described = description_message(*compiled->description());
    Status status;
    const auto type = described_type(described, status);
    ASSERT_NE(type, nullptr) << compiled->name << ": " << status.why();
    EXPECT_EQ(type->hash(), compiled->hash()) << compiled->name;
    EXPECT_EQ(type->description()->least_cdr_size, compiled->description()->least_cdr_size) << compiled->name;
    const Bytes bytes = messages_testing::random_message(*compiled->description(), random);
    Bytes once, there, here;
    ASSERT_TRUE(type->recode(bytes, once)) << compiled->name;
    EXPECT_EQ(once, bytes) << compiled->name;
    std::string yaml;
    ASSERT_TRUE(type->cdr_to_yaml(bytes, yaml)) << compiled->name;
    EXPECT_TRUE(type->yaml_to_cdr(yaml, there) && there == bytes) << compiled->name << "\n" << yaml;
    ASSERT_TRUE(type->yaml_to_cdr("{}", there) && compiled->yaml_to_cdr("{}", here));
    EXPECT_EQ(there, here) << compiled->name << ": expected the same defaults";
  }
}

TEST(DescribedType, EveryFieldKindIsSupported) {
  const IndividualTypeDescription part{.type_name = "my_msgs/msg/Part", .fields = {field("on", 15)}};
  const auto described =
      message({field("c", 13), field("w", 14), field("wide", 18), field("short_text", 21, "", 0, 3),
               field("short_wide", 22, "", 0, 2), field("bytes", 16 + 144), field("two", 21 + 48, "", 2, 9),
               field("parts", 1 + 96, "my_msgs/msg/Part", 2)},
              {part});
  Status status;
  const auto type = described_type(described, status);
  ASSERT_NE(type, nullptr) << status.why();
  EXPECT_THAT(type->schema(), StartsWith("char c\nwchar w\nwstring wide\nstring<=3 short_text\n"
                                         "wstring<=2 short_wide\nbyte[] bytes\nstring<=9[2] two\n"
                                         "my_msgs/Part[<=2] parts\n"));
  Bytes bytes;
  ASSERT_TRUE(type->yaml_to_cdr(
      "{c: 65, w: 228, wide: \"\xC3\xA4\xF0\x9F\xA4\x96\", short_text: abc, short_wide: xy, bytes: [1, 2],"
      " two: [a, b], parts: [{on: true}]}",
      bytes));
  // As in Jazzy's rmw_fastrtps: a single wide character has two bytes, one in a text four; no NUL.
  EXPECT_EQ(messages_testing::show(bytes),
            messages_testing::show(messages_testing::hex(
                "00 01 00 00 41 00 e4 00 03 00 00 00 e4 00 00 00 3e d8 00 00 16 dd 00 00 "
                "04 00 00 00 61 62 63 00 02 00 00 00 78 00 00 00 79 00 00 00 02 00 00 00 01 02 00 00 "
                "02 00 00 00 61 00 00 00 02 00 00 00 62 00 00 00 01 00 00 00 01")));
  std::string yaml;
  ASSERT_TRUE(type->cdr_to_yaml(bytes, yaml));
  EXPECT_THAT(yaml, HasSubstr("wide: \xC3\xA4\xF0\x9F\xA4\x96\n"));
  Status refused = type->yaml_to_cdr("{short_text: abcd}", bytes);
  EXPECT_THAT(refused.why(), HasSubstr("at most 3"));
  refused = type->yaml_to_cdr("{parts: [{}, {}, {}]}", bytes);
  EXPECT_THAT(refused.why(), HasSubstr("at most 2"));
  EXPECT_EQ(type_hash(described), type->hash());
}

TEST(DescribedType, SequenceBeyondBoundIsRefused) {
  rcl_interfaces::msg::ParameterDescriptor descriptor;
  descriptor.integer_range.resize(2);
  const Bytes bytes = to_cdr(descriptor);
  const Status status = from_cdr(bytes, descriptor);
  EXPECT_THAT(status.why(), HasSubstr("longer than its bound in 'integer_range'"));
  std::string yaml;
  EXPECT_FALSE(type_support<rcl_interfaces::msg::ParameterDescriptor>().cdr_to_yaml(bytes, yaml));
}

TEST(DescribedType, HostileDescriptionsAreRefused) {
  EXPECT_THAT(error_of(message({field("a", 1, "my_msgs/msg/Other")})), HasSubstr("is not described"));
  EXPECT_THAT(error_of(message({field("a", 1, "my_msgs/msg/Top")})), HasSubstr("contains itself"));
  EXPECT_THAT(error_of(message({field("a", 145, "my_msgs/msg/Top")})), HasSubstr("contains itself"));
  for (const int kind : {0, 12, 19, 20, 23, 47, 71, 96, 143, 144, 167, 255})
    EXPECT_THAT(error_of(message({field("a", kind)})), HasSubstr("unknown kind")) << kind;
  EXPECT_THAT(error_of(message({field("a", 2), field("a", 2)})), HasSubstr("a unique name"));
  EXPECT_THAT(error_of(message({field("a b", 2)})), HasSubstr("a unique name"));
  EXPECT_THAT(error_of(message({field("a\"", 2)})), HasSubstr("a unique name"));
  EXPECT_THAT(error_of(message({field("a", 2 + 48, "", 0)})), HasSubstr("size 0"));
  EXPECT_THAT(error_of(message({field("a", 2 + 96, "", 0)})), HasSubstr("size 0"));
  EXPECT_THAT(error_of(message({field("a", 21)})), HasSubstr("size 0"));
  EXPECT_THAT(error_of(message({field("a", 11 + 48, "", UINT64_MAX)})), HasSubstr("64 MiB"));
  TypeDescriptionMessage nameless = message({field("a", 2)});
  nameless.type_description.type_name = "Top";
  EXPECT_THAT(error_of(nameless), HasSubstr("package/msg/Name"));
  const IndividualTypeDescription part{.type_name = "my_msgs/msg/Part", .fields = {field("on", 15)}};
  EXPECT_THAT(error_of(message({field("a", 1, "my_msgs/msg/Part")}, {part, part})),
              HasSubstr("described twice"));
}

// Each type contains two of the next: the shortest message has 2^n bytes.
TEST(DescribedType, UnboundedlyGrowingTypeIsRefused) {
  std::vector<IndividualTypeDescription> chain;
  for (int i = 0; i < 40; ++i) {
    const std::string next = "my_msgs/msg/T" + std::to_string(i + 1);
    IndividualTypeDescription type{.type_name = "my_msgs/msg/T" + std::to_string(i), .fields = {}};
    type.fields = {field("a", 1, next), field("b", 1, next)};
    chain.push_back(type);
  }
  chain.push_back({.type_name = "my_msgs/msg/T40", .fields = {field("a", 2)}});
  EXPECT_THAT(error_of(message({field("a", 1, "my_msgs/msg/T0")}, chain)), HasSubstr("64 MiB"));

  std::vector<IndividualTypeDescription> deep;
  for (int i = 0; i < 100; ++i) {
    deep.push_back({.type_name = "my_msgs/msg/T" + std::to_string(i),
                    .fields = {field("a", 145, "my_msgs/msg/T" + std::to_string(i + 1))}});
  }
  deep.push_back({.type_name = "my_msgs/msg/T100", .fields = {field("a", 2)}});
  EXPECT_THAT(error_of(message({field("a", 1, "my_msgs/msg/T0")}, deep)), HasSubstr("too deep"));
}

}  // namespace
}  // namespace doppel
