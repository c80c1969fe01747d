// The xacro expander on real robots: every case of ../shared/corpus by the rule of its README. Skipped if the
// corpus is not there.
#include <gtest/gtest.h>

#include <charconv>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

#include "doppel/description/xacro/xacro.h"

extern char** environ;

namespace doppel {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

const fs::path& corpus() {
  static const fs::path folder =
      fs::weakly_canonical(fs::path(DOPPEL_SOURCE_DIR) / ".." / "shared" / "corpus");
  return folder;
}

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  for (std::size_t i = 0; (i = text.find(from, i)) != std::string::npos;) {
    const std::size_t after = i + from.size();
    const char next = after < text.size() ? text[after] : ' ';
    if (std::isalnum(static_cast<unsigned char>(next)) != 0 ||
        std::string_view("_.+-").find(next) != std::string_view::npos) {
      i = after;
      continue;
    }
    text.replace(i, from.size(), to);
    i += to.size();
  }
  return text;
}

// Absolute folders as the corpus writes them: /pkgs/NAME, /corpus.
std::string portable(std::string text, const Json& packages) {
  std::vector<std::pair<std::string, std::string>> folders;
  for (const auto& [name, folder] : packages.items())
    folders.emplace_back((corpus() / folder.get<std::string>()).string(), "/pkgs/" + name);
  std::sort(folders.begin(), folders.end(),
            [](const auto& a, const auto& b) { return a.first.size() > b.first.size(); });
  folders.emplace_back(corpus().string(), "/corpus");
  for (const auto& [folder, name] : folders) text = replaced(std::move(text), folder, name);
  return text;
}

std::optional<double> number(const std::string& token) {
  double value = 0;
  const char* begin = token.data() + (token.starts_with('+') ? 1 : 0);
  const auto [end, error] = std::from_chars(begin, token.data() + token.size(), value);
  if (error != std::errc{} || end != token.data() + token.size()) return std::nullopt;
  return value;
}

bool same_text(const std::string& a, const std::string& b) {
  std::istringstream left(a), right(b);
  std::string x, y;
  while (true) {
    const bool more = static_cast<bool>(left >> x);
    if (more != static_cast<bool>(right >> y)) return false;
    if (!more) return true;
    if (x == y) continue;
    const auto p = number(x), q = number(y);
    if (!p || !q) return false;
    const double apart = std::abs(*p - *q);
    if (!(apart <= 1e-12 * std::max(std::abs(*p), std::abs(*q)) || apart < 1e-15)) return false;
  }
}

std::map<std::string, std::string> attributes(const XmlNode& node, const Json& packages) {
  std::map<std::string, std::string> out;
  for (const XmlAttribute& a : node.attributes) {
    if (a.name != "xmlns" && !a.name.starts_with("xmlns:")) out[a.name] = portable(a.value, packages);
  }
  return out;
}

// Elements, and the texts between them, joined across what is left out.
struct Piece {
  const XmlNode* element = nullptr;
  std::string text;
};
std::vector<Piece> pieces(const XmlNode& node, const Json& packages) {
  std::vector<Piece> out;
  std::string text;
  const auto flush = [&] {
    if (text.find_first_not_of(" \t\r\n") != std::string::npos)
      out.push_back({nullptr, portable(text, packages)});
    text.clear();
  };
  for (const XmlNode& child : node.children) {
    if (child.kind == XmlNode::Kind::text) text += child.text;
    if (child.kind != XmlNode::Kind::element) continue;
    flush();
    out.push_back({&child, ""});
  }
  flush();
  return out;
}

// The first difference, with the path to it; "" if there is none.
std::string difference(const XmlNode& got, const XmlNode& wanted, const Json& packages,
                       const std::string& path) {
  const std::string here = path + "/" + wanted.name;
  if (got.name != wanted.name) return here + ": the element is called '" + got.name + "'";
  const auto have = attributes(got, packages), want = attributes(wanted, packages);
  for (const auto& [name, value] : want) {
    const auto found = have.find(name);
    if (found == have.end()) return here + ": no attribute " + name;
    if (!same_text(found->second, value))
      return here + ": " + name + " is '" + found->second + "', not '" + value + "'";
  }
  for (const auto& [name, value] : have) {
    if (!want.contains(name)) return here + ": an attribute " + name + "='" + value + "' too many";
  }
  const auto left = pieces(got, packages), right = pieces(wanted, packages);
  for (std::size_t i = 0; i < std::min(left.size(), right.size()); ++i) {
    if ((left[i].element == nullptr) != (right[i].element == nullptr))
      return here + ": text and element differ at child " + std::to_string(i);
    if (left[i].element == nullptr) {
      if (!same_text(left[i].text, right[i].text))
        return here + ": the text is '" + left[i].text + "', not '" + right[i].text + "'";
      continue;
    }
    std::string below = difference(*left[i].element, *right[i].element, packages, here);
    if (!below.empty()) return below;
  }
  if (left.size() != right.size())
    return here + ": " + std::to_string(left.size()) + " children, not " + std::to_string(right.size());
  return "";
}

