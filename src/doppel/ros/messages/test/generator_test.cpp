// The generator of the built-in messages: what definitions mean, and the errors in wrong ones.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "doppel/base/core/diagnostic.h"
#include "doppel/ros/messages/generator/definition.h"
#include "struct_codecs.h"

namespace doppel {
namespace {

namespace fs = std::filesystem;
using message_generator::Definitions;
using ::testing::HasSubstr;

// Files of definitions, in a folder of the test.
class Generator : public ::testing::Test {
 protected:
  Generator() : folder_(fs::path(::testing::TempDir()) / "definitions") {
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  ~Generator() override { fs::remove_all(folder_); }

  void write(const std::string& package, const std::string& text) {
    files_.push_back(folder_ / (package + ".msgs"));
    std::ofstream(files_.back()) << text;
  }
  Definitions read() const { return message_generator::read_definitions(files_); }

  // The text of a generated file.
  static std::string file(const message_generator::Files& files, const std::string& name) {
    for (const auto& [each, content] : files) {
      if (each == name) return content;
    }
    return "there is no " + name;
  }

  // The error of one file: "LINE:COLUMN: message", with what to do.
  std::string error(const std::string& text) {
    files_.clear();
    write("my_msgs", text);
    try {
      read();
    } catch (const InputError& error) {
      const Diagnostic& found = error.diagnostics().front();
      EXPECT_EQ(*found.where.file, files_.back().string());
      EXPECT_NE(found.fix, "");
      return std::to_string(found.where.line) + ":" + std::to_string(found.where.column) + ": " +
             found.message;
    }
    return "no error";
  }

  fs::path folder_;
  std::vector<fs::path> files_;
};

TEST_F(Generator, DefinitionsBecomeStructsWithDefaultsConstantsAndComments) {
  write("my_msgs", R"(# What it is for.

# A grip.
msg Grip:
  uint8 OPEN=0, CLOSED=1; string UNIT="mm"
  other_msgs/Finger[<=3] fingers; float64 width 0.5, depth  # m
  # Both jaws.
  string<=5[2] names
)");
  write("other_msgs", "msg Finger: bool bent true; byte raw 7\n");
  const std::string header = file(cpp_files(read()), "my_msgs.h");
  EXPECT_THAT(header, HasSubstr("#pragma once\n// What it is for.\n"));
  EXPECT_THAT(header, HasSubstr("#include \"doppel/ros/messages/other_msgs.h\"\n"));
  EXPECT_THAT(header, HasSubstr(R"(namespace doppel::my_msgs::msg {

// A grip.
struct Grip {
  static constexpr std::uint8_t OPEN = 0, CLOSED = 1;
  static constexpr std::string_view UNIT = "mm";
  BoundedVector<other_msgs::msg::Finger, 3> fingers;
  double width = 0.5, depth = 0;  // m
  // Both jaws.
  std::array<BoundedString<5>, 2> names{};
  static constexpr std::string_view kType = "my_msgs/msg/Grip";
)"));
  EXPECT_THAT(file(cpp_files(read()), "other_msgs.h"),
              HasSubstr("  bool bent = true;\n  std::byte raw{7};\n"));
}

TEST_F(Generator, PartsOfServicesAndActionsAreNestedStructs) {
  write("my_msgs", "msg Grip: int8 x\nsrv Hold: Grip grip ---\naction Move: --- int8 y\n  ---\n");
  const std::string header = file(cpp_files(read()), "my_msgs.h");
  EXPECT_THAT(header, HasSubstr("struct Hold {\n  struct Request {\n    my_msgs::msg::Grip grip;\n"));
  EXPECT_THAT(
      header,
      HasSubstr("kType = \"my_msgs/srv/Hold_Response\";\n    static constexpr bool kIsEmpty = true;\n"));
  EXPECT_THAT(header, HasSubstr("kType = \"my_msgs/action/Move_Feedback\";\n"));
}

TEST_F(Generator, IdlIsAsRosidlWritesIt) {
  write("my_msgs",
        "msg Grip: float32[] x; byte[2] y; string<=4 name\nmsg Grips: Grip[<=3] grips; uint8 MANY=3\n");
  const std::string idl = file(idl_files(read(), Distro::jazzy), "my_msgs.idl");
  EXPECT_THAT(idl,
              HasSubstr("struct Grip_ {\n  sequence<float> x_;\n  octet y_[2];\n  string<4> name_;\n};\n"));
  EXPECT_THAT(idl, HasSubstr("struct Grips_ {\n  sequence<my_msgs::msg::dds_::Grip_, 3> grips_;\n};\n"));
}

TEST_F(Generator, FieldsOfSomeDistributionsAreVisitedInTheseAlone) {
  write("my_msgs", "msg Grip: int8 a; [from kilted] int8 b, c; [to jazzy] int8 d\n");
  const std::string header = file(cpp_files(read()), "my_msgs.h");
  EXPECT_THAT(header, HasSubstr("    visit(\"a\", self.a);\n"
                                "    if (ros_distro() >= Distro::kilted) visit(\"b\", self.b);\n"
                                "    if (ros_distro() >= Distro::kilted) visit(\"c\", self.c);\n"
                                "    if (ros_distro() <= Distro::jazzy) visit(\"d\", self.d);\n"));
  EXPECT_THAT(file(idl_files(read(), Distro::jazzy), "my_msgs.idl"),
              HasSubstr("{\n  int8 a_;\n  int8 d_;\n}"));
  EXPECT_THAT(file(idl_files(read(), Distro::lyrical), "my_msgs.idl"),
              HasSubstr("{\n  int8 a_;\n  int8 b_;\n  int8 c_;\n}"));
}

TEST_F(Generator, WrongRangesAreRefusedWithTheirPlace) {
  EXPECT_EQ(error("msg Grip: [since kilted] int8 x\n"),
            "1:12: 'since' does not begin a range of distributions");
  EXPECT_EQ(error("msg Grip: [from kitled] int8 x\n"),
            "1:17: there is no distribution 'kitled'; did you mean 'kilted'?");
  EXPECT_EQ(error("msg Grip: [from kilted int8 x\n"), "1:23: ']' is missing behind the distribution");
  EXPECT_EQ(error("msg Grip: [from kilted] int8 X=1\n"), "1:30: a constant is in all distributions");
}

TEST_F(Generator, WrongDefinitionsAreRefusedWithTheirPlace) {
  EXPECT_EQ(error("msg Grip:\n  int8 a; flaot64 x\n"),
            "2:11: there is no type 'flaot64'; did you mean 'float64'?");
  EXPECT_EQ(error("msg Grip: Finger x\nmsg Finger: int8 a\n").substr(0, 35),
            "1:11: there is no type 'Finger'");
  EXPECT_EQ(error("msg Grip: my_mgs/Grip x\n"),
            "1:11: there is no package 'my_mgs'; did you mean 'my_msgs'?");
  EXPECT_EQ(error("mgs Grip: int8 x\n"), "1:1: 'mgs' does not begin a type; did you mean 'msg'?");
  EXPECT_EQ(error("  int8 x\n"), "1:3: an indented line belongs to a type, and there is none above it");
  EXPECT_EQ(error("msg Grip int8 x\n"), "1:9: ':' is missing behind the type's name");
  EXPECT_EQ(error("msg Grip: int8\n"), "1:15: a name is missing");
  EXPECT_EQ(error("msg Grip: int8 2x\n"), "1:16: a name is missing");
  EXPECT_EQ(error("msg Grip: int8 x, x\n"), "1:19: 'Grip' has two members 'x'");
  EXPECT_EQ(error("msg Grip: int8 x\nmsg Grip: int8 x\n"), "2:5: 'Grip' is defined twice");
  EXPECT_EQ(error("msg Grip: uint8 BIG=256\n"), "1:21: 256 is not a value of uint8");
  EXPECT_EQ(error("msg Grip: int8 x 1.5\n"), "1:18: 1.5 is not a value of int8");
  EXPECT_EQ(error("msg Grip: bool x 1\n"), "1:18: 1 is not a value of bool");
  EXPECT_EQ(error("msg Grip: string x \"a\n"), "1:20: the text has no end");
  EXPECT_EQ(error("msg Grip: int8 A=\n"), "1:18: the constant 'A' has no value");
  EXPECT_EQ(error("msg Grip: int8 a, B=1\n"), "1:19: a declaration has either fields or constants");
  EXPECT_EQ(error("msg Grip: int8 x 1 int8 y\n"), "1:20: ';' is missing between two declarations");
  EXPECT_EQ(error("msg Grip: int8[] x 1\n"), "1:20: only a single number, bool or string has a value");
  EXPECT_EQ(error("msg Grip: int8[0] x\n"), "1:16: a size is missing");
  EXPECT_EQ(error("msg Grip: int8[3 x\n"), "1:16: a size is missing");
  EXPECT_EQ(error("msg Grip: int8<=3 x\n"), "1:15: '<=3' does not belong to a type");
  EXPECT_EQ(error("srv Hold: int8 x\nmsg Grip: int8 x\n"), "1:5: srv 'Hold' has 1 of 2 parts");
  EXPECT_EQ(error("msg Grip: int8 x --- int8 y\n"), "1:18: msg 'Grip' has no further part");
}

TEST_F(Generator, PackagesThatUseEachOtherAreRefused) {
  write("a_msgs", "msg A: b_msgs/B b\n");
  write("b_msgs", "msg B: a_msgs/A a\n");
  try {
    read();
    FAIL() << "expected an error";
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), HasSubstr("b_msgs.msgs:1:8: error: the package 'a_msgs' uses this one"));
  }
}

TEST_F(Generator, UnreadableFileIsRefused) {
  files_.push_back(folder_ / "none_msgs.msgs");
  EXPECT_THROW(read(), InputError);
}

// The table of types against the fields of the structs, as the compiler has them.
template <Message M>
void expect_table_matches_struct() {
  const TypeDescription &table = describe<M>(), fields = messages_detail::describe_struct<M>(ros_distro());
  EXPECT_EQ(table.name, fields.name);
  EXPECT_EQ(table.least_cdr_size, fields.least_cdr_size) << table.name;
  ASSERT_EQ(table.fields.size(), fields.fields.size()) << table.name;
  for (std::size_t i = 0; i < fields.fields.size(); ++i) {
    const FieldDescription &row = table.fields[i], &field = fields.fields[i];
    EXPECT_EQ(to_string(row) + " " + row.name, to_string(field) + " " + field.name) << table.name;
    EXPECT_EQ(row.type, field.type) << table.name << " " << row.name;
    EXPECT_EQ(row.initial, field.initial) << table.name << " " << row.name;
  }
}

TEST(BuiltinTypes, TableMatchesStructs) {
  using namespace std_msgs::msg;
  expect_table_matches_struct<Byte>();
  expect_table_matches_struct<Char>();
  expect_table_matches_struct<Empty>();
  expect_table_matches_struct<geometry_msgs::msg::Quaternion>();
  expect_table_matches_struct<sensor_msgs::msg::CameraInfo>();
  expect_table_matches_struct<sensor_msgs::msg::NavSatStatus>();
  expect_table_matches_struct<shape_msgs::msg::SolidPrimitive>();
  expect_table_matches_struct<rmw_dds_common::msg::NodeEntitiesInfo>();
  expect_table_matches_struct<type_description_interfaces::srv::GetTypeDescription::Request>();
  expect_table_matches_struct<control_msgs::action::FollowJointTrajectory::Goal>();
}

// A struct of another library.
struct Colour {
  static constexpr std::uint8_t RED = 1, BLUE = 3;
  std::uint8_t value = 2;
  DOPPEL_MESSAGE("my_msgs/msg/Colour", value)
  DOPPEL_CONSTANTS(RED, BLUE)
};

TEST(BuiltinTypes, OtherStructsAreDescribedByTheirFieldsAndConstants) {
  EXPECT_EQ(definition_text(describe<Colour>()), "uint8 RED=1\nuint8 BLUE=3\nuint8 value\n");
  EXPECT_EQ(describe<Colour>().fields.front().initial, 2);
}

}  // namespace
}  // namespace doppel
