#include "doppel/review/conversion/tree.h"

#include "conversion_fixture.h"
#include "doppel/review/conversion/detail/drawing.h"
#include "doppel/review/conversion/mass_report.h"
#include "doppel/review/conversion/tree_labels.h"

namespace doppel {
namespace {

RobotDescription random_robot(std::mt19937& generator, int links) {
  std::string xml = "<robot name=\"r\"><link name=\"l0\"/>";
  for (int i = 1; i < links; ++i) {
    // Mostly attached to the most recent links, so that there are long chains as well as wide trees.
    const int parent = std::uniform_int_distribution(std::max(0, i - 6), i - 1)(generator);
    const std::string name = "l" + std::string(static_cast<std::size_t>(i % 9), 'x') + std::to_string(i);
    xml += "<link name=\"" + name + "\"/><joint name=\"j" + std::to_string(i) +
           "\" type=\"fixed\"><parent link=\"";
    xml += parent == 0
               ? "l0"
               : "l" + std::string(static_cast<std::size_t>(parent % 9), 'x') + std::to_string(parent);
    xml += "\"/><child link=\"" + name + "\"/></joint>";
  }
  PackageResolver resolver;
  Diagnostics diagnostics;
  return parse_urdf(xml + "</robot>", "r.urdf", resolver, diagnostics);
}

TEST(TreeDrawingTest, BoxesNeverOverlapAndStayOnPage) {
  SCOPED_TRACE("seed 5");
  std::mt19937 generator(5);
  for (int trial = 0; trial < 40; ++trial) {
    const RobotDescription robot = random_robot(generator, 1 + trial * 3);
    const Drawing drawing = tree_drawing(robot);
    std::vector<DrawnBox> boxes;
    for (const auto& item : drawing.items) {
      if (const auto* box = std::get_if<DrawnBox>(&item)) boxes.push_back(*box);
    }
    ASSERT_EQ(boxes.size(), robot.links.size() + robot.joints.size());
    for (std::size_t i = 0; i < boxes.size(); ++i) {
      const DrawnBox& a = boxes[i];
      ASSERT_GE(a.x, 0);
      ASSERT_GE(a.y, 0);
      ASSERT_LE(a.x + a.width, drawing.width);
      ASSERT_LE(a.y + a.height, drawing.height);
      for (std::size_t j = i + 1; j < boxes.size(); ++j) {
        const DrawnBox& b = boxes[j];
        const bool apart =
            a.x + a.width <= b.x || b.x + b.width <= a.x || a.y + a.height <= b.y || b.y + b.height <= a.y;
        ASSERT_TRUE(apart) << "trial " << trial << ": expected no overlap of boxes " << i << " and " << j;
      }
    }
  }
}

TEST(TreeDrawingTest, SvgIsXmlAndPdfTableIsValid) {
  const Converted converted = from_text(kWholeRobot);
  const Drawing drawing = tree_drawing(converted.robot);
  const std::string svg = to_svg(drawing);
  EXPECT_TRUE(parse_xml(svg, "tree.svg").is("svg"));
  EXPECT_NE(svg.find("turn &amp; \"twist\""), std::string::npos);
  const std::string pdf = to_pdf(drawing);
  const std::size_t table = pdf.find("xref\n0 8\n");
  ASSERT_NE(table, std::string::npos);
  EXPECT_NE(pdf.find("startxref\n" + std::to_string(table) + "\n%%EOF"), std::string::npos);
  for (std::size_t i = 1; i < 8; ++i) {
    const std::size_t at = std::stoul(pdf.substr(table + 9 + 20 * i, 10));
    EXPECT_EQ(pdf.substr(at, 7), std::to_string(i) + " 0 obj");
  }
  const std::size_t length = std::stoul(pdf.substr(pdf.find("/Length ") + 8));
  const std::size_t start = pdf.find("stream\n") + 7;
  EXPECT_EQ(pdf.substr(start + length, 9), "endstream");
}

TEST(DrawingTest, TextWidthMatchesAdobeMetrics) {
  EXPECT_DOUBLE_EQ(text_width("Hello", 10, false), 0.01 * (722 + 556 + 222 + 222 + 556));
  EXPECT_DOUBLE_EQ(text_width("Hello", 10, true), 0.01 * (722 + 556 + 278 + 278 + 611));
  EXPECT_EQ(code_points("a\xC3\xA9\xE2\x82\xAC\xF0\x9F\xA4\x96\xFF").size(), 5u);
  EXPECT_EQ(win_ansi(0xE9), 0xE9);
  EXPECT_EQ(win_ansi(0x20AC), 0x80);
  EXPECT_EQ(win_ansi(0x1F916), '?');
}

TEST(TreeTextTest, BranchesAreDrawn) {
  PackageResolver resolver;
  Diagnostics diagnostics;
  const RobotDescription robot = parse_urdf(
      "<robot name=\"r\"><link name=\"a\"/><link name=\"b\"/><link name=\"c\"/><link name=\"d\"/>"
      "<joint name=\"ab\" type=\"fixed\"><parent link=\"a\"/><child link=\"b\"/></joint>"
      "<joint name=\"bd\" type=\"continuous\"><parent link=\"b\"/><child link=\"d\"/><axis xyz=\"0 -1 "
      "0\"/></joint>"
      "<joint name=\"ac\" type=\"fixed\"><parent link=\"a\"/><child link=\"c\"/><origin xyz=\"0 0 "
      "0.5\"/></joint>"
      "</robot>",
      "r.urdf", resolver, diagnostics);
  EXPECT_EQ(frames_text(robot, false),
            "frame    comes on    from joint\n"
            "a\n"
            "|- b     /tf_static  ab\n"
            "|  `- d  /tf         bd\n"
            "`- c     /tf_static  ac\n");
  const std::string text = tree_text(robot, true);
  EXPECT_NE(text.find("├─ b"), std::string::npos);
  EXPECT_NE(text.find("│  └─ d"), std::string::npos);
  EXPECT_NE(text.find("continuous  -y"), std::string::npos);
  const std::string dot = tree_dot(robot);
  EXPECT_NE(dot.find("\"a\" -> \"b\""), std::string::npos);
}

TEST(TreeLabelsTest, NumbersAreRounded) {
  EXPECT_EQ(axis_word({0, 0, -1}), "-z");
  EXPECT_EQ(degrees_word({-1.5707963267948966, 0, 0.001}), "-90 0 0.06");
  EXPECT_EQ(mass_word(1.2844), "1284.4 g");
  EXPECT_EQ(mass_word(0.00988596), "9.886 g");
  EXPECT_EQ(mass_word(12.5), "12.5 kg");
  EXPECT_EQ(millimetres_word({-0.00001, 0.0125, 1}), "0 12.5 1000 mm");
}

// -- masses

TEST(MassReportTest, PendulumLoadIsWeightTimesLever) {
  const Converted converted = from_text(
      "<robot name=\"p\"><link name=\"base\"/><link name=\"arm\"><inertial><origin xyz=\"0.5 0 0\"/><mass "
      "value=\"2\"/>"
      "<inertia ixx=\"0.02\" ixy=\"0\" ixz=\"0\" iyy=\"0.03\" iyz=\"0\" izz=\"0.03\"/></inertial></link>"
      "<joint name=\"j\" type=\"revolute\"><parent link=\"base\"/><child link=\"arm\"/><origin xyz=\"0 0 "
      "1\"/>"
      "<axis xyz=\"0 1 0\"/><limit lower=\"0\" upper=\"3\" effort=\"9\" velocity=\"1\"/></joint></robot>");
  const MassReport report = mass_report(converted.model);
  EXPECT_DOUBLE_EQ(report.total, 2);
  EXPECT_TRUE(report.com.isApprox(Eigen::Vector3d(0.5, 0, 1)));
  ASSERT_EQ(report.links.size(), 1u);
  EXPECT_DOUBLE_EQ(report.links[0].share, 1);
  EXPECT_NEAR(report.links[0].gyration, std::sqrt(0.08 / 2 / 2), 1e-12);
  ASSERT_EQ(report.joints.size(), 1u);
  EXPECT_NEAR(report.joints[0].at_zero, -9.81, 1e-9);
  EXPECT_NEAR(report.joints[0].worst, 9.81, 1e-9);
  EXPECT_NEAR(*report.joints[0].margin, 9 - 9.81, 1e-9);
  EXPECT_NE(mass_text(report).find("cannot hold"), std::string::npos);
  EXPECT_NE(compared_with_scale(report, 1.6).find("400 g too heavy (+25.0 %)"), std::string::npos);
  EXPECT_NE(compared_with_scale(report, 1.6).find("0.8000"), std::string::npos);
  EXPECT_NE(compared_with_scale(report, 2.0).find("agrees"), std::string::npos);
}

}  // namespace
}  // namespace doppel