// The rule that corresponds to a kind of error in the manifest.
std::string rule_of(const std::string& kind) {
  static const std::map<std::string, std::string> rules{
      {"undefined_substitution_argument", "xacro.undefined_argument"},
      {"file_not_found", "xacro.file_not_found"},
      {"package_not_found", "xacro.package_not_found"},
      {"xml_not_well_formed", "xml.not_well_formed"},
      {"environment_variable_not_set", "xacro.environment"},
      {"not_a_boolean", "xacro.not_boolean"}};
  return rules.at(kind);
}

// Only this case's ROS variables.
void set_environment(const Json& variables) {
  std::vector<std::string> stale;
  for (char** entry = environ; *entry != nullptr; ++entry) {
    const std::string name = std::string(*entry).substr(0, std::string(*entry).find('='));
    for (const char* prefix : {"ROS_", "AMENT_", "COLCON_", "GZ_", "GAZEBO_"}) {
      if (name.starts_with(prefix)) stale.push_back(name);
    }
  }
  for (const std::string& name : stale) unsetenv(name.c_str());
  for (const auto& [name, value] : variables.items())
    setenv(name.c_str(), value.get<std::string>().c_str(), 1);
}

std::string describe_error(const InputError& error, const Json& record) {
  const std::string message = portable(error.what(), record["packages"]);
  if (record["expect"] == "ok") return "refused: " + message;
  const Json& wanted = record["error"];
  std::string subject = wanted["subject"];
  if (subject.starts_with("line ")) subject = ":" + subject.substr(5) + ":";
  const std::string rule = rule_of(wanted["kind"]);
  if (error.diagnostics().front().rule != rule)
    return "refused by " + error.diagnostics().front().rule + ", not by " + rule + ": " + message;
  return message.find(subject) == std::string::npos ? "the error does not name " + subject + ": " + message
                                                    : "";
}

std::string problem_of(const Json& record) {
  set_environment(record["env"]);
  const fs::path input = corpus() / record["input"].get<std::string>();
  PackageResolver resolver;
  for (const auto& [name, folder] : record["packages"].items())
    resolver.add_package(name, corpus() / folder.get<std::string>());
  std::vector<std::pair<std::string, std::string>> arguments;
  for (const std::string argument : record["args"]) {
    const std::size_t at = argument.find(":=");
    arguments.emplace_back(argument.substr(0, at), argument.substr(at + 2));
  }
  try {
    if (record["kind"] == "urdf" && record["expect"] == "ok") return load_xml(input).name.empty() ? "?" : "";
    Diagnostics diagnostics;
    const XacroResult result = expand_xacro(input, arguments, resolver, diagnostics);
    if (record["expect"] == "error") return "was not refused";
    const XmlNode wanted = load_xml((corpus() / record["expected"].get<std::string>()).string());
    return difference(result.tree.node(), wanted, record["packages"], "");
  } catch (const InputError& error) {
    return describe_error(error, record);
  }
}

TEST(XacroCorpus, EveryRobotExpandsAsByReference) {
  std::ifstream in(corpus() / "manifest.json");
  if (!in) GTEST_SKIP() << "no corpus at " << corpus();
  const Json manifest = Json::parse(in);
  const fs::path before = fs::current_path();
  fs::current_path(corpus());
  std::size_t failed = 0;
  for (const Json& record : manifest) {
    const std::string fault = problem_of(record);
    if (fault.empty()) continue;
    ++failed;
    ADD_FAILURE() << record["id"].get<std::string>() << ": " << fault;
  }
  fs::current_path(before);
  RecordProperty("cases", static_cast<int>(manifest.size()));
  EXPECT_EQ(failed, 0U) << "expected no failures in " << manifest.size() << " cases";
  EXPECT_GE(manifest.size(), 321U);
}

}  // namespace
}  // namespace doppel
