// The findings of all rules together on one description: each fault once, with a severity that depends on its
// context.
#include <cmath>
#include <map>

#include "doppel/review/audit/test/parts.h"

namespace doppel::audit_test {
namespace {

class AuditDescriptionTest : public AuditTest {};

TEST_F(AuditDescriptionTest, GoodRobotHasNotesOnly) {
  const AuditReport report = check(robot({}));
  EXPECT_EQ(report.count(Severity::error) + report.count(Severity::warning), 0U) << report_text(report);
  EXPECT_EQ(report.links, 2U);
  EXPECT_EQ(report.joints, 1U);
  EXPECT_DOUBLE_EQ(report.mass, 1.0);
}

TEST_F(AuditDescriptionTest, FaultyRobotIsAuditedAsFarAsRead) {
  Parts p;
  p.limit = R"(<limit lower="a" upper="1" effort="100" velocity="100"/>)";
  p.inertial = tensor("1 0 0 1 0 1");
  const AuditReport report = check(robot(p));
  for (const char* rule : {"urdf.number", "joint.exporter_effort", "inertia.identity"})
    EXPECT_NE(find(report, rule), nullptr) << rule;
  EXPECT_EQ(find(report, "urdf.number")->subject, "joint 'j'");
}

TEST_F(AuditDescriptionTest, JointLoopIsReported) {
  const std::string back = follower(kLimit) +
                           "<joint name=\"back\" type=\"revolute\"><parent link=\"tip\"/>" +
                           "<child link=\"arm\"/>" + kAxis + kLimit + "</joint>";
  const AuditReport report = check(robot(with(&Parts::more, back)));
  EXPECT_NE(find(report, "urdf.two_parents"), nullptr) << report_text(report);
  const std::string ring =
      "<robot name=\"r\"><link name=\"a\">" + kInertial + "</link><link name=\"b\">" + kInertial +
      "</link><joint name=\"j\" type=\"revolute\"><parent link=\"a\"/><child link=\"b\"/>" + kLimit +
      "</joint><joint name=\"k\" type=\"revolute\"><parent link=\"b\"/><child link=\"a\"/>" + kLimit +
      "</joint></robot>";
  EXPECT_NE(find(check(ring), "urdf.loop"), nullptr);
}

TEST_F(AuditDescriptionTest, SingleFaultIsReportedOnce) {
  struct OneCase {
    Parts parts;
    const char* rule;
  };
  const auto l = [](const std::string& text) { return with(&Parts::limit, text); };
  const OneCase cases[] = {
      {l(limit("-1", "1", "nan")), "urdf.number"},
      {l(limit("-1", "1,5")), "urdf.number"},
      {l(R"(<limit lower="-1" upper="1" effort="5" velocty="3"/>)"), "joint.limit_incomplete"},
      {l(R"(<limits lower="-1" upper="1" effort="5" velocity="3"/>)"), "schema.element"},
      {with(&Parts::inertial, tensor("0.0036 0 0 0.0036 0 0.0006", "1,5")), "urdf.inertial"},
      {with(&Parts::inertial, tensor("0.0036 0 0 0.0036 0 six")), "urdf.inertial"},
      {with(&Parts::inertial, tensor("0.0036 0 0 0.0036 0 0.0006", "1", "0 0 1,0")), "urdf.inertial"},
      {with(&Parts::inertial, "<inertial><mass value=\"1\"/></inertial>"), "urdf.inertial"},
      {with(&Parts::inertial, "<inertial><mass value=\"0\"/></inertial>"), "urdf.inertial"},
      {with(&Parts::visual, "<visual>" + shape_with(R"(<sphere radius="nan"/>)") + "</visual>"),
       "urdf.geometry"}};
  for (const OneCase& c : cases) {
    const AuditReport report = check(robot(c.parts));
    EXPECT_NE(find(report, c.rule), nullptr) << report_text(report);
    EXPECT_EQ(report.count(E) + report.count(W), 1U) << report_text(report);
  }
  const AuditReport typo = check(robot(l(R"(<limits lower="-1" upper="1" effort="5" velocity="3"/>)")));
  EXPECT_NE(find(typo, "schema.element")->message.find("did you mean <limit>?"), std::string::npos);
}

TEST_F(AuditDescriptionTest, DegreeLimitsHaveFixEach) {
  const AuditReport report = check(robot(two_ranges("-90", "90", "0", "135")));
  std::map<std::string, double> upper;
  for (const Finding& f : report.findings) {
    if (f.rule != "joint.limits_degrees") continue;
    EXPECT_EQ(f.severity, E);
    ASSERT_EQ(f.repair.size(), 1U);
    const auto& set = std::get<SetLimit>(f.repair.front().action);
    upper[set.joint] = set.upper.value();
  }
  ASSERT_EQ(upper.size(), 2U) << report_text(report);
  EXPECT_NEAR(upper["j"], M_PI / 2, 1e-9);
  EXPECT_NEAR(upper["k"], 0.75 * M_PI, 1e-9);
}

// What engines lump into one body is checked as one: a part that is fixed to another needs no tensor of its
// own.
TEST_F(AuditDescriptionTest, FaultyTensorOfSoundBodyIsWarningWithoutFix) {
  const std::string part = "<link name=\"lens\">" + tensor("0.000001 0 0 0.000001 0 0.0001", "0.01") +
                           "</link><joint name=\"glue\" type=\"fixed\"><parent link=\"arm\"/>"
                           "<child link=\"lens\"/></joint>";
  const AuditReport report = check(robot(with(&Parts::more, part)));
  const Finding* found = find(report, "inertia.triangle");
  ASSERT_NE(found, nullptr) << report_text(report);
  EXPECT_EQ(found->severity, W);
  EXPECT_TRUE(found->repair.empty());
}

// A power of ten would make it possible, but no shape confirms that it is the intended one.
TEST_F(AuditDescriptionTest, ImpossibleTensorWithoutShapeIsErrorWithoutFix) {
  Parts p = with(&Parts::inertial, tensor("0.0036 0 0 0.0036 0 0.06"));
  p.visual = p.collision = "";
  const AuditReport report = check(robot(p));
  const Finding* found = find(report, "inertia.triangle");
  ASSERT_NE(found, nullptr) << report_text(report);
  EXPECT_EQ(found->severity, E);
  EXPECT_TRUE(found->repair.empty());
}

TEST_F(AuditDescriptionTest, SuspicionHasNoFix) {
  const Parts cases[] = {
      with(&Parts::inertial, tensor("0.000036 0 0 0.000036 0 0.000006", "0.01")),  // ten grams
      with(&Parts::inertial, tensor("0.01 0 0 0.01 0 0.01", "0.1")),               // a placeholder
      with(&Parts::inertial, tensor("3.6 0 0 3.6 0 0.6")),
      with(&Parts::inertial,
           tensor("0.0036 0 0 0.0036 0 0.0006", "1", "0.3 0.4 0.2")),  // in the base's frame
      with(&Parts::inertial, tensor("0.0036 0 0 0.0036 0 -1e-21")),
      with(&Parts::limit, limit("-180", "180")),
      with(&Parts::limit, limit("-1.570796", "3.14159"))};
  for (const Parts& parts : cases) {
    const AuditReport report = check(robot(parts));
    EXPECT_EQ(report.count(E), 0U) << report_text(report);
    for (const Finding& f : report.findings) EXPECT_TRUE(f.repair.empty()) << f.rule << ": " << f.message;
  }
}

TEST_F(AuditDescriptionTest, UnreadableFileThrowsInputError) {
  EXPECT_THROW(check("<robot name='r'><link"), InputError);
  EXPECT_THROW(check("<sdf/>"), InputError);
  EXPECT_THROW(check_file(folder_ / "none.urdf"), InputError);
}

TEST_F(AuditDescriptionTest, ProfileFiltersFindings) {
  Parts p;
  p.inertial = tensor("1 0 0 1 0 1");
  const fs::path file = write("r.urdf", robot(p));
  AuditOptions options;
  options.profiles = static_cast<unsigned>(Profile::moveit);
  EXPECT_EQ(find(check_file(file, options), "inertia.identity"), nullptr);
  options.profiles = static_cast<unsigned>(Profile::mujoco);
  EXPECT_NE(find(check_file(file, options), "inertia.identity"), nullptr);
}

std::string mesh_link(const std::string& name, const std::string& file, const std::string& scale = "1 1 1") {
  const std::string shape = "<geometry><mesh filename=\"" + file + "\" scale=\"" + scale + "\"/></geometry>";
  return "<link name=\"" + name + "\"><visual>" + shape + "</visual><collision>" + shape +
         "</collision></link>\n<joint name=\"to_" + name +
         "\" type=\"fixed\"><origin xyz=\"0.2 0 0\"/><parent link=\"arm\"/><child link=\"" + name +
         "\"/></joint>\n";
}

TEST_F(AuditDescriptionTest, MissingMeshAndFolderAreReportedOnce) {
  Parts p;
  p.more = mesh_link("a", "none/a.stl");
  AuditReport report = check(robot(p));
  const auto missing = [&] {
    return std::count_if(report.findings.begin(), report.findings.end(),
                         [](const Finding& f) { return f.rule == "mesh.missing"; });
  };
  EXPECT_EQ(missing(), 1) << report_text(report);
  for (const char* name : {"b", "c", "d", "e"})
    p.more += mesh_link(name, std::string("none/") + name + ".stl");
  report = check(robot(p));
  EXPECT_EQ(missing(), 1) << report_text(report);
  EXPECT_EQ(find(report, "mesh.missing")->subject, "5 meshes");
}

// A cube of the given size whose faces point outwards.
std::string cube(double size, bool inward = false, bool open = false) {
  std::string out;
  for (int i = 0; i < 8; ++i)
    out += "v " + std::to_string(size * (i & 1)) + " " + std::to_string(size * ((i >> 1) & 1)) + " " +
           std::to_string(size * (i >> 2)) + "\n";
  const int faces[12][3] = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                            {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  for (int f = 0; f < (open ? 11 : 12); ++f) {
    out += "f " + std::to_string(faces[f][0] + 1) + " " + std::to_string(faces[f][inward ? 2 : 1] + 1) + " " +
           std::to_string(faces[f][inward ? 1 : 2] + 1) + "\n";
  }
  return out;
}

TEST_F(AuditDescriptionTest, OpenMeshIsReported) {
  struct MeshCase {
    const char* rule;
    Severity severity;
    std::string content, scale;
  };
  const MeshCase cases[] = {
      {"mesh.unit", E, cube(100), "1 1 1"},
      {"mesh.unit", W, cube(100), "1e-6 1e-6 1e-6"},
      {"mesh.inverted", W, cube(0.1, true), "1 1 1"},
      {"mesh.open", N, cube(0.1, false, true), "1 1 1"},
      {"mesh.scale_zero", E, cube(0.1), "1 0 1"},
      {"mesh.scale_uneven", N, cube(0.1), "1 1 2"},
      {"mesh.unreadable", E, "nothing", "1 1 1"},
      {"mesh.not_fetched", W, "version https://git-lfs.github.com/spec/v1\noid sha256:1\nsize 2\n", "1 1 1"},
      {"mesh.irregular", N, "f 1 2 3\nv 0 0 0\nv 0.1 0 0\nv 0 0.1 0\n", "1 1 1"},
      {"mesh.visual_as_collision", N, cube(0.1), "1 1 1"},
      {"mesh.flat", N, "v 0 0 0\nv 0.1 0 0\nv 0 0.1 0\nf 1 2 3\n", "1 1 1"}};
  for (const MeshCase& c : cases) {
    SCOPED_TRACE(c.rule);
    write("m.obj", c.content);
    Parts p;
    p.more = mesh_link("a", "m.obj", c.scale);
    const AuditReport report = check(robot(p));
    const Finding* found = find(report, c.rule);
    ASSERT_NE(found, nullptr) << report_text(report);
    EXPECT_EQ(found->severity, c.severity);
  }
  write("m.obj", cube(100));
  Parts p;
  p.more = mesh_link("a", "m.obj", "0.001 0.001 0.001");
  const AuditReport fine = check(robot(p));
  for (const Finding& f : fine.findings) {
    EXPECT_TRUE(!f.rule.starts_with("mesh.") || f.rule == "mesh.visual_as_collision") << f.rule << f.message;
  }
}

TEST_F(AuditDescriptionTest, ScaleFixNeedsSingleFile) {
  write("m.obj", cube(100));
  write("metres.obj", cube(0.1));
  Parts p;
  p.more = mesh_link("a", "m.obj");
  EXPECT_EQ(find(check(robot(p)), "mesh.unit")->repair.size(), 1U);
  p.more.replace(p.more.rfind("m.obj"), 5, "metres.obj");  // of the <collision>
  const AuditReport report = check(robot(p));
  const Finding* found = find(report, "mesh.unit");
  ASSERT_NE(found, nullptr) << report_text(report);
  EXPECT_TRUE(found->repair.empty());
}

// What is written in millimetres is reported once, not again as an implausible mass, centre or scale.
TEST_F(AuditDescriptionTest, SuspectShapeGivesNoInertiaFinding) {
  write("m.obj", cube(100));
  const auto arm = [](const std::string& scale, const std::string& com) {
    const std::string mesh = "<origin xyz=\"-0.05 -0.05 0.1\"/><geometry><mesh filename=\"m.obj\" scale=\"" +
                             scale + "\"/></geometry>";
    Parts p = with(&Parts::visual, "<visual>" + mesh + "</visual>");
    p.collision = "<collision>" + mesh + "</collision>";
    p.inertial = tensor("0.0017 0 0 0.0017 0 0.0017", "1", com);
    return p;
  };
  const AuditReport large = check(robot(arm("1 1 1", "0 0 -0.2")));
  EXPECT_NE(find(large, "mesh.unit"), nullptr);
  for (const char* rule : {"inertia.density", "inertia.com_outside", "inertia.units", "inertia.gyration"})
    EXPECT_EQ(find(large, rule), nullptr) << report_text(large);
  const AuditReport mirrored = check(robot(arm("0.001 0.001 -0.001", "0 0 0.15")));
  const Finding* sign = find(mirrored, "mesh.scale_negative");
  ASSERT_NE(sign, nullptr) << report_text(mirrored);
  EXPECT_EQ(sign->severity, E);
  EXPECT_EQ(sign->repair.size(), 1U);
  EXPECT_EQ(find(mirrored, "inertia.com_outside"), nullptr);
  // Without evidence of a mistake the severity is warning, and note where the file is used both ways.
  const AuditReport alone = check(robot(arm("0.001 0.001 -0.001", "0 0 0.05")));
  sign = find(alone, "mesh.scale_negative");
  ASSERT_NE(sign, nullptr);
  EXPECT_EQ(sign->severity, W);
  Parts twins = arm("0.001 0.001 -0.001", "0 0 0.05");
  twins.more = mesh_link("a", "m.obj", "0.001 0.001 0.001");
  const AuditReport both = check(robot(twins));
  sign = find(both, "mesh.scale_negative");
  ASSERT_NE(sign, nullptr);
  EXPECT_EQ(sign->severity, N);
}

// The joint behind the link is at the end of the mirrored mesh, so the centre of mass is what is on the wrong
// side.
TEST_F(AuditDescriptionTest, CentreOfMassIsBlamedWhereJointFitsMirroredMesh) {
  write("m.obj", cube(100));
  const std::string mesh =
      "<origin xyz=\"-0.05 -0.05 0\"/><geometry><mesh filename=\"m.obj\" scale=\"0.001 0.001 "
      "-0.001\"/></geometry>";
  Parts p = with(&Parts::visual, "<visual>" + mesh + "</visual>");
  p.collision = "<collision>" + mesh + "</collision>";
  p.inertial = tensor("0.0017 0 0 0.0017 0 0.0017", "1", "0 0 0.05");
  EXPECT_EQ(find(check(robot(p)), "mesh.scale_negative")->severity, E) << "expected blame of the mesh";
  p.more =
      "<link name=\"tool\"/><joint name=\"t\" type=\"fixed\"><parent link=\"arm\"/><child link=\"tool\"/>"
      "<origin xyz=\"0 0 -0.1\"/></joint>";
  const AuditReport report = check(robot(p));
  const Finding* sign = find(report, "mesh.scale_negative");
  ASSERT_NE(sign, nullptr) << report_text(report);
  EXPECT_EQ(sign->severity, N);
  EXPECT_TRUE(sign->repair.empty());
  const Finding* centre = find(report, "inertia.com_outside");
  ASSERT_NE(centre, nullptr) << report_text(report);
  EXPECT_NE(centre->message.find("at 0 0 -0.05 it is inside"), std::string::npos) << centre->message;
}

// Pieces far from a cube, as an exporter leaves them behind, reach far and have hardly any volume.
TEST_F(AuditDescriptionTest, StrayPieceOfMeshIsNotBlamedOnInertia) {
  const std::string corners = "v 3 3 3\nv 3.001 3 3\nv 3 3.001 3\nv 3 3 3.001\n";
  write("clean.obj", cube(0.1));
  write("triangle.obj", cube(0.1) + corners + "f 9 11 10\n");
  write("tetrahedron.obj", cube(0.1) + corners + "f 9 11 10\nf 9 10 12\nf 9 12 11\nf 10 11 12\n");
  const auto mesh = [](const std::string& file) {
    return "<origin xyz=\"-0.05 -0.05 0.05\"/><geometry><mesh filename=\"" + file + "\"/></geometry>";
  };
  const auto is_blamed = [&](const std::string& visual, const std::string& collision,
                             const std::string& six) {
    Parts p = with(&Parts::inertial, tensor(six));
    p.visual = "<visual>" + mesh(visual) + "</visual>";
    p.collision = "<collision>" + mesh(collision) + "</collision>";
    const AuditReport report = check(robot(p));
    return find(report, "inertia.gyration") != nullptr;
  };
  const std::string right = "0.0017 0 0 0.0017 0 0.0017", small = "0.00002 0 0 0.00002 0 0.00002";
  EXPECT_FALSE(is_blamed("triangle.obj", "clean.obj", right));
  EXPECT_FALSE(is_blamed("tetrahedron.obj", "tetrahedron.obj", right));
  EXPECT_TRUE(is_blamed("tetrahedron.obj", "tetrahedron.obj", small));
}

TEST_F(AuditDescriptionTest, MissingFileNamesNearest) {
  write("wrist.obj", cube(0.1));
  Parts p;
  p.more = mesh_link("a", "wirst.obj");
  const AuditReport report = check(robot(p));
  const Finding* found = find(report, "mesh.missing");
  ASSERT_NE(found, nullptr) << report_text(report);
  EXPECT_NE(found->fix.find("wrist.obj"), std::string::npos) << found->fix;
}

TEST_F(AuditDescriptionTest, PlacesIncludeMacroCalls) {
  const std::string text =
      "<robot name=\"r\" xmlns:xacro=\"http://www.ros.org/wiki/xacro\">\n<xacro:macro name=\"m\" "
      "params=\"n\">\n<link name=\"${n}\">\n"
      "<inertial><mass value=\"0\"/><inertia ixx=\"1\" ixy=\"0\" ixz=\"0\" iyy=\"1\" iyz=\"0\" "
      "izz=\"1\"/></inertial></link>\n</xacro:macro>\n"
      "<xacro:m n=\"a\"/>\n</robot>\n";
  const AuditReport report = check(text, "r.xacro");
  const Finding* found = find(report, "inertia.mass_zero");
  ASSERT_NE(found, nullptr) << report_text(report);
  EXPECT_EQ(found->where.line, 4);
  ASSERT_NE(found->where.within, nullptr);
  EXPECT_EQ(found->where.within->call.line, 6);
}

}  // namespace
}  // namespace doppel::audit_test
