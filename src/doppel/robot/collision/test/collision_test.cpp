#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <numbers>
#include <optional>
#include <random>

#include "doppel/description/meshes/mesh.h"
#include "doppel/description/urdf/load.h"
#include "doppel/robot/collision/collision_scene.h"
#include "doppel/robot/collision/detail/convex.h"

namespace doppel {
namespace {

using Eigen::Vector3d;

class Random {
 public:
  explicit Random(unsigned seed) : generator_(seed) {}
  double in(double low, double high) { return std::uniform_real_distribution(low, high)(generator_); }
  Vector3d vector(double reach) { return {in(-reach, reach), in(-reach, reach), in(-reach, reach)}; }
  Pose pose(double reach) { return make_pose(vector(reach), vector(std::numbers::pi)); }

 private:
  std::mt19937 generator_;
};

double distance(const ConvexShape& a, const ConvexShape& b, const Pose& X_AB) {
  ConvexWorkspace memory;
  return convex_distance(ConvexSolid(a), ConvexSolid(b), X_AB, kFarAway, memory).distance;
}

bool overlap(const ConvexShape& a, const ConvexShape& b, const Pose& X_AB) {
  ConvexWorkspace memory;
  return convex_closer(ConvexSolid(a), ConvexSolid(b), X_AB, -kTouching, memory);
}

// 0: they do not overlap by more than kTouching.
double depth(const ConvexShape& a, const ConvexShape& b, const Pose& X_AB) {
  const double found = -distance(a, b, X_AB);
  EXPECT_EQ(overlap(a, b, X_AB), found > kTouching);
  return found > kTouching ? found : 0;
}

Pose moved(double x, double y, double z) {
  return make_pose({x, y, z}, Vector3d::Zero());
}

// The separating axis test of two boxes: the least overlap over the 15 relevant axes.
double box_depth(const Box& a, const Box& b, const Pose& X_AB) {
  std::vector<Vector3d> axes;
  for (int i = 0; i < 3; ++i) {
    axes.emplace_back(Vector3d::Unit(i));
    axes.emplace_back(X_AB.linear().col(i));
    for (int j = 0; j < 3; ++j) axes.push_back(Vector3d::Unit(i).cross(X_AB.linear().col(j)));
  }
  double least = 1e9;
  for (Vector3d axis : axes) {
    if (axis.norm() < 1e-9) continue;
    axis.normalize();
    const double reach_a = 0.5 * a.size.dot(axis.cwiseAbs());
    const double reach_b = 0.5 * b.size.dot((X_AB.linear().transpose() * axis).cwiseAbs());
    least = std::min(least, reach_a + reach_b - std::abs(X_AB.translation().dot(axis)));
  }
  return std::max(0.0, least);
}

TEST(ConvexDepthTest, BoxesAgreeWithSeparatingAxisTest) {
  const unsigned seed = 41;
  SCOPED_TRACE("seed 41");
  Random random(seed);
  int overlapping = 0;
  for (int trial = 0; trial < 20000; ++trial) {
    const Box a{{random.in(0.01, 0.3), random.in(0.01, 0.3), random.in(0.01, 0.3)}};
    const Box b{{random.in(0.01, 0.3), random.in(0.01, 0.3), random.in(0.01, 0.3)}};
    Pose X_AB = random.pose(0.2);
    if (trial % 3 == 0) {  // with parallel axes, as is common in robots
      const Vector3d quarter(std::round(random.in(-2, 2)), std::round(random.in(-2, 2)), 0);
      X_AB.linear() = rotation_from_rpy(quarter * (std::numbers::pi / 2));
    }
    if (trial % 7 == 0) X_AB.translation().setZero();
    const double expected = box_depth(a, b, X_AB);
    overlapping += expected > 0 ? 1 : 0;
    ASSERT_NEAR(depth(a, b, X_AB), expected > kTouching ? expected : 0, 2e-7)
        << "expected the depth of the separating axis test, trial " << trial;
    if (std::abs(expected - kTouching) > 1e-9) {
      ASSERT_EQ(overlap(a, b, X_AB), expected > kTouching)
          << "expected the overlap of the separating axis test, trial " << trial;
    }
  }
  EXPECT_GT(overlapping, 5000);
}

TEST(ConvexDepthTest, PointBoxEqualsBox) {
  SCOPED_TRACE("seed 42");
  Random random(42);
  for (int trial = 0; trial < 2000; ++trial) {
    const Box a{{random.in(0.01, 0.3), random.in(0.01, 0.3), random.in(0.01, 0.3)}};
    const Box b{{random.in(0.01, 0.3), random.in(0.01, 0.3), random.in(0.01, 0.3)}};
    const Pose X_AB = random.pose(0.2);
    ConvexPoints points;
    points.vertices.resize(3, 8);
    for (int i = 0; i < 8; ++i)
      points.vertices.col(i) =
          0.5 * a.size.cwiseProduct(Vector3d(i & 1 ? 1 : -1, i & 2 ? 1 : -1, i & 4 ? 1 : -1));
    const double expected = box_depth(a, b, X_AB);
    ASSERT_NEAR(depth(points, b, X_AB), expected > kTouching ? expected : 0, 2e-7)
        << "expected the depth of the separating axis test, trial " << trial;
  }
}

TEST(ConvexDepthTest, RoundShapesAgreeWithClosedForms) {
  SCOPED_TRACE("seed 43");
  Random random(43);
  for (int trial = 0; trial < 500; ++trial) {
    const Sphere a{random.in(0.01, 0.2)}, b{random.in(0.01, 0.2)};
    const Pose X_AB = random.pose(0.15);
    const double expected = std::max(0.0, a.radius + b.radius - X_AB.translation().norm());
    ASSERT_NEAR(depth(a, b, X_AB), expected, 1e-6);
    // Two cylinders side by side with parallel axes, one shifted along its axis: the depth is the smaller one
    // of sideways and along the axis.
    const Cylinder c{random.in(0.02, 0.1), random.in(0.05, 0.4)},
        d{random.in(0.02, 0.1), random.in(0.05, 0.4)};
    const Vector3d p = random.vector(0.15);
    Pose X_CD = moved(p.x(), p.y(), p.z());
    X_CD.linear() = rotation_from_rpy({0, 0, random.in(-3, 3)});
    const double sideways = c.radius + d.radius - p.head<2>().norm();
    const double along = 0.5 * (c.length + d.length) - std::abs(p.z());
    ASSERT_NEAR(depth(c, d, X_CD), std::max(0.0, std::min(sideways, along)), 2e-6);
    // A capsule that lies across a face of a box.
    const Capsule k{random.in(0.01, 0.05), random.in(0.05, 0.2)};
    const Box table{{2, 2, 2}};
    const double height = random.in(0.95, 1.2);
    Pose X_TK = moved(0, 0, height);
    X_TK.linear() = rotation_from_rpy({std::numbers::pi / 2, 0, random.in(-3, 3)});
    ASSERT_NEAR(depth(table, k, X_TK), std::max(0.0, 1 + k.radius - height), 2e-6);
  }
}

TEST(ConvexDepthTest, CrossedCylindersAndSymmetricCasesAreExact) {
  const Cylinder rod{0.05, 2};
  Pose across = moved(0, 0.07, 0);
  across.linear() = rotation_from_rpy({0, std::numbers::pi / 2, 0});
  EXPECT_NEAR(depth(rod, rod, across), 0.03, 1e-6);
  EXPECT_NEAR(depth(rod, rod, Pose::Identity()), 0.1, 1e-5);
  EXPECT_NEAR(depth(Sphere{0.1}, Sphere{0.2}, Pose::Identity()), 0.3, 1e-9);
  EXPECT_EQ(depth(Box{{1, 1, 1}}, Box{{1, 1, 1}}, moved(1, 0, 0)), 0)
      << "expected no depth where faces touch";
  EXPECT_NEAR(depth(Box{{1, 1, 1}}, Box{{1, 1, 1}}, moved(0.9, 0, 0)), 0.1, 1e-9);
  EXPECT_NEAR(depth(Box{{1, 1, 1}}, Box{{0.1, 0.1, 0.1}}, moved(0, 0, 0)), 0.55, 1e-9)
      << "expected the shortest way out of the larger box";
  ConvexPoints flat;
  flat.vertices.resize(3, 4);
  flat.vertices << 0, 1, 1, 0, 0, 0, 1, 1, 0, 0, 0, 0;
  EXPECT_EQ(depth(flat, flat, moved(0.5, 0, 0)), 0) << "expected no depth of two plates in one plane";
  EXPECT_NEAR(depth(flat, Box{{1, 1, 1}}, moved(0.5, 0.5, 0)), 0.5, 1e-9);
}

// -- links

// An STL file of triangles in the temporary folder.
class StlFile {
 public:
  explicit StlFile(const std::string& name) : path_(testing::TempDir() + "/" + name), file_(path_) {
    file_ << "solid s\n";
  }
  void face(const Vector3d& a, const Vector3d& b, const Vector3d& c) {
    file_ << "facet normal 0 0 0\nouter loop\n";
    for (const Vector3d& p : {a, b, c}) file_ << "vertex " << p.x() << ' ' << p.y() << ' ' << p.z() << '\n';
    file_ << "endloop\nendfacet\n";
  }
  std::string finished() {
    file_ << "endsolid s\n";
    file_.close();
    return path_;
  }

