#include "doppel/description/xacro/detail/xacro_yaml.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <utility>

namespace doppel::xacro {
namespace {

// The value as Python writes it; "error" for text that is refused.
std::string value_of(const std::string& text) {
  try {
    return parse_yaml(text, "f", {}).repr();
  } catch (const InputError&) {
    return "error";
  }
}

// The values are those of PyYAML's safe_load; units are those of xacro.
TEST(XacroYaml, ParameterFilesHaveValuesOfPyYaml) {
  const std::pair<const char*, const char*> files[] = {
      {"a: 1\nb: 2.5\nc: text\n", "{'a': 1, 'b': 2.5, 'c': 'text'}"},
      {"# c\n---\na:   1   # one\n\n\nb:\n  c: yes\n  d: !degrees 90\n  e: !radians  pi/2\nf: ~\ng:\n",
       "{'a': 1, 'b': {'c': True, 'd': 1.5707963267948966, 'e': 1.5707963267948966}, 'f': None, 'g': None}"},
      {"a: [1, 2.5, [x, 'y'], ]\nb: []\nc:\n- 1\n- x y\nd:\n  - p\n  - [1]\ne: 'q # no'\n",
       "{'a': [1, 2.5, ['x', 'y']], 'b': [], 'c': [1, 'x y'], 'd': ['p', [1]], 'e': 'q # no'}"},
      {"a: package://p/meshes/x.stl\nb: -1e-5\nc: 1.0e-5\nd: .5\ne: a b c\nf: 1:30\n",
       "{'a': 'package://p/meshes/x.stl', 'b': '-1e-5', 'c': 1e-05, 'd': 0.5, 'e': 'a b c', 'f': 90}"},
      {"a: 1\na: 2\n", "{'a': 2}"},
      {"- 1\n- a\n- \"b\"\n", "[1, 'a', 'b']"},
      {"a: &x 1\nb: *x\n", "{'a': 1, 'b': 1}"},
      {"a: |\n  text\n", "{'a': 'text\\n'}"},
      {"a: {b: 1}\n", "{'a': {'b': 1}}"},
      {"a: b\n  c\n", "{'a': 'b c'}"},
      {"? a\n: b\n", "{'a': 'b'}"},
      {"a: \"\\n\"\n", "{'a': '\\n'}"},
      {"- a: 1\n", "[{'a': 1}]"},
      {"<<: {a: 1}\n", "{'a': 1}"},
      {"", "None"},
      {"a: 'it''s'\n", "{'a': \"it's\"}"},
  };
  for (const auto& [text, value] : files) EXPECT_EQ(value_of(text), value) << text;
}

TEST(XacroYaml, TextThatIsNotYamlIsRefused) {
  for (const char* text : {"a: b: c\n", "a:\n b: 1\n  c: 2\n", "a: [1\n", "<<: 1\n", "a: @x\n",
                           "a: !other 1\n", "a: !degrees *x\n", "a: 1\n---\nb: 2\n"})
    EXPECT_EQ(value_of(text), "error") << text;
}

// Found by fuzzing: yaml-cpp reads an endless sequence of documents in it.
TEST(XacroYaml, InvalidYamlIsRefusedQuickly) {
  EXPECT_THROW(parse_yaml(", yes, !degree yes, !degrees 80]\nb: {z<: {c: 1}, d: *a}\n", "f", {}), InputError);
}

}  // namespace
}  // namespace doppel::xacro
