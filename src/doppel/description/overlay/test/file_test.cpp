#include <unistd.h>

#include "doppel/description/overlay/test/overlay_fixture.h"

namespace doppel {
namespace {

using namespace overlay_test;
namespace fs = std::filesystem;
using testing::HasSubstr;
using testing::StartsWith;

std::string error_of(const std::string& yaml) {
  try {
    parse_overlay(yaml, "o.yaml");
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

TEST(OverlayFile, TypoIsReportedWithPlaceAndNearest) {
  EXPECT_THAT(error_of("- flip_axs: J 1"),
              StartsWith("o.yaml:1:3: error: 'flip_axs' is not an operation; did you mean 'flip_axis'?"));
  EXPECT_THAT(error_of("- flip_axis: J\n  wy: x"),
              StartsWith("o.yaml:2:3: error: flip_axis has no 'wy'; did you mean 'why'?"));
  EXPECT_THAT(error_of("- bake_zero: J\n  offset: 45 dg"),
              StartsWith("o.yaml:2:11: error: 'dg' is not a valid unit here; did you mean 'deg'?"));
  EXPECT_THAT(error_of("- bake_zero: J\n  offset: 4,5"), HasSubstr("'4,5' is not a number"));
  EXPECT_THAT(error_of("- bake_zero: J"), HasSubstr("bake_zero needs 'offset'"));
  EXPECT_THAT(error_of("- set_axis: J\n  axis: 1 0"), HasSubstr("three numbers"));
  EXPECT_THAT(error_of("- replace_collision: L\n  by: hul"), HasSubstr("did you mean 'hull'"));
  EXPECT_THAT(error_of("- flip_axis:"), HasSubstr("has no target"));
  EXPECT_THAT(error_of("- flip_axis: a\n  set_axis: b"), HasSubstr("two operations in one"));
  EXPECT_THAT(error_of("flip_axis: J"), HasSubstr("is a list of operations"));
  EXPECT_THAT(error_of("- [a"), StartsWith("o.yaml:"));
  EXPECT_THAT(error_of("- bad: 1\n- worse: 2"), HasSubstr("o.yaml:2:3"));
}

TEST(OverlayFile, InvalidValueIsRefused) {
  EXPECT_THAT(error_of("- set_inertia: L\n  mass: -3"),
              StartsWith("o.yaml:2:9: error: set_inertia: mass cannot be negative (-3)"));
  EXPECT_THAT(error_of("- set_inertia: L\n  mass: -3"), HasSubstr("did you mean 3?"));
  EXPECT_THAT(error_of("- set_inertia: L\n  mass: 0"), HasSubstr("remove_inertial"));
  EXPECT_THAT(error_of("- set_inertia: L\n  izz: -1e-3"), HasSubstr("did you mean 0.001?"));
  EXPECT_THAT(error_of("- set_axis: J\n  axis: 0 0 0"), HasSubstr("'axis: 0 0 1'"));
  EXPECT_THAT(error_of("- set_limit: J\n  effort: -3"), HasSubstr("did you mean 3?"));
  EXPECT_THAT(error_of("- set_limit: J\n  lower: 3\n  upper: 1"),
              HasSubstr("did you mean lower 1 and upper 3?"));
  EXPECT_THAT(error_of("- set_dynamics: J\n  friction: -0.5"), HasSubstr("did you mean 0.5?"));
  EXPECT_THAT(error_of("- set_servo: J\n  damping: -0.5"), HasSubstr("did you mean 0.5?"));
  EXPECT_THAT(error_of("- set_servo: J\n  stiffness: 0"), HasSubstr("stiffness"));
  EXPECT_THAT(error_of("- set_servo: J\n  stifness: 3\n  delay: 0"), HasSubstr("did you mean 'stiffness'?"));
  EXPECT_THAT(error_of("- set_servo: J"), HasSubstr("set_servo sets nothing"));
  EXPECT_THAT(error_of("- set_mesh_scale: L\n  scale: 0"), HasSubstr("makes the mesh vanish"));
  EXPECT_THAT(error_of("- set_mesh_scale: L\n  scale: [1, 0, 1]"), HasSubstr("makes the mesh vanish"));
  EXPECT_THAT(error_of("- add_mimic: J\n  leader: J"), HasSubstr("'J' cannot mimic itself"));
  EXPECT_THAT(error_of("- set_joint_type: J\n  type: revolut"), HasSubstr("did you mean 'revolute'?"));
  EXPECT_THAT(error_of("- compute_inertia: L\n  mass: 0"), HasSubstr("mass cannot be 0"));
  EXPECT_THAT(error_of("- compute_inertia: L\n  density: -7800"), HasSubstr("did you mean 7800?"));
  EXPECT_THAT(error_of("- rename_link: L\n  to: ''"), HasSubstr("'L' would have no name"));
  EXPECT_THAT(error_of("- scale_masses: -5"), StartsWith("o.yaml:1:17: error: scale_masses:"));
  EXPECT_THAT(error_of("- scale_masses: -5"), HasSubstr("did you mean 5?"));
  EXPECT_EQ(error_of("- set_mesh_scale: L\n  scale: [1, -1, 1]"), "")
      << "expected no error: mirrored meshes exist";
}

TEST(OverlayFile, MissingKeySuggestsMisspeltKey) {
  EXPECT_THAT(error_of("- bake_zero: J\n  ofset: 3"),
              StartsWith("o.yaml:2:3: error: bake_zero has no 'ofset'; did you mean 'offset'?"));
  EXPECT_THAT(error_of("- set_limit: J"), HasSubstr("give at least one of lower, upper, effort, velocity"));
  EXPECT_THAT(error_of("- set_limit: J\n  uper: 1"), HasSubstr("did you mean 'upper'?"));
  EXPECT_THAT(error_of("- set_inertia: L\n  why: x"), HasSubstr("set_inertia sets nothing"));
}

TEST(OverlayFile, EmptyFileHasNoOperations) {
  EXPECT_TRUE(parse_overlay("", "o.yaml").operations.empty());
  EXPECT_TRUE(parse_overlay("# only words\n", "o.yaml").operations.empty());
}

TEST(OverlayFile, PathIsNextToDescription) {
  EXPECT_EQ(overlay_path("a/arm.urdf.xacro"), "a/arm.overlay.yaml");
  EXPECT_EQ(overlay_path("a/arm.xacro"), "a/arm.overlay.yaml");
  EXPECT_EQ(overlay_path("arm.v2.urdf"), "arm.v2.overlay.yaml");
}

TEST(OverlayFile, SpecialCharactersRoundTrip) {
  Overlay overlay;
  for (const std::string text : {"plain", "a: b", "# no", "it's", "\"q\"", "x, y", "", "1 0 0", "- a", "yes",
                                 "two\nlines", "{", "null", "Rückgrat", "50 %", "@x", "tail "}) {
    Operation operation;
    operation.action = SetJointType{"J", "fixed"};
    operation.why = text;
    operation.evidence = {text, "b"};
    operation.was = {{"type", text}};
    overlay.operations.push_back(operation);
    const Overlay again = parse_overlay(to_yaml(overlay), "o.yaml");
    EXPECT_EQ(again.operations.back().why, text);
    EXPECT_EQ(again.operations.back().evidence[0], text);
    EXPECT_EQ(again.operations.back().was[0].second, text) << to_yaml(overlay);
  }
}

class OverlayEdits : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::temp_directory_path() / ("doppel_overlay_" + std::to_string(getpid()));
    fs::create_directories(folder_);
    urdf_ = folder_ / "arm.urdf";
    std::ofstream(urdf_) << kArm;
  }
  void TearDown() override { fs::remove_all(folder_); }
  [[nodiscard]] std::string text() const {
    std::ifstream in(overlay_path(urdf_));
    return {std::istreambuf_iterator<char>(in), {}};
  }
  void write(const std::string& yaml) const { std::ofstream(overlay_path(urdf_)) << yaml; }
  Operation made(const std::string& yaml) {
    Operation operation = parse_overlay(yaml, "new").operations.at(0);
    take_fingerprint(operation, expand_corrected(urdf_, {}, resolver_, diagnostics_));
    return operation;
  }
  fs::path folder_, urdf_;
  PackageResolver resolver_;
  Diagnostics diagnostics_;
};

constexpr const char* kByHand = R"(# my arm
- flip_axis: J 1   # on the bench
  # deep
  why: it turns the other way
  was: {axis: 1.0 0.0 -0.0}

# the servo's sheet
- set_limit: J 1
  effort: 3.5
  was: {effort: 100}
# the end
)";

TEST_F(OverlayEdits, AddedOperationIsAppended) {
  write(kByHand);
  add_to_overlay(urdf_, {made("- set_dynamics: J 1\n  damping: 0.5")});
  EXPECT_EQ(text(), std::string(kByHand) + "\n- set_dynamics: J 1\n  damping: 0.5\n  was: {damping: none}\n");
}

TEST_F(OverlayEdits, SameSettingIsReplacedWithFingerprint) {
  write(kByHand);
  add_to_overlay(urdf_, {made("- set_limit: J 1\n  effort: 4")});
  std::string expected = kByHand;
  expected.replace(expected.find("effort: 3.5"), 11, "effort: 4");
  EXPECT_EQ(text(), expected);
}

TEST_F(OverlayEdits, SecondZeroIsAdded) {
  add_to_overlay(urdf_, {made("- bake_zero: J 1\n  offset: 45 deg")});
  add_to_overlay(urdf_, {made("- bake_zero: J 1\n  offset: 2 deg")});
  const Overlay overlay = read_overlay(overlay_path(urdf_));
  ASSERT_EQ(overlay.operations.size(), 2U);
  const ExpandedDescription both = expand_corrected(urdf_, {}, resolver_, diagnostics_);
  EXPECT_TRUE(diagnostics_.all().empty());
  EXPECT_EQ(both.files.back(), overlay_path(urdf_));
  Operation now;
  now.action = RotateFrame{"J 1", {}};
  take_fingerprint(now, both);
  EXPECT_NEAR(std::stod(now.was[0].second), -0.570796 - 47 * 3.14159265358979 / 180, 1e-12);
}

TEST_F(OverlayEdits, RepeatedOperationIsNotAdded) {
  const Operation flip = made("- flip_axis: J 1");
  add_to_overlay(urdf_, {flip});
  const std::string once = text();
  add_to_overlay(urdf_, {flip});
  EXPECT_EQ(text(), once);
}

TEST_F(OverlayEdits, OperationWithoutFingerprintIsRefused) {
  EXPECT_THROW(add_to_overlay(urdf_, parse_overlay("- flip_axis: J 1", "x").operations), InputError);
  EXPECT_FALSE(fs::exists(overlay_path(urdf_)));
}

TEST_F(OverlayEdits, RemoveAndStampEditOneOperation) {
  write(std::string(kByHand) + "- flip_axis: J 3\n  why: x\n# end\n");
  Overlay overlay = read_overlay(overlay_path(urdf_));
  Operation stamped = overlay.operations[2];
  take_fingerprint(stamped, expand_description(urdf_, {}, resolver_, diagnostics_));
  stamp_overlay(overlay, 2, stamped);
  EXPECT_EQ(text(), std::string(kByHand) +
                        "- flip_axis: J 3\n  why: x\n  was: {axis: 0 -0.984808 -0.173648}\n# end\n");
  remove_from_overlay(read_overlay(overlay_path(urdf_)), 2);
  EXPECT_EQ(text(), std::string(kByHand) + "# end\n");
  remove_from_overlay(read_overlay(overlay_path(urdf_)), 0);
  EXPECT_THAT(text(), StartsWith("# my arm\n"));
  EXPECT_THAT(text(), HasSubstr("# the servo's sheet\n- set_limit: J 1\n"));
}

}  // namespace
}  // namespace doppel
