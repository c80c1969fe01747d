#include "doppel/validation/reports/html_report.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <memory>

#include "doppel/base/packages/package_resolver.h"
#include "doppel/description/urdf/load.h"
#include "doppel/validation/reports/detail/arm_drawing.h"
#include "doppel/validation/reports/detail/link_surfaces.h"
#include "doppel/validation/reports/detail/report_parts.h"
#include "doppel/validation/reports/test/example_report.h"

namespace doppel {
namespace {

using reports_test::example_report;
using testing::HasSubstr;
using testing::Not;

std::size_t count_of(const std::string& text, const std::string& word) {
  std::size_t out = 0;
  for (std::size_t i = text.find(word); i != std::string::npos; i = text.find(word, i + 1)) ++out;
  return out;
}

class HtmlReportTest : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    subject_ = std::make_unique<Subject>(reports_test::bundled_subject("omarm_one"));
  }
  static void TearDownTestSuite() { subject_.reset(); }
  static std::unique_ptr<Subject> subject_;
};
std::unique_ptr<Subject> HtmlReportTest::subject_;

TEST_F(HtmlReportTest, ArmIsDrawnInEachConfigurationWithNamedLinks) {
  ASSERT_TRUE(subject_->refusal.empty());
  const std::string html = html_report(example_report(subject_.get()), subject_.get());
  EXPECT_EQ(count_of(html, "class=\"arm\" data-pose="), 2U);
  EXPECT_EQ(count_of(html, "<polygon points="), 2U);
  EXPECT_THAT(html, HasSubstr(">link_4_1</text>"));
  EXPECT_THAT(html, HasSubstr("<script type=\"application/json\" id=\"arm\">"));
  EXPECT_LT(html.size(), kMaxReportBytes);
}

TEST_F(HtmlReportTest, ReportWithoutMachineHasNoArm) {
  const std::string html = html_report(example_report(), nullptr);
  EXPECT_THAT(html, Not(HasSubstr("class=\"arm\" data-pose")));
  EXPECT_THAT(html, HasSubstr("doppel move &#39;Revolute 1=0.4&#39;"));
  EXPECT_THAT(html, HasSubstr("http://127.0.0.1:8700/?q=Revolute%201%3D0.4&amp;q=Revolute%202%3D2.6"));
}

TEST_F(HtmlReportTest, LinksNamePageThatIsGiven) {
  const std::string html = html_report(example_report(), nullptr, "http://arm.local:8711/");
  EXPECT_THAT(html, HasSubstr("http://arm.local:8711/?q=Revolute%201%3D0.4"));
  EXPECT_THAT(html, Not(HasSubstr(":8700")));
  const std::string hostile = html_report(example_report(), nullptr, "x\"><script>alert(1)");
  EXPECT_THAT(hostile, Not(HasSubstr("<script>alert")));
}

TEST_F(HtmlReportTest, SizeIsBoundedWithManyConfigurationsAndCurves) {
  ValidationReport report = example_report(subject_.get());
  CheckItem item;
  for (const CheckResult& check : report.checks) {
    if (check.id == "T4") item = check.items.front();
  }
  for (int i = 0; i < 400; ++i) {
    item.subject = "joint " + std::to_string(i);
    for (auto& [joint, position] : item.poses.front().joints) position = std::sin(i);
    report.checks.back().add(item);
  }
  const std::string html = html_report(report, subject_.get());
  EXPECT_LT(html.size(), kMaxReportBytes);
  EXPECT_GT(count_of(html, "class=\"arm\" data-pose="), 40U);
  EXPECT_THAT(html, HasSubstr("are left out, because the file has a limit of 3 MB"));
}

TEST_F(HtmlReportTest, HardNamesStayText) {
  ValidationReport report = example_report();
  report.robot = report.target = "</script><script>alert(1)</script>";
  report.checks.front().items = {{.subject = "<img src=x>", .message = "\"><b>"}};
  const std::string html = html_report(report, nullptr);
  EXPECT_THAT(html, Not(HasSubstr("<script>alert")));
  EXPECT_THAT(html, Not(HasSubstr("<img")));
}

TEST(MoveCommand, NamesAreQuotedForShell) {
  EXPECT_EQ(move_command({"", {{"elbow", 0.5}, {"Revolute 2", -1}, {"a'b", 1e-7}, {"c", 1.7e-21}}}),
            "doppel move elbow=0.5 'Revolute 2=-1' 'a'\\''b=1e-07' c=0");
}

