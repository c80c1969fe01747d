#include "doppel/lab/verification/engine_table.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>

#include "doppel/physics/contract/engine_modules.h"

namespace doppel {
namespace {

using ::testing::HasSubstr;

TEST(EngineTable, DocumentationMatchesCode) {
  for (const KnownEngine& engine : known_engines()) {
    if (!engine.available) GTEST_SKIP() << engine.name << " is not in this build";
  }
  std::ifstream file(DOPPEL_SOURCE_DIR "/docs/engines.md");
  const std::string text{std::istreambuf_iterator<char>(file), {}};
  EXPECT_THAT(text, HasSubstr(engines_markdown()))
      << "the table is outdated; regenerate it: doppel engines --markdown";
}

TEST(EngineTable, TextAndJsonNameEveryKnownEngine) {
  const auto json = nlohmann::json::parse(engines_json());
  ASSERT_EQ(json["engines"].size(), known_engines().size());
  for (std::size_t i = 0; i < known_engines().size(); ++i) {
    const KnownEngine engine = known_engines()[i];
    EXPECT_EQ(json["engines"][i]["name"], engine.name);
    EXPECT_EQ(json["engines"][i]["available"], engine.available);
    EXPECT_EQ(json["engines"][i].contains("tolerances"), engine.available);
    EXPECT_THAT(engines_text(), HasSubstr(engine.name));
    EXPECT_EQ(engines_text().find("install " + engine.package) != std::string::npos, !engine.available);
  }
}

}  // namespace
}  // namespace doppel
