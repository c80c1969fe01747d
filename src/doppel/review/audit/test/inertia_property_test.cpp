// For any shape, pose and material: the rule never reports a tensor that a body can have, and always reports
// one that no body can have.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <random>

#include "doppel/review/audit/detail/inertia_facts.h"
#include "doppel/review/audit/test/audit_fixture.h"

namespace doppel::audit_test {
namespace {

using namespace audit_rules;

constexpr unsigned kSeed = 20240917;
constexpr int kRounds = 60;

class TensorProperty : public AuditTest {
 protected:
  double between(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random_);
  }

  struct Body {
    Eigen::Vector3d size;
    double mass = 0;
    Eigen::Matrix3d R;
    Eigen::Vector3d moments;
  };
  Body body() {
    Body out;
    out.size = Eigen::Vector3d(between(0.02, 0.3), between(0.02, 0.3), between(0.02, 0.3));
    out.mass = between(300, 7000) * out.size.prod();
    out.R = rotation_from_rpy({between(-3, 3), between(-1.5, 1.5), between(-3, 3)});
    const Eigen::Vector3d s = out.size.cwiseAbs2() * out.mass / 12;
    out.moments = {s.y() + s.z(), s.x() + s.z(), s.x() + s.y()};
    return out;
  }
  static std::string urdf(const Body& b) {
    const Eigen::Matrix3d I = b.R * b.moments.asDiagonal() * b.R.transpose();
    const Eigen::Vector3d rpy = rpy_from_rotation(b.R);
    Parts p;
    p.inertial = fmt::format(
        R"(<inertial><mass value="{}"/><inertia ixx="{}" ixy="{}" ixz="{}" iyy="{}" iyz="{}" izz="{}"/></inertial>)",
        b.mass, I(0, 0), I(0, 1), I(0, 2), I(1, 1), I(1, 2), I(2, 2));
    const std::string shape =
        fmt::format(R"(<origin rpy="{} {} {}"/><geometry><box size="{} {} {}"/></geometry>)", rpy.x(),
                    rpy.y(), rpy.z(), b.size.x(), b.size.y(), b.size.z());
    p.visual = "<visual>" + shape + "</visual>";
    p.collision = "<collision>" + shape + "</collision>";
    return robot(p);
  }
  static std::vector<std::string> inertia_findings(const AuditReport& report, Severity at_least) {
    std::vector<std::string> out;
    for (const Finding& f : report.findings) {
      if (f.rule.starts_with("inertia.") && f.severity >= at_least) out.push_back(f.rule + ": " + f.message);
    }
    return out;
  }

  std::mt19937 random_{kSeed};
};

TEST_F(TensorProperty, TensorOfBodyGivesNoFinding) {
  SCOPED_TRACE(kSeed);
  for (int i = 0; i < kRounds; ++i) {
    const std::string text = urdf(body());
    EXPECT_EQ(inertia_findings(check(text), Severity::note), std::vector<std::string>{}) << text;
  }
}

TEST_F(TensorProperty, TriangleViolationGivesFinding) {
  SCOPED_TRACE(kSeed);
  for (int i = 0; i < kRounds; ++i) {
    Body b = body();
    const int axis = i % 3;
    const double factor = between(1.02, 20);
    b.moments[axis] = (b.moments.sum() - b.moments[axis]) * factor;
    const std::string text = urdf(b);
    const Severity least = factor > 1.4 ? Severity::error : Severity::warning;
    EXPECT_FALSE(inertia_findings(check(text), least).empty()) << text;
  }
}

TEST_F(TensorProperty, NegativeMomentGivesFinding) {
  SCOPED_TRACE(kSeed);
  for (int i = 0; i < kRounds; ++i) {
    Body b = body();
    b.moments[i % 3] *= -between(1e-3, 2);
    EXPECT_FALSE(inertia_findings(check(urdf(b)), Severity::error).empty());
  }
}

TEST_F(TensorProperty, OfferedTypoFixIsUniqueAndPossible) {
  SCOPED_TRACE(kSeed);
  int offered = 0;
  for (int i = 0; i < 300; ++i) {
    const Body b = body();
    Inertial inertial;
    inertial.mass = b.mass;
    LinkShape shape;
    shape.bounds = {Eigen::Vector3d(-0.5 * b.size), Eigen::Vector3d(0.5 * b.size)};
    Components truth{b.moments[0], 0, 0, b.moments[1], 0, b.moments[2]}, broken = truth;
    const std::size_t which = kDiagonal[static_cast<std::size_t>(i) % 3];
    broken[which] = -broken[which];
    const auto typo = only_typo(broken, inertial, shape);
    ASSERT_TRUE(typo.has_value());
    EXPECT_TRUE(possible(typo->corrected));
    EXPECT_EQ(typo->corrected, truth);
    ++offered;
  }
  EXPECT_EQ(offered, 300);
}

}  // namespace
}  // namespace doppel::audit_test
