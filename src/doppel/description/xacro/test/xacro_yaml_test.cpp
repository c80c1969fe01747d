#include "doppel/description/xacro/detail/xacro_yaml.h"

#include <gtest/gtest.h>

#include <filesystem>

namespace doppel::xacro {
namespace {

// What the simple reader accepts, it reads as yaml-cpp does.
void agree(const std::string& text, const std::string& name, bool required) {
  const auto simple = parse_simple_yaml(text);
  EXPECT_TRUE(simple || !required) << name;
  if (!simple) return;
  EXPECT_EQ(simple->repr(), parse_whole_yaml(text, name, {}).repr()) << name;
}

TEST(XacroYaml, SimpleReaderReadsParameterFiles) {
  const char* const texts[] = {
      "a: 1\nb: 2.5\nc: text\n",
      "# c\n---\na:   1   # one\n\n\nb:\n  c: yes\n  d: !degrees 90\n  e: !radians  pi/2\nf: ~\ng:\n",
      "a: [1, 2.5, [x, 'y'], ]\nb: []\nc:\n- 1\n- x y\nd:\n  - p\n  - [1]\ne: 'q # no'\n",
      "a: package://p/meshes/x.stl\nb: -1e-5\nc: 1.0e-5\nd: .5\ne: a b c\nf: 1:30\n",
      "a: 1\na: 2\n",
      "- 1\n- a\n- \"b\"\n",
  };
  for (const char* text : texts) agree(text, text, true);
}

TEST(XacroYaml, SimpleReaderDefersOtherYaml) {
  const char* const texts[] = {
      "a: &x 1\nb: *x\n", "a: |\n  text\n",  "a: {b: 1}\n",
      "a: b\n  c\n",      "a: b: c\n",       "? a\n: b\n",
      "a: \"\\n\"\n",     "a:\t1\n",         "a:\n b: 1\n  c: 2\n",
      "- a: 1\n",         "a: 1\n---\nb: 2", "a: @x\n",
      "a: [1\n",          "<<: 1\n",         "",
      "a: !other 1\n",    "a: 'it''s'\n",    "a: !degrees *x\n",
      "a: [1? x 9]\n"};  // found by fuzzing: in a list on one line a question mark ends a scalar
  for (const char* text : texts) EXPECT_FALSE(parse_simple_yaml(text)) << text;
}

// Found by fuzzing: yaml-cpp reads an endless sequence of documents in it.
TEST(XacroYaml, InvalidYamlIsRefusedQuickly) {
  EXPECT_THROW(parse_whole_yaml(", yes, !degree yes, !degrees 80]\nb: {z<: {c: 1}, d: *a}\n", "f", {}),
               InputError);
  EXPECT_THROW(parse_whole_yaml("a: 1\n---\nb: 2\n", "f", {}), InputError);
}

TEST(XacroYaml, BothReadersAgreeOverCorpus) {
  const std::filesystem::path folder = std::filesystem::path(DOPPEL_SOURCE_DIR) / "../shared/corpus/robots";
  if (!std::filesystem::exists(folder)) GTEST_SKIP() << "the corpus is not here";
  int seen = 0, simple = 0;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
    if (entry.path().extension() != ".yaml") continue;
    const std::string text = read_file(entry.path().string(), 1 << 22);
    ++seen;
    simple += parse_simple_yaml(text) ? 1 : 0;
    agree(text, entry.path().string(), false);
  }
  EXPECT_GT(simple * 2, seen);
}

}  // namespace
}  // namespace doppel::xacro
