#include "doppel/base/yaml/yaml_fields.h"

#include <gmock/gmock.h>

#include <fstream>

namespace doppel {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

const YamlRules kRules{"plan.syntax", "plan.unreadable", "plan.too_large", "plan.invalid",
                       "plan.unknown_key"};

class YamlFieldsTest : public testing::Test {
 protected:
  static PlacedYaml load(const std::string& text) {
    const std::filesystem::path file = std::filesystem::path(testing::TempDir()) / "fields.yaml";
    std::ofstream(file) << text;
    return load_yaml(file, kRules, "plan");
  }
  static std::string error_of(const std::string& text) {
    try {
      load(text);
    } catch (const InputError& error) {
      return error.what();
    }
    return "accepted";
  }
  // The only error so far.
  std::string message() {
    EXPECT_EQ(reader_.errors().all().size(), 1u);
    return reader_.errors().all().empty() ? "" : reader_.errors().all().front().str();
  }

  YamlFields reader_{kRules};
};

TEST_F(YamlFieldsTest, EachValueHasItsPlace) {
  const PlacedYaml root = load("a: 1\nb:\n  - x\n  - {c: true}\n");
  ASSERT_TRUE(root.is_map());
  EXPECT_EQ(root["a"].text, "1");
  EXPECT_EQ(root["b"].items[1]["c"].where.line, 4);
  EXPECT_EQ(root["b"].items[1]["c"].where.column, 9);
  EXPECT_FALSE(root["missing"]);
  EXPECT_FALSE(root["a"]["missing"]);
}

TEST_F(YamlFieldsTest, JsonIsRead) {
  const PlacedYaml root = load(R"({"a": [1.5, -2e3], "b": "x\ny", "c": null})");
  EXPECT_THAT(reader_.numbers(root["a"], "a", 2), ElementsAre(1.5, -2000.0));
  EXPECT_EQ(root["b"].text, "x\ny");
  EXPECT_TRUE(root["c"].is_null());
}

TEST_F(YamlFieldsTest, UnknownKeyHasPlaceAndNearestKey) {
  EXPECT_TRUE(reader_.fields(load("sped: 1\n"), "a plan", {"speed", "name"}));
  EXPECT_THAT(message(),
              HasSubstr("fields.yaml:1:1: error: a plan has no key 'sped'; did you mean 'speed'?"));
}

TEST_F(YamlFieldsTest, SecondKeyIsError) {
  EXPECT_TRUE(reader_.fields(load("name: a\nname: b\n"), "a plan", {"name"}));
  EXPECT_THAT(message(), HasSubstr("fields.yaml:2:1: error: the key 'name' is given twice"));
}

TEST_F(YamlFieldsTest, ValueThatIsNoNumberIsError) {
  EXPECT_EQ(reader_.number(load("fast"), "speed"), 0.0);
  EXPECT_THAT(message(), HasSubstr("speed must be a number, not 'fast'"));
}

TEST_F(YamlFieldsTest, NumberThatIsNotFiniteIsError) {
  EXPECT_EQ(reader_.number(load(".inf"), "speed"), 0.0);
  EXPECT_THAT(message(), HasSubstr("speed must be a number, not '.inf'"));
}

TEST_F(YamlFieldsTest, UnknownChoiceHasNearestOne) {
  EXPECT_EQ(reader_.choice(load("flaoting"), "base", {"fixed", "floating"}), 0u);
  EXPECT_THAT(message(),
              HasSubstr("base is 'flaoting'; it must be one of fixed, floating; did you mean 'floating'?"));
}

TEST_F(YamlFieldsTest, TextThatIsNotYamlHasPlaceAndFix) {
  EXPECT_THAT(error_of("a: [1, 2\n"), HasSubstr("plan.syntax"));
  EXPECT_THAT(error_of("a: [1, 2\n"), HasSubstr("close the list"));
}

TEST_F(YamlFieldsTest, TextThatIsNotUtf8HasPlaceAndFix) {
  for (const char* text : {"a: 1\nb: x\xff\n", "a: 1\nb\xc3: 2\n"}) {
    EXPECT_THAT(error_of(text), HasSubstr("fields.yaml:2:")) << text;
    EXPECT_THAT(error_of(text), HasSubstr("this text is not UTF-8")) << text;
  }
  EXPECT_EQ(load("a: Größe\n")["a"].text, "Größe");
}

TEST_F(YamlFieldsTest, FileThatIsMissingIsError) {
  EXPECT_THROW(load_yaml("/there/is/no.yaml", kRules, "plan"), InputError);
  EXPECT_THROW(load_yaml("/dev/zero", kRules, "plan"), InputError);
}

TEST_F(YamlFieldsTest, AliasThatNamesItselfIsRefused) {
  EXPECT_THAT(error_of("a: &a [*a]\n"),
              testing::AnyOf(HasSubstr("plan.too_large"), HasSubstr("plan.syntax")));
}

TEST_F(YamlFieldsTest, AliasesThatMultiplyAreRefused) {
  std::string text = "a0: &a0 [1, 1, 1, 1, 1, 1, 1, 1, 1, 1]\n";
  for (int i = 1; i < 10; ++i) {
    const std::string before = "*a" + std::to_string(i - 1);
    text += "a" + std::to_string(i) + ": &a" + std::to_string(i) + " [";
    for (int k = 0; k < 9; ++k) text += before + ", ";
    text += before + "]\n";
  }
  EXPECT_THAT(error_of(text), HasSubstr("plan.too_large"));
}

}  // namespace
}  // namespace doppel
