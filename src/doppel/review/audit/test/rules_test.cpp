// Every rule on the description: what it must report, with severity and location, and a similar valid input.
#include "doppel/description/overlay/overlay.h"
#include "doppel/review/audit/test/parts.h"

namespace doppel::audit_test {
namespace {

struct Case {
  std::string rule;
  Severity severity;
  Parts bad, good;
  std::string at;        // the text in the invalid one where the finding is
  bool fixable = false;  // and --fix removes it
};

Parts bare_limit(const std::string& version) {
  Parts p = with(&Parts::limit, "<limit lower=\"-1\" upper=\"1\"/>");
  p.robot_more = " version=\"" + version + "\"";
  return p;
}

Parts exported(const std::string& joint) {
  Parts p = with(&Parts::limit, limit("-1", "1", "100", "100"));
  p.joint_name = joint;
  return p;
}

// Three links of different masses, all with the same unit error that 'arm' has.
Parts three_links(const std::string& first, const std::string& second, const std::string& third) {
  Parts p = with(&Parts::inertial, first);
  p.more = follower(kLimit, "second", second, "k2") + follower(kLimit, "third", third, "k3");
  return p;
}

std::vector<Case> joint_cases() {
  const auto l = [](const std::string& text) { return with(&Parts::limit, text); };
  return {
      {"joint.exporter_velocity", W, l(limit("-1", "1", "100", "100")), l(limit("-1", "1", "100", "3")),
       "<limit"},
      {"joint.exporter_effort", W, l(limit("-1", "1", "100", "100")), l(limit("-1", "1", "5", "30")),
       "<limit"},
      {"joint.exporter_velocity", E, exported("Revolute 1"), {}, "<limit"},
      {"joint.exporter_effort", E, exported("Slider_12"), {}, "<limit"},
      {"joint.exporter_effort", W, exported("Revolute wrist"), {}, "<limit"},
      {"joint.no_limits", E, l(""), l(kLimit), "<joint"},
      {"joint.limit_incomplete", E, l(R"(<limit lower="-1" upper="1" effort="5"/>)"), l(kLimit), "<limit"},
      {"joint.limit_incomplete", E, bare_limit("1.1"), bare_limit("1.2"), "<limit"},
      {"joint.limit_negative", E, l(limit("-1", "1", "-5")), l(kLimit), "<limit", true},
      {"joint.effort_zero", W, l(limit("-1", "1", "0")), l(limit("-1", "1", "0.001")), "<limit"},
      {"joint.velocity_zero", W, l(limit("-1", "1", "5", "0")), l(limit("-1", "1", "5", "0.01")), "<limit"},
      {"joint.velocity_absurd", W, l(limit("-1", "1", "5", "90")), l(limit("-1", "1", "5", "60")), "<limit"},
      {"joint.effort_absurd", W, l(limit("-1", "1", "1e6")), l(limit("-1", "1", "9000")), "<limit"},
      {"joint.range_zero", W, l(limit("0", "0")), l(limit("0", "0.01")), "<limit"},
      {"joint.limits_degrees", W, l(limit("-90", "90")), l(limit("-1.6", "1.6")), "<limit"},
      {"joint.limits_degrees", W, two_ranges("-180", "180", "-180", "180"), {}, "<limit"},
      {"joint.limit_precision", N, l(limit("-1.6", "1.570796")), l(limit("-3.141593", "1.570797")), "<limit"},
      {"joint.limit_precision", N, l(limit("-3.141592", "1")), l(limit("-3.1415926535897931", "1")),
       "<limit"},
      {"joint.limit_precision", N, l(limit("-1", "3.14")), l(limit("-1", "3.1")), "<limit"},
      {"joint.not_continuous", N, l(limit("-10", "10")), l(limit("-6.2832", "6.2832")), "<limit"},
      {"joint.not_continuous", W, l(limit("-1e9", "1e9")), l(limit("-6.2832", "6.2832")), "<limit"},
      {"joint.dynamics_negative", E, with(&Parts::joint_more, R"(<dynamics damping="-0.1"/>)"),
       with(&Parts::joint_more, R"(<dynamics damping="0.1"/>)"), "<dynamics", true},
      {"joint.soft_limits", W,
       with(&Parts::joint_more,
            R"(<safety_controller k_velocity="1" soft_lower_limit="-2" soft_upper_limit="1"/>)"),
       with(&Parts::joint_more,
            R"(<safety_controller k_velocity="1" soft_lower_limit="-0.9" soft_upper_limit="0.9"/>)"),
       "<safety_controller"},
      {"joint.axis_default", N, with(&Parts::axis, ""), {}, "<joint"},
      {"urdf.axis_not_unit", N, with(&Parts::axis, R"(<axis xyz="0 2 0"/>)"),
       with(&Parts::axis, R"(<axis xyz="0 0.6 0.8"/>)"), "<axis", true},
      {"urdf.axis_zero", E, with(&Parts::axis, R"(<axis xyz="0 0 0"/>)"), {}, "<axis"},
      {"urdf.limits_crossed", E, l(limit("1", "-1")), {}, "<limit", true},
  };
}

std::vector<Case> mimic_cases() {
  const auto m = [](const std::string& text) { return with(&Parts::more, follower(text)); };
  const std::string chain = follower(R"(<mimic joint="j"/>)" + kLimit) +
                            follower(R"(<mimic joint="k"/>)" + kLimit, "tip2", kInertial, "k2");
  const std::string direct = follower(R"(<mimic joint="j"/>)" + kLimit) +
                             follower(R"(<mimic joint="j"/>)" + kLimit, "tip2", kInertial, "k2");
  return {
      {"urdf.mimic_unknown", E, m(R"(<mimic joint="jj"/>)" + kLimit), m(R"(<mimic joint="j"/>)" + kLimit),
       "<mimic"},
      {"urdf.mimic_loop", E, m(R"(<mimic joint="k"/>)" + kLimit), m(R"(<mimic joint="j"/>)" + kLimit),
       "<mimic"},
      {"mimic.chained", W, with(&Parts::more, chain), with(&Parts::more, direct), R"(<mimic joint="k")"},
      {"mimic.limits", W, m(R"(<mimic joint="j" multiplier="-2" offset="0.5"/>)" + limit("-1.4", "2.5")),
       m(R"(<mimic joint="j" multiplier="-2" offset="0.5"/>)" + limit("-1.5", "2.5")),
       R"(<limit lower="-1.4")"},
      {"mimic.multiplier_zero", W, m(R"(<mimic joint="j" multiplier="0"/>)" + kLimit),
       m(R"(<mimic joint="j" multiplier="0.1"/>)" + kLimit), "<mimic"},
  };
}

std::vector<Case> inertia_cases() {
  const auto i = [](const std::string& text) { return with(&Parts::inertial, text); };
  return {
      {"inertia.missing",
       W,
       [] {
         Parts p = with(&Parts::inertial, "");
         p.more = follower(kLimit);
         return p;
       }(),
       {},
       "<link name=\"arm\""},
      {"inertia.none", W, i(""), {}, "<robot"},
      {"inertia.mass_zero", W, i(tensor("0.0036 0 0 0.0036 0 0.0006", "0")), {}, "<inertial"},
      {"inertia.mass_negative", E, i(tensor("0.0036 0 0 0.0036 0 0.0006", "-1")), {}, "<inertial", true},
      {"inertia.zero", W, i(tensor("0 0 0 0 0 0")), {}, "<inertial", true},
      {"inertia.identity", W, i(tensor("1 0 0 1 0 1")), {}, "<inertial", true},
      {"inertia.rounded_zero", E, i(tensor("0.000006 0 0 0.000006 0 0", "0.2")),
       i(tensor("0.0036 0 0 0.0036 0 0.0001")), "<inertial", true},
      {"inertia.rounded_zero", W, i(tensor("0.0036 0 0 0.0036 0 0")), {}, "<inertial"},
      {"inertia.not_positive", E, i(tensor("0.0036 0 0 -0.0036 0 0.0006")), {}, "<inertial", true},
      {"inertia.not_positive",
       E,
       i(tensor("0.0036 0.0004 0.0004 0.00005 0.0036 0.0006")),
       {},
       "<inertial",
       true},
      {"inertia.not_positive", W, i(tensor("0.0036 0 0 0.0036 0 -1e-21")), {}, "<inertial"},
      {"inertia.not_positive", N, i(tensor("1e-12 0 0 -1e-11 0 1e-12", "1e-8")), {}, "<inertial"},
      {"inertia.triangle", E, i(tensor("0.0036 0 0 0.0036 0 0.012")), i(tensor("0.0036 0 0 0.0036 0 0.0071")),
       "<inertial", true},
      {"inertia.triangle", W, i(tensor("0.0036 0 0 0.0036 0 0.008")), {}, "<inertial"},
      {"inertia.triangle", W, i(tensor("0.0036 0 0 0.0036 0 0.00721")),
       i(tensor("0.0036 0 0 0.0036 0 0.0072")), "<inertial"},
      {"inertia.units",
       E,
       three_links(tensor("3600 0 0 3600 0 600"), tensor("7200 0 0 7200 0 1200", "2"),
                   tensor("1800 0 0 1800 0 300", "0.5")),
       {},
       "<inertial"},
      {"inertia.units",
       E,
       three_links(tensor("3.6 0 0 3.6 0 0.6", "1000"), tensor("7.2 0 0 7.2 0 1.2", "2000"),
                   tensor("1.8 0 0 1.8 0 0.3", "500")),
       {},
       "<inertial"},
      {"inertia.units",
       E,
       three_links(tensor("0.0036 0 0 0.0036 0 0.0006", "1", "0 0 100"),
                   tensor("0.0072 0 0 0.0072 0 0.0012", "2", "0 0 90"),
                   tensor("0.0018 0 0 0.0018 0 0.0003", "0.5", "0 0 110")),
       {},
       "<inertial"},
      {"inertia.units", N, i(tensor("3600 0 0 3600 0 600")), {}, "<inertial"},
      {"inertia.units", N, i(tensor("3.6 0 0 3.6 0 0.6")), {}, "<inertial"},
      {"inertia.units", N, i(tensor("3.6 0 0 3.6 0 0.6", "1000")), {}, "<inertial"},
      {"inertia.units", N, i(tensor("0.0036 0 0 0.0036 0 0.0006", "1", "0 0 100")), {}, "<inertial"},
      {"inertia.units", N,
       three_links(tensor("3.6 0 0 3.6 0 0.6"), tensor("3.6 0 0 3.6 0 0.6"), tensor("3.6 0 0 3.6 0 0.6")),
       three_links(tensor("1 0 0 1 0 1"), tensor("2 0 0 2 0 2"), tensor("3 0 0 3 0 3")), "<inertial"},
      {"inertia.com_outside", W, i(tensor("0.0036 0 0 0.0036 0 0.0006", "1", "0 0 0.25")),
       i(tensor("0.0036 0 0 0.0036 0 0.0006", "1", "0 0 0.2")), "<inertial"},
      {"inertia.gyration", W, i(tensor("0.017 0 0 0.017 0 0.0006")), i(tensor("0.01 0 0 0.01 0 0.0006")),
       "<inertial"},
      {"inertia.axes", E, i(tensor("0.0006 0 0 0.0036 0 0.0036")), i(tensor("0.0036 0 0 0.0036 0 0.001")),
       "<inertial", true},
      {"inertia.axes", W, i(tensor("0.0005 0 0 0.0042 0 0.0044")), i(tensor("0.0044 0 0 0.0042 0 0.0005")),
       "<inertial"},
      {"inertia.density", W, i(tensor("0.072 0 0 0.072 0 0.012", "20")),
       i(tensor("0.0324 0 0 0.0324 0 0.0054", "9")), "<inertial"},
      {"inertia.density", W, i(tensor("0.000072 0 0 0.000072 0 0.000012", "0.02")),
       i(tensor("0.00036 0 0 0.00036 0 0.00006", "0.1")), "<inertial"},
      {"inertia.twins", W,
       [] {
         Parts p;
         p.more = follower(kLimit, "finger_left", tensor("0.0036 0 0 0.0036 0 0.0006")) +
                  follower(kLimit, "finger_right", tensor("0.0036 0 0 0.0036 0 0.0012"), "k2");
         return p;
       }(),
       [] {
         Parts p;
         p.more = follower(kLimit, "finger_left", tensor("0.0036 1e-5 0 0.0036 0 0.0006")) +
                  follower(kLimit, "finger_right", tensor("0.0036 -1e-5 0 0.0036 0 0.0006"), "k2");
         return p;
       }(),
       R"(<inertial><origin xyz="0 0 0.1"/><mass value="1"/><inertia ixx="0.0036" ixy="0" ixz="0" iyy="0.0036" iyz="0" izz="0.0012")"},
  };
}

std::vector<Case> shape_cases() {
  const auto v = [](const std::string& shape) {
    return with(&Parts::visual, "<visual>" + shape_with(shape) + "</visual>");
  };
  const auto c = [](const std::string& shape) {
    return with(&Parts::collision, "<collision>" + shape_with(shape) + "</collision>");
  };
  const std::string huge = R"(<box size="60 60 200"/>)",
                    huge_tube = R"(<cylinder radius="30" length="200"/>)";
  const auto both = [&](const std::string& shape, const std::string& com) {
    Parts p = v(shape);
    p.collision = c(shape).collision;
    p.inertial = tensor("0.0036 0 0 0.0036 0 0.0006", "1", com);
    return p;
  };
  const auto far = [](const std::string& xyz) {
    Parts p = with(&Parts::more, follower(kLimit));
    p.more.replace(p.more.find("0.4 0 0"), 7, xyz);
    return p;
  };
  return {
      {"shape.zero_size", W, v(R"(<sphere radius="0"/>)"), v(R"(<sphere radius="0.1"/>)"), "<visual"},
      {"shape.zero_size", W, c(R"(<box size="0 0 0.1"/>)"), v(R"(<box size="0.06 0.2 0"/>)"), "<collision"},
      {"shape.zero_size", N, c(R"(<box size="0.06 0.2 0"/>)"), c(R"(<capsule radius="0.1" length="0"/>)"),
       "<collision"},
      {"urdf.geometry", E, v(R"(<box size="0.06 -0.06 0.2"/>)"), v(R"(<box size="0.06 0.06 0.2"/>)"),
       "<box size=\"0.06 -"},
      {"shape.units", E, both(huge, "0 0 0.1"), v(R"(<box size="6 6 20"/>)"), "<visual"},
      {"shape.units", E, both(huge_tube, "0 0 100"), {}, "<visual"},
      {"joint.origin_units", E, far("0 -26 147"), far("0 -0.026 2.5"), "<origin xyz=\"0 -26 147", true},
      {"joint.origin_units", W, far("0 0 20"), far("0 0 1.9"), "<origin xyz=\"0 0 20"},
  };
}

std::vector<Case> name_cases() {
  const auto name = [](const std::string& text) { return with(&Parts::joint_name, text); };
  return {
      {"name.space", N, name("Revolute 1"), name("Revolute_1"), "<joint"},
      {"name.character", W, name("arm.joint"), name("arm-joint"), "<joint"},
      {"name.character", W, name("gelenk_\xC3\xA4"), name("gelenk_ae"), "<joint"},
      {"name.character", N, name("arm#1"), {}, "<joint"},
      {"name.slash", W, name("/j"), name("j"), "<joint"},
      {"name.reserved", W, name("a::b"), name("a_b"), "<joint"},
      {"name.blank_edge", W, name("j "), name("j"), "<joint"},
      {"name.empty", E, name(""), name("j"), "<joint"},
      {"name.robot", N, with(&Parts::robot_name, "my robot"), with(&Parts::robot_name, "my_robot"), "<robot"},
      {"name.link_and_joint", N, name("arm"), name("arm_joint"), "<joint"},
      {"name.case", W, with(&Parts::more, follower(kLimit, "ARM")),
       with(&Parts::more, follower(kLimit, "ARM2")), "<link name=\"ARM\""},
  };
}

std::vector<Case> schema_cases() {
  const auto j = [](const std::string& text) { return with(&Parts::joint_more, text); };
  const auto top = [](const std::string& text) { return with(&Parts::more, text); };
  return {
      {"schema.element", E, with(&Parts::collision, "<colision>" + kShape + "</colision>"), {}, "<colision"},
      {"schema.element", N, j("<stiffness value=\"3\"/>"), j("<calibration rising=\"0\"/>"), "<stiffness"},
      {"schema.attribute", W, with(&Parts::axis, R"(<axis xyzz="0 1 0"/>)"), {}, "xyzz"},
      {"schema.attribute", N,
       with(&Parts::limit, R"(<limit lower="-1" upper="1" effort="5" velocity="3" k="2"/>)"),
       with(&Parts::limit, R"(<limit lower="-1" upper="1" effort="5" velocity="3" acceleration="2"/>)"),
       "k=\"2\""},
      {"schema.misplaced",
       W,
       with(&Parts::visual, "<visual>" + kShape + "<mass value=\"1\"/></visual>"),
       {},
       "<mass value=\"1\"/></visual>"},
      {"schema.misplaced", W, top("<limit effort=\"1\" velocity=\"1\"/>"), {}, "<limit effort=\"1\""},
      {"schema.repeated",
       W,
       with(&Parts::inertial, kInertial + "\n" + tensor("0.0036 0 0 0.0036 0 0.0005")),
       {},
       R"(<inertial><origin xyz="0 0 0.1"/><mass value="1"/><inertia ixx="0.0036" ixy="0" ixz="0" iyy="0.0036" iyz="0" izz="0.0005")"},
      {"schema.repeated", N, j(kAxis), {}, ""},
      {"schema.text", N, j("oops"), {}, ""},
      {"schema.colour", W, top("<material name=\"m\"><color rgba=\"255 0 0 1\"/></material>"),
       top("<material name=\"m\"><color rgba=\"1 0 0 1\"/></material>"), "rgba"},
      {"schema.element", E,
       top("<ros2_control name=\"h\" type=\"system\"><hardware><plugin>p</plugin></hardware><joint "
           "name=\"j\"><comand_interface name=\"position\"/></joint></ros2_control>"),
       top("<ros2_control name=\"h\" type=\"system\"><hardware><plugin>p</plugin></hardware><joint "
           "name=\"j\"><command_interface name=\"position\"/></joint></ros2_control>"),
       "<comand_interface"},
      {"schema.element", E,
       top("<transmission name=\"t\"><type>x</type><joint "
           "name=\"j\"><hardwareInterfaces>y</hardwareInterfaces></joint></transmission>"),
       top("<transmission name=\"t\"><type>x</type><joint "
           "name=\"j\"><hardwareInterface>y</hardwareInterface></joint></transmission>"),
       "<hardwareInterfaces"},
  };
}

std::string place_of(const std::string& text, const std::string& at) {
  const std::size_t offset = text.find(at);
  const auto line = std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(offset), '\n') + 1;
  const std::size_t begin = offset == 0 ? std::string::npos : text.rfind('\n', offset - 1);
  return std::to_string(line) + ":" +
         std::to_string(begin == std::string::npos ? offset + 1 : offset - begin);
}

class Rules : public AuditTest, public testing::WithParamInterface<Case> {};

TEST_P(Rules, BadSnippetGivesFindingAndGoodGivesNone) {
  const Case& c = GetParam();
  const std::string bad = robot(c.bad);
  const AuditReport report = check(bad);
  const Finding* found = find(report, c.rule);
  ASSERT_NE(found, nullptr) << bad << report_text(report);
  EXPECT_EQ(found->severity, c.severity) << found->message;
  if (!c.at.empty()) {
    EXPECT_EQ(std::to_string(found->where.line) + ":" + std::to_string(found->where.column),
              place_of(bad, c.at))
        << bad;
  }
  const AuditReport fine = check(robot(c.good));
  EXPECT_EQ(find(fine, c.rule), nullptr) << robot(c.good) << report_text(fine);
}

TEST_P(Rules, FixRemovesFinding) {
  const Case& c = GetParam();
  const fs::path file = write("r.urdf", robot(c.bad));
  const AuditReport report = check_file(file);
  const Finding* found = find(report, c.rule);
  ASSERT_NE(found, nullptr);
  EXPECT_EQ(!found->repair.empty(), c.fixable) << found->message;
  if (!c.fixable) return;
  PackageResolver resolver;
  Diagnostics ignored;
  ExpandedDescription description = expand_corrected(file, {}, resolver, ignored);
  std::vector<Operation> repairs = found->repair;
  for (Operation& repair : repairs) {
    take_fingerprint(repair, description);
    apply_overlay({{}, {repair}}, description, resolver, ignored);
  }
  add_to_overlay(file, repairs);
  const AuditReport after = check_file(file);
  EXPECT_EQ(find(after, c.rule), nullptr) << report_text(after);
  EXPECT_EQ(find(after, "overlay.changed"), nullptr);
  EXPECT_LT(after.count(Severity::error), report.count(Severity::error) + 1);
}

std::string name_of(const testing::TestParamInfo<Case>& info) {
  std::string name = info.param.rule + "_" + std::to_string(info.index);
  std::replace(name.begin(), name.end(), '.', '_');
  return name;
}

INSTANTIATE_TEST_SUITE_P(Joints, Rules, testing::ValuesIn(joint_cases()), name_of);
INSTANTIATE_TEST_SUITE_P(Mimics, Rules, testing::ValuesIn(mimic_cases()), name_of);
INSTANTIATE_TEST_SUITE_P(Inertia, Rules, testing::ValuesIn(inertia_cases()), name_of);
INSTANTIATE_TEST_SUITE_P(Shapes, Rules, testing::ValuesIn(shape_cases()), name_of);
INSTANTIATE_TEST_SUITE_P(Names, Rules, testing::ValuesIn(name_cases()), name_of);
INSTANTIATE_TEST_SUITE_P(Schema, Rules, testing::ValuesIn(schema_cases()), name_of);

}  // namespace
}  // namespace doppel::audit_test