 private:
  std::string path_;
  std::ofstream file_;
};

std::string write_tetrahedra(const std::string& name, const std::vector<std::array<Vector3d, 4>>& solids) {
  StlFile file(name);
  for (const auto& t : solids) {
    file.face(t[0], t[1], t[2]);
    file.face(t[0], t[3], t[1]);
    file.face(t[1], t[3], t[2]);
    file.face(t[2], t[3], t[0]);
  }
  return file.finished();
}

// Moeller 1997 in its simplest form: an edge of one triangle crosses the other.
bool edge_crosses(const std::array<Vector3d, 3>& edges_of, const std::array<Vector3d, 3>& t) {
  const Vector3d n = (t[1] - t[0]).cross(t[2] - t[0]);
  for (int e = 0; e < 3; ++e) {
    const Vector3d p = edges_of[e], q = edges_of[(e + 1) % 3];
    const double dp = n.dot(p - t[0]), dq = n.dot(q - t[0]);
    if ((dp > 0) == (dq > 0)) continue;
    const Vector3d x = p + (q - p) * (dp / (dp - dq));
    bool inside = true;
    for (int i = 0; i < 3; ++i) inside = inside && n.dot((t[(i + 1) % 3] - t[i]).cross(x - t[i])) >= 0;
    if (inside) return true;
  }
  return false;
}

bool brute_force_touch(const TriangleMesh& a, const TriangleMesh& b, const Pose& X_AB) {
  for (const auto& s : a.triangles) {
    const std::array<Vector3d, 3> first{a.vertices[s[0]].cast<double>(), a.vertices[s[1]].cast<double>(),
                                        a.vertices[s[2]].cast<double>()};
    for (const auto& t : b.triangles) {
      const std::array<Vector3d, 3> second{X_AB * b.vertices[t[0]].cast<double>(),
                                           X_AB * b.vertices[t[1]].cast<double>(),
                                           X_AB * b.vertices[t[2]].cast<double>()};
      if (edge_crosses(first, second) || edge_crosses(second, first)) return true;
    }
  }
  return false;
}

std::string link_with(const std::string& name, const std::string& geometry) {
  return "<link name=\"" + name + "\"><collision><geometry>" + geometry + "</geometry></collision></link>";
}

RobotDescription robot_of(const std::string& links) {
  PackageResolver resolver;
  Diagnostics diagnostics;
  const auto joint = [](const std::string& child) {
    return "<joint name=\"to_" + child + "\" type=\"continuous\"><parent link=\"root\"/><child link=\"" +
           child + "\"/></joint>";
  };
  return parse_urdf("<robot name=\"r\"><link name=\"root\"/>" + links + joint("a") + joint("b") + "</robot>",
                    "test.urdf", resolver, diagnostics);
}

// The links a and b of robot_of(), at any poses.
class Pairing {
 public:
  Pairing(const RobotDescription& robot, CollisionDetail detail) {
    Diagnostics diagnostics;
    const Model model = compile_model(robot, BaseKind::fixed, diagnostics);
    a_.link = model.find_link("a");
    b_.link = model.find_link("b");
    SceneOptions options;
    options.detail = detail;
    context_.emplace(
        std::make_shared<const CollisionScene>(std::vector{described_robot(robot, model)}, options));
  }
  void place(const Pose& X_WA, const Pose& X_WB) {
    std::vector<Pose> X_WL(3, Pose::Identity());
    X_WL[static_cast<std::size_t>(a_.link)] = X_WA;
    X_WL[static_cast<std::size_t>(b_.link)] = X_WB;
    context_->set_link_poses(0, X_WL);
  }
  bool touch(const Pose& X_WA, const Pose& X_WB) {
    place(X_WA, X_WB);
    return context_->closer(a_, b_, -kTouching);
  }
  double depth(const Pose& X_AB) {
    place(Pose::Identity(), X_AB);
    return std::max(0.0, -context_->distance(a_, b_).distance);
  }
  CollisionContext& context() { return *context_; }
  [[nodiscard]] BodyId a() const { return a_; }
  [[nodiscard]] BodyId b() const { return b_; }

