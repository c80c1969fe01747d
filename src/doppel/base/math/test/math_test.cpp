#include <gtest/gtest.h>

#include <numbers>
#include <random>
#include <vector>

#include "doppel/base/math/mass_properties.h"
#include "doppel/base/math/pose_motion.h"

namespace doppel {
namespace {

TEST(Pose, RpyIsFixedAxesXyz) {
  const Eigen::Matrix3d R = rotation_from_rpy({0.0, 0.0, std::numbers::pi / 2});
  EXPECT_TRUE((R * Eigen::Vector3d::UnitX()).isApprox(Eigen::Vector3d::UnitY()));
  const Eigen::Matrix3d both = rotation_from_rpy({std::numbers::pi / 2, 0.0, std::numbers::pi / 2});
  EXPECT_TRUE((both * Eigen::Vector3d::UnitY()).isApprox(Eigen::Vector3d::UnitZ()));
}

TEST(PoseMotion, TurnsAndMovesByVelocitiesBeforeAndAfterInstant) {
  const PoseMotion frame{make_pose({1, 2, 3}, {0, 0, 0.5}), {2, 0, -1}, {0, 0, 0.4}};
  for (const double time : {-1.0, 0.0, 0.25, 3.0}) {
    const Pose X = frame.at(time);
    EXPECT_TRUE(X.linear().isApprox(rotation_from_rpy({0, 0, 0.5 + 0.4 * time}), 1e-12)) << time;
    EXPECT_TRUE(X.translation().isApprox(Eigen::Vector3d(1 + 2 * time, 2, 3 - time), 1e-12)) << time;
  }
}

TEST(Pose, RpyRoundTripsAtSingularity) {
  const unsigned seed = 7;
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> angle(-3.1, 3.1);
  for (int i = 0; i < 1000; ++i) {
    Eigen::Vector3d rpy(angle(random), angle(random), angle(random));
    if (i % 10 == 0) rpy.y() = (i % 20 == 0 ? 1 : -1) * std::numbers::pi / 2;
    const Eigen::Matrix3d R = rotation_from_rpy(rpy);
    EXPECT_LT((rotation_from_rpy(rpy_from_rotation(R)) - R).norm(), 1e-9) << "seed " << seed << " case " << i;
  }
}

TEST(Pose, RotationFromZToOppositeDirectionIsLeastRotation) {
  const unsigned seed = 11;
  std::mt19937 random(seed);
  std::normal_distribution<double> coordinate;
  for (int i = 0; i < 1000; ++i) {
    Eigen::Vector3d to(coordinate(random), coordinate(random), coordinate(random));
    if (i % 4 == 0) to = Eigen::Vector3d(1e-3 * std::pow(0.9, i) * to.x(), 0, -2);
    const Eigen::Matrix3d R = rotation_from_z(to);
    EXPECT_LT((R * Eigen::Vector3d::UnitZ() - to.normalized()).norm(), 1e-14)
        << "seed " << seed << " case " << i;
    EXPECT_LT((R * R.transpose() - Eigen::Matrix3d::Identity()).norm(), 1e-14)
        << "seed " << seed << " case " << i;
    const double cos_angle = (R.trace() - 1) / 2;
    EXPECT_NEAR(cos_angle, to.normalized().z(), 1e-12) << "seed " << seed << " case " << i;
  }
  const Eigen::Matrix3d about_x = Eigen::Vector3d(1, -1, -1).asDiagonal();
  EXPECT_LT((rotation_from_z({0, 0, -1}) - about_x).norm(), 1e-15);
}

TEST(MassProperties, BoxMeshMatchesClosedForm) {
  const Eigen::Vector3f lo(1, 2, 3), hi(1.2f, 2.6f, 4.0f);
  std::vector<Eigen::Vector3f> v;
  for (int i = 0; i < 8; ++i)
    v.emplace_back(i & 1 ? hi.x() : lo.x(), i & 2 ? hi.y() : lo.y(), i & 4 ? hi.z() : lo.z());
  const std::vector<std::array<std::uint32_t, 3>> t{{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6},
                                                    {0, 1, 4}, {1, 5, 4}, {2, 6, 3}, {3, 6, 7},
                                                    {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  const SolidProperties s = solid_properties(v, t);
  const double x = 0.2, y = 0.6, z = 1.0, m = x * y * z;
  EXPECT_NEAR(s.volume, m, 1e-6);
  EXPECT_LT((s.unit.com - Eigen::Vector3d(1.1, 2.3, 3.5)).norm(), 1e-6);
  EXPECT_NEAR(s.unit.I(0, 0), m / 12 * (y * y + z * z), 1e-6);
  EXPECT_NEAR(s.unit.I(1, 1), m / 12 * (x * x + z * z), 1e-6);
  EXPECT_NEAR(s.unit.I(0, 1), 0.0, 1e-6);
}

TEST(MassProperties, TwoHalvesCombineToWhole) {
  // Two point masses on x: I about y and z is 2 * m * r^2.
  const MassProperties a{1.0, {0.5, 0, 0}, Eigen::Matrix3d::Zero()},
      b{1.0, {-0.5, 0, 0}, Eigen::Matrix3d::Zero()};
  const MassProperties sum = combined(a, b);
  EXPECT_DOUBLE_EQ(sum.mass, 2.0);
  EXPECT_TRUE(sum.I.isApprox(Eigen::Vector3d(0, 0.5, 0.5).asDiagonal().toDenseMatrix()));
  const MassProperties turned = transformed(sum, make_pose({0, 0, 1}, {0, 0, std::numbers::pi / 2}));
  EXPECT_TRUE(turned.com.isApprox(Eigen::Vector3d(0, 0, 1)));
  EXPECT_TRUE(turned.I.isApprox(Eigen::Vector3d(0.5, 0, 0.5).asDiagonal().toDenseMatrix(), 1e-9));
}

}  // namespace
}  // namespace doppel
