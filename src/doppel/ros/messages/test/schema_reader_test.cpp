#include "doppel/ros/messages/schema_reader.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace doppel {
namespace {

using testing::HasSubstr;

TEST(SchemaReader, EveryBuiltInTypeHasItsHashAfterItsSchemaWasRead) {
  std::size_t count = 0;
  for (const std::string& name : type_names()) {
    const TypeSupport* const built_in = find_type(name);
    ASSERT_NE(built_in, nullptr) << name;
    Status status;
    const auto read = type_of_schema(name, built_in->schema(), status);
    ASSERT_NE(read, nullptr) << name << ": " << status.why();
    EXPECT_EQ(read->hash(), built_in->hash()) << name << "\n" << built_in->schema();
    ++count;
  }
  EXPECT_GT(count, 150U);
}

TEST(SchemaReader, ForeignTypeWithBoundsConstantsAndDefaultsIsRead) {
  const std::string schema =
      "# A comment\n"
      "uint8 RED=1  # with its own\n"
      "string NAME = \"a # b\"\n"
      "string<=5[<=2] names\n"
      "float64[3] p [1, 2, 3]\n"
      "wstring<=7 wide\n"
      "int32 count 5\n"
      "Part[] parts\n"
      "builtin_interfaces/Time stamp\n"
      "================================================================================\n"
      "MSG: other_msgs/Part\n"
      "bool good\n"
      "================================================================================\n"
      "MSG: builtin_interfaces/Time\n"
      "int32 sec\nuint32 nanosec\n";
  Status status;
  const auto type = type_of_schema("other_msgs/msg/Thing", schema, status);
  ASSERT_NE(type, nullptr) << status.why();
  std::string text;
  for (const FieldDescription& field : type->description()->fields)
    text += to_string(field) + " " + field.name + "\n";
  EXPECT_EQ(text,
            "string<=5[<=2] names\nfloat64[3] p\nwstring<=7 wide\nint32 count\nother_msgs/Part[] parts\n"
            "builtin_interfaces/Time stamp\n");
}

TEST(SchemaReader, UnreadableSchemaIsRefusedWithItsLine) {
  for (const auto& [schema, why] : std::vector<std::pair<std::string, std::string>>{
           {"int32 a\nint32\n", "line 2: 'int32' has no name"},
           {"int32[x] a\n", "line 1: 'int32[x]' has a size that is not a number"},
           {"int32[ a\n", "line 1: 'int32[' has no ']'"},
           {"int32<=4 a\n", "line 1: 'int32' cannot have a bound"},
           {"Missing a\n", "other_msgs/msg/Missing is not described"},
           {"int32 a\nint32 a\n", "without a unique name"}}) {
    Status status;
    EXPECT_EQ(type_of_schema("other_msgs/msg/Thing", schema, status), nullptr) << schema;
    EXPECT_THAT(status.why(), HasSubstr(why));
  }
}

}  // namespace
}  // namespace doppel
