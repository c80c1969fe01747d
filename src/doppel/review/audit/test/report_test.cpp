#include <nlohmann/json.hpp>
#include <regex>
#include <sstream>

#include "doppel/review/audit/report_places.h"
#include "doppel/review/audit/test/audit_fixture.h"

namespace doppel::audit_test {
namespace {

using Json = nlohmann::json;

class ReportTest : public AuditTest {
 protected:
  // Findings of all severities, one of them inside a macro.
  AuditReport report() {
    const std::string text =
        "<robot name=\"r\" xmlns:xacro=\"http://www.ros.org/wiki/xacro\">\n<xacro:macro name=\"m\" "
        "params=\"n\">\n<link name=\"${n} %\">\n"
        "<inertial><mass value=\"0\"/><inertia ixx=\"1\" ixy=\"0\" ixz=\"0\" iyy=\"1\" iyz=\"0\" "
        "izz=\"1\"/></inertial></link>\n</xacro:macro>\n"
        "<link name=\"base\"/>\n<xacro:m n=\"a\"/>\n<joint name=\"j\" type=\"revolute\"><parent "
        "link=\"base\"/><child link=\"a %\"/><axis xyz=\"0 0 1\"/>"
        "<limit lower=\"-90\" upper=\"90\" effort=\"0\" velocity=\"-2\"/></joint>\n<material "
        "name=\"m\"><color rgba=\"255 0 0 1\"/></material></robot>\n";
    return check(text, "r.xacro");
  }
};

TEST_F(ReportTest, JsonHasAllFields) {
  const AuditReport r = report();
  const Json json = Json::parse(to_json(r));
  EXPECT_EQ(json["version"], 1);
  EXPECT_EQ(json["links"], 2);
  EXPECT_EQ(json["joints"], 1);
  EXPECT_EQ(json["mass"], 0.0);
  EXPECT_EQ(json["findings"].size(), r.findings.size());
  EXPECT_EQ(json["counts"]["error"], r.count(Severity::error));
  EXPECT_GT(r.count(Severity::error), 0U);
  EXPECT_GT(r.count(Severity::warning), 0U);
  bool through_macro = false;
  for (const Json& f : json["findings"]) {
    for (const char* field : {"rule", "severity", "subject", "message", "file", "line", "column", "stack",
                              "fix", "consequence", "fixable"}) {
      EXPECT_TRUE(f.contains(field)) << field;
    }
    for (const Json& call : f["stack"]) {
      through_macro = true;
      EXPECT_EQ(call["line"], 7);
      EXPECT_TRUE(call.contains("what") && call.contains("file") && call.contains("column"));
    }
  }
  EXPECT_TRUE(through_macro);
}

TEST_F(ReportTest, SarifNamesRulesAndPlaces) {
  const AuditReport r = report();
  const Json sarif = Json::parse(to_sarif(r));
  EXPECT_EQ(sarif["version"], "2.1.0");
  const Json& run = sarif["runs"][0];
  const Json& rules = run["tool"]["driver"]["rules"];
  bool related = false;
  for (const Json& result : run["results"]) {
    EXPECT_EQ(rules[result["ruleIndex"].get<std::size_t>()]["id"], result["ruleId"]);
    EXPECT_TRUE(result["message"].contains("text"));
    const Json& place = result["locations"][0]["physicalLocation"];
    EXPECT_GE(place["region"]["startLine"], 1);
    EXPECT_TRUE(place["artifactLocation"].contains("uri"));
    related = related || result.contains("relatedLocations");
  }
  EXPECT_TRUE(related);
}

TEST_F(ReportTest, GithubAnnotationsAreSingleEscapedLines) {
  const AuditReport r = report();
  const std::string text = to_github(r);
  EXPECT_EQ(static_cast<std::size_t>(std::count(text.begin(), text.end(), '\n')), r.findings.size());
  EXPECT_NE(text.find("::error file="), std::string::npos);
  EXPECT_NE(text.find("'a %25'"), std::string::npos);
  EXPECT_EQ(text.find('\r'), std::string::npos);
}

TEST_F(ReportTest, TextKeepsWidthAndColours) {
  const AuditReport r = report();
  for (const int width : {80, 120}) {
    std::istringstream lines(to_text(r, {false, width, false}));
    for (std::string line; std::getline(lines, line);) {
      const bool one_word = line.find(' ', line.find_first_not_of(' ')) == std::string::npos;
      if (!one_word) {
        EXPECT_LE(line.size(), static_cast<std::size_t>(width)) << line;
      }
      EXPECT_EQ(line.find('\x1b'), std::string::npos);
    }
  }
  EXPECT_NE(to_text(r, {true, 100, false}).find("\x1b[1;31merror"), std::string::npos);
  const std::string summary = to_text(r, {false, 100, true});
  EXPECT_EQ(std::count(summary.begin(), summary.end(), '\n'), 1);
}

TEST_F(ReportTest, ControlSequencesInNamesAreEscaped) {
  Parts p;
  p.joint_name = "j&#9;x";
  AuditReport r = check(robot(p));
  r.findings.front().message += "\x1b[2J";
  EXPECT_EQ(to_text(r, {false, 100, false}).find('\x1b'), std::string::npos);
}

TEST_F(ReportTest, PlacesBelowFolderAreRelative) {
  fs::create_directories(folder_ / "inc");
  write("inc/part.xacro",
        "<robot xmlns:xacro=\"http://www.ros.org/wiki/xacro\">\n<link name=\"a\"/><link "
        "name=\"a\"/>\n</robot>");
  AuditReport report = check(
      "<robot name=\"r\" xmlns:xacro=\"http://www.ros.org/wiki/xacro\">\n<xacro:include "
      "filename=\"inc/part.xacro\"/>\n</robot>",
      "r.xacro");
  shorten_places(report, folder_);
  const Finding* twice = find(report, "urdf.duplicate_name");
  ASSERT_NE(twice, nullptr) << report_text(report);
  EXPECT_EQ(*twice->where.file, "inc/part.xacro");
  ASSERT_NE(twice->where.within, nullptr);
  EXPECT_EQ(*twice->where.within->call.file, "r.xacro");
  EXPECT_EQ(twice->message.find(folder_.string()), std::string::npos) << twice->message;
  EXPECT_EQ(report.file, "r.xacro");
}

TEST_F(ReportTest, InputErrorGivesReport) {
  try {
    check("<robot name=\"r\">\n<link", "r.urdf");
    FAIL() << "expected well-formed XML";
  } catch (const InputError& error) {
    const AuditReport report = refusal_report(with_short_places(error, folder_), "r.urdf");
    EXPECT_EQ(report.count(Severity::error), 1U);
    EXPECT_EQ(*report.findings.front().where.file, "r.urdf");
    EXPECT_NE(to_json(report).find("\"rule\": \"xml.not_well_formed\""), std::string::npos);
    EXPECT_NE(to_sarif(report).find("xml.not_well_formed"), std::string::npos);
    EXPECT_TRUE(to_github(report).starts_with("::error file=r.urdf,line=2"));
  }
  const AuditReport missing =
      refusal_report(InputError("up.unknown_target", {}, "it is not there"), "n.urdf");
  EXPECT_TRUE(
      to_github(missing).starts_with("::error file=n.urdf,title=up.unknown_target::it is not there\n"));
}

TEST(RuleTable, RulesAreSortedCompleteAndUnique) {
  const auto& rules = rule_table();
  EXPECT_GT(rules.size(), 100U);
  for (std::size_t i = 0; i < rules.size(); ++i) {
    EXPECT_FALSE(rules[i].title.empty() || rules[i].failure.empty() || rules[i].fix.empty()) << rules[i].id;
    EXPECT_NE(rules[i].profiles & kAllProfiles, 0U) << rules[i].id;
    if (i > 0) {
      EXPECT_LT(rules[i - 1].id, rules[i].id);
    }
    EXPECT_EQ(find_rule(rules[i].id), &rules[i]);
  }
  EXPECT_EQ(find_rule("no.such_rule"), nullptr);
}

// The audit reports the model's assumptions in more detail, and what a start makes of plugins is no audit.
bool is_reported_elsewhere(const std::string& rule) {
  return rule.starts_with("model.") || rule.starts_with("up.");
}

TEST(RuleTable, EveryParserRuleIsListed) {
  const std::regex reports(R"re(diagnostics_?\.(?:warning|note|error)\(\s*"([a-z0-9_.]+)")re");
  std::size_t seen = 0;
  for (const char* module : {"description/urdf", "description/gazebo", "description/meshes",
                             "description/overlay", "robot/kinematics"}) {
    for (const auto& entry :
         fs::directory_iterator(fs::path(DOPPEL_SOURCE_DIR) / "src" / "doppel" / module)) {
      if (entry.path().extension() != ".cpp") continue;
      std::ifstream in(entry.path());
      const std::string text{std::istreambuf_iterator<char>(in), {}};
      for (std::sregex_iterator i(text.begin(), text.end(), reports), end; i != end; ++i) {
        ++seen;
        const std::string rule = (*i)[1];
        EXPECT_TRUE(is_reported_elsewhere(rule) || find_rule(rule) != nullptr)
            << rule << " of " << entry.path();
      }
    }
  }
  EXPECT_GT(seen, 20U);
}

TEST(RuleTable, DocumentationMatchesTable) {
  std::ifstream in(fs::path(DOPPEL_SOURCE_DIR) / "docs" / "rules.md");
  std::stringstream text;
  text << in.rdbuf();
  EXPECT_EQ(text.str(), rules_markdown()) << "docs/rules.md differs from the table; regenerate it: doppel "
                                             "check --list-rules --markdown > docs/rules.md";
}

}  // namespace
}  // namespace doppel::audit_test
