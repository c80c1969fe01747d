// Data sheets: units, interpolation, the bundled library, and the audit's findings on them.
#include "doppel/review/audit/detail/datasheet.h"

#include <fmt/format.h>

#include <numbers>

#include "doppel/review/audit/drive_precision.h"
#include "doppel/review/audit/test/audit_rig.h"

namespace doppel {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;

const fs::path kLibrary = fs::path(DOPPEL_SOURCE_DIR) / "datasheets";

class DatasheetTest : public AuditRig {
 protected:
  static std::string sheet(const std::string& more) {
    return "actuator: X\n" + more + "source: {title: t, url: u, date: 2026-11}\n";
  }
  std::string error_of(const std::string& yaml) {
    write("x.yaml", yaml);
    try {
      load_datasheet(folder_ / "x.yaml", kLibrary);
    } catch (const InputError& error) {
      return error.what();
    }
    return "accepted";
  }
};

TEST_F(DatasheetTest, UnitsAreConvertedToSi) {
  const auto torque = [&](const std::string& value) {
    write("x.yaml", sheet("stall_torque: [{voltage: 5, " + value + "}]\n"));
    return load_datasheet(folder_ / "x.yaml", kLibrary).actuator->stall_torque.at(0).value;
  };
  EXPECT_NEAR(torque("value: 36, unit: kg cm"), 36 * 0.0980665, 1e-12);
  EXPECT_NEAR(torque("value: 100, unit: N cm"), 1, 1e-12);
  EXPECT_NEAR(torque("value: 100, unit: oz in"), 0.70615518, 1e-7);
  const auto speed = [&](const std::string& value) {
    write("x.yaml", sheet("no_load_speed: [{voltage: 5, " + value + "}]\n"));
    return load_datasheet(folder_ / "x.yaml", kLibrary).actuator->no_load_speed.at(0).value;
  };
  EXPECT_NEAR(speed("value: 0.20, unit: s/60deg"), 5.2359877559829888, 1e-12);
  EXPECT_NEAR(speed("value: 60, unit: rpm"), 2 * std::numbers::pi, 1e-12);
  EXPECT_NEAR(speed("value: 180, unit: deg/s"), std::numbers::pi, 1e-12);
}

TEST_F(DatasheetTest, PrecisionIsConvertedToJoint) {
  write("servo.yaml", sheet("resolution: {value: 4096, unit: steps/turn}\n"
                            "backlash: {value: 15, unit: arcmin}\nnoise: {value: 0.1, unit: deg}\n"));
  write("arm.yaml", "joints:\n  shoulder: {actuator: servo.yaml, reduction: 2}\n  nowhere: servo.yaml\n");
  RobotDescription robot;
  robot.joints.emplace_back();
  robot.joints.back().name = "shoulder";
  robot.joints.back().type = JointType::revolute;
  AuditOptions with_sheets;
  with_sheets.datasheet = folder_ / "arm.yaml";
  with_sheets.datasheet_folder = kLibrary;
  const auto precision = drive_precision(robot, with_sheets);
  ASSERT_THAT(precision, SizeIs(1));
  const DrivePrecision& shoulder = precision.at("shoulder");
  EXPECT_EQ(shoulder.actuator, "X");
  EXPECT_NEAR(shoulder.resolution, std::numbers::pi / 4096, 1e-15);
  EXPECT_NEAR(shoulder.backlash, std::numbers::pi / 180 / 8, 1e-15);
  EXPECT_NEAR(shoulder.noise, std::numbers::pi / 180 / 20, 1e-15);
  robot.joints.back().type = JointType::prismatic;
  EXPECT_THAT(drive_precision(robot, with_sheets), IsEmpty());
}

TEST_F(DatasheetTest, PrecisionInWrongUnitIsRefused) {
  EXPECT_THAT(error_of(sheet("resolution: {value: 4096, unit: steps}\n")), HasSubstr("steps/turn"));
  EXPECT_THAT(error_of(sheet("backlash: {value: 4, unit: steps/turn}\n")), HasSubstr("unknown unit"));
  EXPECT_THAT(error_of("type: linear\n" + sheet("noise: {value: 1, unit: deg}\n")),
              HasSubstr("unknown unit"));
  EXPECT_THAT(error_of(sheet("backlsh: {value: 4, unit: deg}\n")), HasSubstr("did you mean 'backlash'"));
}

TEST_F(DatasheetTest, RatingsAreInterpolatedBetweenVoltagesOnly) {
  const std::vector<RatedValue> rows{{5, 10, "a"}, {7, 20, "b"}};
  EXPECT_DOUBLE_EQ(rated(rows, 6)->value, 15);
  EXPECT_DOUBLE_EQ(rated(rows, 4)->value, 10);
  EXPECT_DOUBLE_EQ(rated(rows, 9)->value, 20);
  EXPECT_DOUBLE_EQ(rated(rows, std::nullopt)->value, 20)
      << "without a voltage, the largest value of the sheet is expected";
  EXPECT_FALSE(rated({}, 5));
}

TEST_F(DatasheetTest, UnknownKeyIsRefusedWithPlaceAndNearestName) {
  EXPECT_THAT(error_of(sheet("stal_torque: []\n")), HasSubstr("x.yaml:2:1"));
  EXPECT_THAT(error_of(sheet("stal_torque: []\n")), HasSubstr("did you mean 'stall_torque'?"));
  EXPECT_THAT(error_of(sheet("stall_torque: [{voltage: 5, value: 36, unit: kgcm}]\n")),
              HasSubstr("did you mean 'kg cm'?"));
  EXPECT_THAT(error_of(sheet("stall_torque: [{voltage: 5, value: -1, unit: N m}]\n")),
              HasSubstr("not a positive number"));
  EXPECT_THAT(error_of(sheet("stall_torque: [{voltage: 5, value: \"3,6\", unit: N m}]\n")),
              HasSubstr("not a positive number"));
  EXPECT_THAT(error_of("actuator: X\n"), HasSubstr("'source' is missing"));
  EXPECT_THAT(error_of("arm: a\njoints: {j: ds3241}\n"), HasSubstr("did you mean 'ds3240'?"));
  EXPECT_THAT(error_of("arm: a\njoints: {j: {actuator: ds3240, redution: 2}}\n"),
              HasSubstr("did you mean 'reduction'?"));
  for (const char* count : {"1e300", "1.5", "0"})
    EXPECT_THAT(error_of(fmt::format("arm: a\njoints: {{j: {{actuator: ds3240, count: {}}}}}\n", count)),
                HasSubstr(fmt::format("'{}' is not a", count)));
  EXPECT_THAT(error_of("a: [\n"), HasSubstr("not valid YAML"));
}

TEST_F(DatasheetTest, BundledSheetsAreCompleteAndPlausible) {
  std::size_t count = 0;
  for (const auto& entry : fs::directory_iterator(kLibrary)) {
    if (entry.path().extension() != ".yaml") continue;
    ++count;
    const Datasheet sheet = load_datasheet(entry.path().stem(), kLibrary);
    ASSERT_TRUE(sheet.actuator) << entry.path();
    const ActuatorSheet& a = *sheet.actuator;
    ASSERT_FALSE(a.stall_torque.empty() || a.no_load_speed.empty() || !a.travel) << entry.path();
    EXPECT_THAT(a.source, HasSubstr("http")) << entry.path();
    for (const RatedValue& row : a.stall_torque)
      EXPECT_TRUE(row.value > 0.1 && row.value < 20) << entry.path();
    for (const RatedValue& row : a.no_load_speed)
      EXPECT_TRUE(row.value > 2 && row.value < 20) << entry.path();
    EXPECT_TRUE(*a.travel >= std::numbers::pi - 1e-9 && *a.travel <= 2 * std::numbers::pi + 1e-9)
        << entry.path();
  }
  EXPECT_GE(count, 6u);
}

TEST_F(DatasheetTest, LimitsBeyondActuatorAreReported) {
  // The rig's joints: effort 3, velocity 4, 3 rad of range; the DS3240 has 3.53 N m, 5.24 rad/s, 180 degrees.
  options.datasheet = "DS3240";
  options.datasheet_folder = kLibrary;
  EXPECT_THAT(of("datasheet.above", ""), IsEmpty());
  EXPECT_THAT(of("datasheet.travel", ""), IsEmpty());
  options.datasheet = "sg90";
  const auto above = of("datasheet.above", "");
  ASSERT_THAT(above, SizeIs(2))
      << "expected one finding for each of the two driven joints, none for the mimic joint";
  EXPECT_EQ(above[0].severity, Severity::error);
  EXPECT_THAT(above[0].message, HasSubstr("1.8 kg cm at 4.8 V"));
  ASSERT_THAT(above[0].repair, SizeIs(1));
  const auto& set = std::get<SetLimit>(above[0].repair[0].action);
  EXPECT_EQ(set.joint, "shoulder");
  EXPECT_DOUBLE_EQ(set.effort.value(), 0.18);
  EXPECT_FALSE(set.velocity);
  options.datasheet = "xm430_w350";
  EXPECT_THAT(of("datasheet.far_below", ""), IsEmpty());
  options.datasheet = "no_such";
  EXPECT_THROW(of("datasheet.above", ""), InputError);
}

TEST_F(DatasheetTest, ArmSheetSetsVoltageReductionAndCount) {
  write("arm.yaml",
        "arm: a\nvoltage: 5\njoints:\n  shoulder: {actuator: sg90, reduction: 20, count: 2}\n  elbo: sg90\n");
  options.datasheet = folder_ / "arm.yaml";
  options.datasheet_folder = kLibrary;
  // 2 * 20 * 0.1765 N m = 7.06 is enough; 10.47 / 20 = 0.52 rad/s is too slow for 4, and 9 degrees for 3 rad.
  const auto above = of("datasheet.above", "");
  ASSERT_THAT(above, SizeIs(1));
  EXPECT_THAT(above[0].message, HasSubstr("velocity 4 rad/s"));
  EXPECT_DOUBLE_EQ(std::get<SetLimit>(above[0].repair.at(0).action).velocity.value(), 0.52);
  EXPECT_THAT(of("datasheet.travel", ""), SizeIs(1));
  const auto unknown = of("datasheet.unknown_joint", "");
  ASSERT_THAT(unknown, SizeIs(1));
  EXPECT_THAT(unknown[0].message, HasSubstr("did you mean 'elbow'?"));
  EXPECT_EQ(unknown[0].where.line, 5);
}

TEST_F(DatasheetTest, ExporterDefaultIsReportedOnceAndFixed) {
  std::string text = robot("");
  const std::string limit = "effort=\"3\" velocity=\"4\"";
  text.replace(text.find(limit), limit.size(), "effort=\"100\" velocity=\"100\"");
  write(name_, text);
  options.datasheet = "ds3240";
  options.datasheet_folder = kLibrary;
  std::size_t errors = 0;
  for (const Finding& f : report().findings) {
    if (f.subject != "joint 'shoulder'" || f.severity != Severity::error) continue;
    ++errors;
    ASSERT_THAT(f.repair, SizeIs(1)) << f.rule;
    const auto& set = std::get<SetLimit>(f.repair[0].action);
    EXPECT_TRUE(set.effort == 3.5 || set.velocity == 6.2) << f.rule;  // of 6.8 V: no voltage is given
    EXPECT_THAT(f.fix, HasSubstr("DS3240"));
  }
  EXPECT_EQ(errors, 2u) << "expected one error for the effort and one for the velocity, from whichever rule";
}

TEST_F(DatasheetTest, PackageSheetIsFoundWithoutOption) {
  write("package.xml", "<package><name>r</name></package>");
  write("config/actuators.yaml", "arm: a\njoints: {elbow: sg90}\n");
  options.datasheet_folder = kLibrary;
  EXPECT_THAT(of("datasheet.above", ""), SizeIs(1));
  write("export/package.xml", "<package><name>r</name></package>");
  write("config/actuators.yaml", "arm: a\njoints: {elbow: sg90}\n");
  options.package_folder = folder_ / "export";
  EXPECT_THAT(of("datasheet.above", ""), SizeIs(1))
      << "expected the sheet of the package around the export to be found";
  options.package_folder = folder_;
  write("config/actuators.yaml", "arm: a\njoints: {elbow: sg91x}\n");
  const auto invalid = of("datasheet.invalid", "");
  ASSERT_THAT(invalid, SizeIs(1)) << "expected one finding; the valid entries are still checked";
  EXPECT_EQ(invalid[0].severity, Severity::warning);
}

}  // namespace
}  // namespace doppel
