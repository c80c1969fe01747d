// JSON is read as YAML is: the same bytes, and the same words at the same places where it is refused.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <random>

#include "doppel/ros/messages/rcl_interfaces.h"
#include "doppel/ros/messages/std_srvs.h"
#include "doppel/ros/messages/trajectory_msgs.h"
#include "messages_testing.h"

namespace doppel {
namespace {

using messages_testing::new_seed;
using std_msgs::msg::Float64;
using std_msgs::msg::Int64;
using std_msgs::msg::String;
using testing::HasSubstr;
using Trajectory = trajectory_msgs::msg::JointTrajectory;

template <class M>
M read_json(std::string_view json) {
  Bytes bytes;
  M message;
  const Status status = type_support<M>().json_to_cdr(json, bytes);
  EXPECT_TRUE(status) << status.why();
  EXPECT_TRUE(!status || from_cdr(bytes, message));
  return message;
}

template <class M>
std::string json_error(std::string_view json) {
  Bytes bytes;
  const Status status = type_support<M>().json_to_cdr(json, bytes);
  EXPECT_FALSE(status) << json;
  return status.why();
}

std::string in_lists(std::string_view inner, std::size_t depth) {
  return std::string(depth, '[').append(inner).append(depth, ']');
}

TEST(JsonReader, MessageIsRead) {
  const auto t = read_json<Trajectory>(
      R"({"header": {"stamp": {"secs": 3}}, "joint_names" :
["Revolute 2", "a\"\\\/\n\u00e4"],"points":[{"positions":[1,-0.5e0],"time_from_start":1500000000}]})");
  EXPECT_EQ(t.header.stamp.sec, 3);
  EXPECT_EQ(t.joint_names, (std::vector<std::string>{"Revolute 2", "a\"\\/\n\xC3\xA4"}));
  EXPECT_EQ(t.points.at(0).positions, (std::vector<double>{1.0, -0.5}));
  EXPECT_EQ(t.points.at(0).time_from_start.nanosec, 500'000'000U);
  EXPECT_EQ(read_json<geometry_msgs::msg::Pose>("null").orientation.w, 1.0);
  EXPECT_EQ(read_json<geometry_msgs::msg::Pose>("\xEF\xBB\xBF {}").orientation.w, 1.0);
  read_json<std_srvs::srv::Trigger::Request>("{}");
}

TEST(JsonReader, SurrogatePairIsOneCharacter) {
  EXPECT_EQ(read_json<String>(R"({"data": "\ud83e\udd16"})").data, "\xF0\x9F\xA4\x96");
  EXPECT_THAT(json_error<String>(R"({"data": "\ud83e"})"), HasSubstr("1:17: not JSON: "));
}

TEST(JsonReader, NumbersKeepTheirDigits) {
  EXPECT_EQ(read_json<Int64>(R"({"data": 9007199254740993})").data, 9007199254740993);
  EXPECT_EQ(read_json<Int64>(R"({"data": -9223372036854775808})").data, INT64_MIN);
  EXPECT_EQ(read_json<std_msgs::msg::UInt64>(R"({"data":18446744073709551615})").data, UINT64_MAX);
  EXPECT_EQ(read_json<String>(R"({"data": 1.50})").data, "1.50");
  EXPECT_EQ(read_json<String>("{\"data\":-0\n}").data, "-0");
  EXPECT_EQ(read_json<String>(R"({"data": true})").data, "true");
  EXPECT_TRUE(std::signbit(read_json<Float64>(R"({"data": -0})").data));
  EXPECT_EQ(read_json<Float64>(R"({"data": 100000000000000000000000})").data, 1e23);
}

TEST(JsonReader, NumberInStringIsReadAsInYaml) {
  EXPECT_EQ(read_json<Float64>(R"({"data": "-.inf"})").data, -INFINITY);
  EXPECT_TRUE(std::isnan(read_json<Float64>(R"({"data": "nan"})").data));
  EXPECT_EQ(read_json<Int64>(R"({"data": "0x10"})").data, 16);
  EXPECT_THAT(json_error<std_msgs::msg::Bool>(R"({"data": "true"})"), HasSubstr("true or false"));
}

TEST(JsonReader, WhatIsNoJsonIsRefusedWithItsPlace) {
  EXPECT_EQ(json_error<Int64>("").substr(0, 15), "1:1: not JSON: ");
  EXPECT_THAT(json_error<Int64>("{\"data\":\n  1,}"), HasSubstr("2:5: not JSON: unexpected '}'"));
  EXPECT_THAT(json_error<Int64>("{data: 1}"), HasSubstr("1:2: not JSON: invalid literal"));
  EXPECT_THAT(json_error<Int64>(R"({"data": 1} {})"), HasSubstr("1:13: not JSON: "));
  EXPECT_THAT(json_error<Float64>(R"({"data": NaN})"), HasSubstr("not JSON: invalid literal"));
  using namespace std::string_view_literals;
  EXPECT_EQ(json_error<Float64>("{\"data\": 1}\0 rest"sv), "1:12: not JSON: a zero byte");
  EXPECT_THAT(json_error<Float64>(R"({"data": 1e400})"), HasSubstr("not JSON: number overflow"));
  EXPECT_EQ(json_error<Float64>(R"({"data": 1e-400})"), "1:10: '1e-400', but 'data' is a number");
  const std::string why = json_error<String>("{\"data\": \"\xFF\"}");
  EXPECT_THAT(why, HasSubstr("ill-formed UTF-8 byte"));
  EXPECT_EQ(why.find('\xFF'), std::string::npos) << "an answer is UTF-8";
}

TEST(JsonReader, KeyGivenTwiceIsRefused) {
  EXPECT_EQ(json_error<Int64>("{\"data\": 1,\n \"data\": 2}"), "2:2: field 'data' is given twice");
}

// An answer is UTF-8, and names and values are as long as their message at most.
TEST(JsonReader, LongNamesAndValuesAreShownByTheirBegin) {
  constexpr std::size_t kLong = 1'000'000;
  const std::string name(kLong, 'x');
  const std::string why = json_error<Int64>("{\"" + name + "\": 1}");
  EXPECT_THAT(why, HasSubstr("std_msgs/msg/Int64 has no field '" + std::string(100, 'x') + "...'"));
  EXPECT_LT(why.size(), 200U);
  EXPECT_EQ(json_error<Int64>("{\"data\": \"" + name + "\"}"),
            "1:10: '" + std::string(100, 'x') + "...', but 'data' is an integer");
  std::string euros = "xx";  // A character of three bytes is across the end of what is shown.
  while (euros.size() < kLong) euros += "\xE2\x82\xAC";
  EXPECT_TRUE(nlohmann::json::accept("\"" + json_error<Int64>("{\"" + euros + "\": 1}") + "\""));
}

TEST(JsonReader, DeepTextIsRefusedWithoutStack) {
  constexpr std::size_t kDepth = 100'000;
  EXPECT_THAT(json_error<Int64>(std::string(kDepth, '[')), HasSubstr("unexpected end of input"));
  EXPECT_THAT(json_error<Int64>(in_lists("", kDepth)), HasSubstr("a list where a std_msgs/msg/Int64"));
  EXPECT_THAT(json_error<Int64>("{\"data\":" + in_lists("1", kDepth) + "}"), HasSubstr("is an integer"));
  Bytes bytes;
  EXPECT_FALSE(type_support<Int64>().yaml_to_cdr(in_lists("", kDepth), bytes));
}

struct Reading {
  bool good = false;
  std::string result;  // the bytes, or why not
  bool operator==(const Reading&) const = default;
};
std::ostream& operator<<(std::ostream& out, const Reading& reading) {
  return out << (reading.good ? "read: " : "refused: ") << reading.result;
}

Reading reading_of(const Status& status, const Bytes& bytes) {
  return {status.ok(), status ? messages_testing::show(bytes) : status.why()};
}
Reading by_json(const TypeSupport& type, const std::string& text) {
  Bytes bytes;
  const Status status = type.json_to_cdr(text, bytes);
  return reading_of(status, bytes);
}
Reading by_yaml(const TypeSupport& type, const std::string& text) {
  Bytes bytes;
  const Status status = type.yaml_to_cdr(text, bytes);
  return reading_of(status, bytes);
}

TEST(JsonReader, EveryTypeIsReadAsByYaml) {
  const unsigned seed = new_seed();
  std::mt19937 random(seed);
  for (const TypeSupport* type : messages_testing::all_types()) {
    for (int round = 0; round < 10; ++round) {
      const Bytes bytes = messages_testing::random_message(*type->description(), random);
      std::string json;
      ASSERT_TRUE(type->cdr_to_json(bytes, json));
      const Reading reading = by_json(*type, json);
      ASSERT_EQ(reading, by_yaml(*type, json)) << type->name << " seed " << seed << "\n" << json;
      if (json.find("null") != std::string::npos) continue;  // an infinity
      ASSERT_EQ(reading.result, messages_testing::show(bytes)) << type->name << " seed " << seed;
    }
  }
}

// The damage has no line breaks, which YAML does not permit before a colon.
TEST(JsonReader, DamagedTextIsReadAsByYamlOrIsNoJson) {
  constexpr std::string_view kDamage = "{}[]\",:0123456789-+.eEtrufalsn \\";
  const unsigned seed = new_seed();
  std::mt19937 random(seed);
  std::size_t still_json = 0;
  for (const TypeSupport* type : messages_testing::all_types()) {
    std::string json;
    ASSERT_TRUE(type->cdr_to_json(messages_testing::random_message(*type->description(), random), json));
    for (int round = 0; round < 20; ++round) {
      std::string text = json;
      for (std::size_t n = 1 + random() % 2; n > 0; --n) {
        const std::size_t place = random() % text.size();
        text.erase(place, random() % 3);
        if (random() % 3 > 0) text.insert(place, 1, kDamage[random() % kDamage.size()]);
        if (text.empty()) text = "0";
      }
      const Reading reading = by_json(*type, text);
      if (nlohmann::json::accept(text)) {
        ++still_json;
        ASSERT_EQ(reading, by_yaml(*type, text)) << type->name << " seed " << seed << "\n" << text;
      } else {
        ASSERT_THAT(reading.result, HasSubstr("not JSON: ")) << type->name << " seed " << seed << "\n"
                                                             << text;
      }
    }
  }
  EXPECT_GT(still_json, 100U);
}

}  // namespace
}  // namespace doppel