 private:
  BodyId a_{0, -1}, b_{0, -1};
  std::optional<CollisionContext> context_;
};

TEST(CollisionSceneTest, TrianglesAgreeWithBruteForce) {
  SCOPED_TRACE("seed 44");
  Random random(44);
  std::vector<std::array<Vector3d, 4>> solids;
  for (int i = 0; i < 12; ++i) {
    const Vector3d at = random.vector(0.3);
    solids.push_back(
        {at + random.vector(0.1), at + random.vector(0.1), at + random.vector(0.1), at + random.vector(0.1)});
  }
  const std::string first = write_tetrahedra("first.stl", {solids.begin(), solids.begin() + 6});
  const std::string second = write_tetrahedra("second.stl", {solids.begin() + 6, solids.end()});
  const RobotDescription robot = robot_of(link_with("a", "<mesh filename=\"file://" + first + "\"/>") +
                                          link_with("b", "<mesh filename=\"file://" + second + "\"/>"));
  Pairing triangles(robot, CollisionDetail::triangles), hulls(robot, CollisionDetail::hulls);
  const TriangleMesh mesh_a = load_mesh(first, Vector3d::Ones()),
                     mesh_b = load_mesh(second, Vector3d::Ones());
  int touching = 0;
  for (int trial = 0; trial < 2000; ++trial) {
    const std::vector<Pose> X_WL{random.pose(0.5), random.pose(0.5)};
    const bool expected = brute_force_touch(mesh_a, mesh_b, X_WL[0].inverse() * X_WL[1]);
    ASSERT_EQ(triangles.touch(X_WL[0], X_WL[1]), expected) << "trial " << trial;
    if (expected) {
      ASSERT_TRUE(hulls.touch(X_WL[0], X_WL[1])) << "trial " << trial;
    }
    touching += expected ? 1 : 0;
  }
  EXPECT_GT(touching, 100);
  EXPECT_LT(touching, 1900);
}

// A ball of triangles with its poles on z.
std::string write_ball(const std::string& name, double radius, int rings, int sides) {
  const auto point = [&](int ring, int side) {
    const double polar = std::numbers::pi * ring / rings, around = 2 * std::numbers::pi * side / sides;
    return Vector3d(radius * std::sin(polar) * std::cos(around), radius * std::sin(polar) * std::sin(around),
                    radius * std::cos(polar));
  };
  StlFile file(name);
  for (int ring = 0; ring < rings; ++ring) {
    for (int side = 0; side < sides; ++side) {
      file.face(point(ring, side), point(ring + 1, side), point(ring + 1, side + 1));
      if (ring > 0) file.face(point(ring, side), point(ring + 1, side + 1), point(ring, side + 1));
    }
  }
  return file.finished();
}

// The hull of a mesh with so many vertices is reduced, so that a plane between the hulls may cut the mesh.
TEST(CollisionSceneTest, VertexThatReducedHullLeavesOutIsFoundByItsTriangles) {
  constexpr double kRadius = 0.1, kHalf = 0.01, kStep = 1e-5;
  const std::string ball = write_ball("ball.stl", kRadius, 40, 80);
  const RobotDescription robot = robot_of(link_with("a", "<mesh filename=\"file://" + ball + "\"/>") +
                                          link_with("b", "<box size=\"0.2 0.2 0.02\"/>"));
  Pairing triangles(robot, CollisionDetail::triangles), hulls(robot, CollisionDetail::hulls);
  int left_out = 0;
  for (const Eigen::Vector3f& vertex : load_mesh(ball, Vector3d::Ones()).vertices) {
    const Vector3d n = vertex.cast<double>().normalized();
    const auto plate_deeper_by = [&](double depth) {
      Pose X = Pose::Identity();
      X.linear() = Eigen::Quaterniond::FromTwoVectors(Vector3d::UnitZ(), n).toRotationMatrix();
      X.translation() = n * (vertex.cast<double>().norm() + kHalf - depth);
      return X;
    };
    ASSERT_TRUE(triangles.touch(Pose::Identity(), plate_deeper_by(kStep))) << n.transpose();
    ASSERT_FALSE(triangles.touch(Pose::Identity(), plate_deeper_by(-kStep))) << n.transpose();
    left_out += hulls.touch(Pose::Identity(), plate_deeper_by(kStep)) ? 0 : 1;
  }
  EXPECT_GT(left_out, 100) << "expected a hull that is reduced";
}

TEST(CollisionSceneTest, ShapeOriginsAreApplied) {
  const RobotDescription robot = robot_of(
      "<link name=\"a\"><collision><origin xyz=\"1 0 0\"/><geometry><box size=\"0.2 0.2 0.2\"/></geometry>"
      "</collision><collision><geometry><sphere radius=\"0.1\"/></geometry></collision></link>" +
      link_with("b", "<cylinder radius=\"0.05\" length=\"0.4\"/>"));
  Pairing pair(robot, CollisionDetail::hulls);
  CollisionContext& context = pair.context();
  EXPECT_TRUE(context.scene().has_shape(pair.a()));
  EXPECT_NEAR(pair.depth(moved(1.1, 0, 0)), 0.05, 1e-6);
  EXPECT_NEAR(pair.depth(moved(0.12, 0, 0)), 0.03, 1e-6);
  EXPECT_EQ(pair.depth(moved(0.5, 0, 0)), 0);
  pair.place(Pose::Identity(), moved(1.1, 0, 0));
  ASSERT_EQ(context.contacts().size(), 1u);
  EXPECT_EQ(context.contacts()[0].a, pair.a());
  EXPECT_EQ(context.contacts()[0].b, pair.b());
}

TEST(CollisionSceneTest, MissingMeshesAndEmptyShapesAreLeftOut) {
  const RobotDescription robot =
      robot_of(link_with("a", "<mesh filename=\"nowhere.stl\"/>") + link_with("b", "<sphere radius=\"0\"/>"));
  Pairing pair(robot, CollisionDetail::triangles);
  EXPECT_FALSE(pair.context().scene().has_shape(pair.a()));
  EXPECT_FALSE(pair.context().scene().has_shape(pair.b()));
  EXPECT_TRUE(pair.context().contacts().empty());
}

}  // namespace
}  // namespace doppel
