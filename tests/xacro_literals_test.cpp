// Literals in every place where xacro reads them, compared with the results of ros/xacro;
// tools/make_xacro_literals writes the table.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>

#include "doppel/description/xacro/xacro.h"

namespace doppel {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

std::string with_literal(const std::string& text, const std::string& literal) {
  std::string out;
  for (const char c : text) {
    if (c == '@')
      out += literal;
    else
      out += c;
  }
  return out;
}

void write(const fs::path& file, const std::string& text) {
  std::ofstream(file) << text;
}

const XmlNode* first_result(const XmlNode& node) {
  for (const XmlNode& child : node.children) {
    if (child.is("r")) return &child;
    if (const XmlNode* const found = first_result(child)) return found;
  }
  return nullptr;
}

// The attribute v of the first <r>, or its text; null if the document is rejected.
Json result(const std::string& document, const fs::path& file) {
  try {
    Diagnostics diagnostics;
    const XacroResult expanded =
        expand_xacro(parse_xml_tree(document, file.string()), file, {}, PackageResolver(), diagnostics);
    const XmlNode root = expanded.tree.node();
    const XmlNode* const found = first_result(root);
    if (found == nullptr) return "";
    if (const XmlAttribute* const v = found->find("v")) return v->value;
    std::string text;
    for (const XmlNode& child : found->children) {
      if (child.kind == XmlNode::Kind::text) text += child.text;
    }
    return text;
  } catch (const InputError&) {
    return nullptr;
  }
}

TEST(XacroLiterals, EveryLiteralMatchesReference) {
  std::ifstream in(fs::path(DOPPEL_SOURCE_DIR) / "tests" / "xacro_literals.json");
  const Json table = Json::parse(in);
  const fs::path folder = fs::path(testing::TempDir()) / "xacro_literals";
  fs::create_directories(folder);
  for (const auto& [name, text] : table["files"].items()) write(folder / name, text);
  const std::string space =
      R"(<a xmlns:xacro="http://www.ros.org/wiki/xacro"><xacro:property name="p" value="@"/></a>)";
  std::size_t cases = 0;
  for (std::size_t i = 0; i < table["literals"].size(); ++i) {
    const std::string literal = table["literals"][i], escaped = escape_xml(literal, true);
    write(folder / "literal.yaml", "v: " + literal + "\n");
    write(folder / "space.xacro", with_literal(space, escaped));
    for (const Json& context : table["contexts"]) {
      if (context["values"][i] == false) continue;
      EXPECT_EQ(result(with_literal(context["document"], escaped), folder / "case.xacro"),
                context["values"][i])
          << context["name"].get<std::string>() << ": " << literal;
      ++cases;
    }
  }
  EXPECT_GE(cases, 10'000U);
  fs::remove_all(folder);
}

}  // namespace
}  // namespace doppel