TEST(Markup, OnlyCharactersOfXmlRemain) {
  EXPECT_EQ(markup("a<b>&\"'"), "a&lt;b&gt;&amp;&quot;&#39;");
  const std::string replaced = "\xEF\xBF\xBD";
  EXPECT_EQ(markup(std::string("\0\x1b\t", 3)), replaced + replaced + "\t");
  EXPECT_EQ(markup("\xC3"), replaced);                                // cut off
  EXPECT_EQ(markup("\xC0\xAF"), replaced + replaced);                 // overlong
  EXPECT_EQ(markup("\xED\xA0\x80"), replaced + replaced + replaced);  // a surrogate
  EXPECT_EQ(markup("\xEF\xBF\xBF"), replaced + replaced + replaced);  // no character
  EXPECT_EQ(markup("\xF0\x9F\xA4\x96"), "\xF0\x9F\xA4\x96");
}

std::vector<LinkSurface> surfaces_of(const char* shapes) {
  const std::string text = std::string("<robot name='r'><link name='a'>") + shapes + "</link></robot>";
  Diagnostics none;
  PackageResolver resolver;
  const RobotDescription robot = parse_urdf(text, "r.urdf", resolver, none);
  return link_surfaces(robot, compile_model(robot, BaseKind::fixed, none));
}

double volume(const LinkSurface& surface) {
  double out = 0;
  for (const auto& [a, b, c] : surface.triangles) {
    const auto& v = surface.vertices;
    out += v[a].cast<double>().dot(v[b].cast<double>().cross(v[c].cast<double>())) / 6;
  }
  return out;
}

TEST(LinkSurfaces, ShapesOfLinkAreClosedAndFaceOutwards) {
  const auto surfaces = surfaces_of(
      "<visual><geometry><box size='1 2 3'/></geometry></visual>"
      "<visual><origin xyz='5 0 0'/><geometry><cylinder radius='0.5' length='2'/></geometry></visual>"
      "<visual><origin xyz='9 0 0'/><geometry><sphere radius='1'/></geometry></visual>");
  ASSERT_EQ(surfaces.size(), 1U);
  const double expected = 6 + M_PI * 0.5 + 4.0 / 3 * M_PI;
  EXPECT_NEAR(volume(surfaces[0]), expected, 0.03 * expected);
}

TEST(LinkSurfaces, LinkWithoutVisualHasCollisionAndMissingMeshIsLeftOut) {
  EXPECT_EQ(surfaces_of("<collision><geometry><box size='1 1 1'/></geometry></collision>").size(), 1U);
  EXPECT_TRUE(surfaces_of("<visual><geometry><mesh filename='none.stl'/></geometry></visual>").empty());
}

TEST(LinkSurfaces, SimplifiedSurfaceKeepsItsSizeWithFewTriangles) {
  const auto fine = surfaces_of("<visual><geometry><sphere radius='1'/></geometry></visual>");
  const auto coarse = simplified(fine, 200);
  ASSERT_EQ(coarse.size(), 1U);
  EXPECT_LE(coarse[0].triangles.size(), 200U);
  EXPECT_GE(coarse[0].triangles.size(), 60U);
  EXPECT_NEAR(volume(coarse[0]), volume(fine[0]), 0.25 * volume(fine[0]));
}

TEST(ArmDrawing, ViewFromAboveHasItsAxesAndNamedLinkHidesOrShows) {
  const ViewAxes axes = axes_of({.yaw = 0, .pitch = M_PI / 2});
  EXPECT_NEAR((axes.eye - Eigen::Vector3d::UnitZ()).norm(), 0, 1e-12);
  EXPECT_NEAR((axes.right.cross(axes.up) - axes.eye).norm(), 0, 1e-12);
  auto surfaces = surfaces_of("<visual><geometry><box size='1 1 1'/></geometry></visual>");
  surfaces.push_back(surfaces.front());
  ArmPose pose;
  pose.X_WL = {Pose::Identity(), Pose(Eigen::Translation3d(2, 0, 0))};
  pose.named = {1};
  pose.view = {.centre = {1, 0, 0}, .radius = 3, .yaw = 0, .pitch = 0};
  EXPECT_GT(visible_share(surfaces, pose, pose.view), 0.01);  // in front
  pose.view.yaw = M_PI;
  EXPECT_LT(visible_share(surfaces, pose, pose.view), 0.005);  // behind the other one
}

}  // namespace
}  // namespace doppel
