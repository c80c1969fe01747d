#pragma once
// Robots with the triangles of their meshes, and FCL's verdicts by its own trees: only the files are common
// to them and the code under test.

#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "doppel/robot/clearance/clearance.h"
#include "doppel/robot/collision/test/fcl_reference.h"

namespace doppel::test {

// FCL's trees and primitives of a body, each with its pose in the body.
using FclParts = std::vector<std::pair<FclGeometry, Pose>>;

inline bool parts_touch(const FclParts& a, const Pose& X_WA, const FclParts& b, const Pose& X_WB) {
  const fcl::CollisionRequestd request;
  for (const auto& [part_a, X_AP] : a) {
    for (const auto& [part_b, X_BP] : b) {
      fcl::CollisionResultd result;
      fcl::collide(part_a.get(), X_WA * X_AP, part_b.get(), X_WB * X_BP, request, result);
      if (result.isCollision()) return true;
    }
  }
  return false;
}

struct TriangleRobot {
  std::shared_ptr<const Model> model;
  std::shared_ptr<const CollisionScene> scene;
  std::vector<std::shared_ptr<const InstanceCovers>> covers;
  std::vector<FclParts> links;  // [links] FCL's trees and primitives

  [[nodiscard]] bool touch(int link_a, int link_b, std::span<const Pose> X_WL) const {
    const auto a = static_cast<std::size_t>(link_a), b = static_cast<std::size_t>(link_b);
    return parts_touch(links[a], X_WL[a], links[b], X_WL[b]);
  }
};

inline FclGeometry fcl_tree(const TriangleMesh& mesh) {
  auto tree = std::make_shared<fcl::BVHModel<fcl::OBBRSSd>>();
  std::vector<fcl::Vector3d> vertices;
  for (const Eigen::Vector3f& p : mesh.vertices) vertices.push_back(p.cast<double>());
  std::vector<fcl::Triangle> triangles;
  for (const auto& t : mesh.triangles) triangles.emplace_back(t[0], t[1], t[2]);
  tree->beginModel(static_cast<int>(triangles.size()), static_cast<int>(vertices.size()));
  tree->addSubModel(vertices, triangles);
  tree->endModel();
  return tree;
}

inline std::vector<FclParts> fcl_links(const RobotDescription& robot, const SceneInstance& instance) {
  std::vector<FclParts> out;
  for (std::size_t link = 0; link < instance.shapes.size(); ++link) {
    out.emplace_back();
    for (const CollisionShape& shape : instance.shapes[link]) {
      const Collision& collision = robot.find_link(instance.model->links[link].name)
                                       ->collisions[static_cast<std::size_t>(shape.id.collision)];
      if (const auto* mesh = std::get_if<MeshGeometry>(&collision.geometry)) {
        out.back().emplace_back(fcl_tree(load_mesh(*mesh)), collision.origin.pose());
      } else {
        out.back().emplace_back(fcl_geometry(shape), shape.X_LS);
      }
    }
  }
  return out;
}

// A description of robots/ or of a file; pairs that touch at the start are allowed. `objects` come after it.
inline TriangleRobot load_triangles(const std::string& target, const std::filesystem::path& robots,
                                    std::vector<SceneInstance> objects = {}, bool ground = false) {
  Diagnostics diagnostics;
  const RobotDescription robot = load_robot(target, robots, diagnostics);
  TriangleRobot out;
  out.model = std::make_shared<const Model>(compile_model(robot, BaseKind::fixed, diagnostics));
  SceneInstance instance = described_robot(robot, *out.model);
  out.links = fcl_links(robot, instance);
  SceneOptions options;
  options.detail = CollisionDetail::triangles;
  options.ground = ground;
  CollisionContext start(std::make_shared<const CollisionScene>(std::vector{instance}, options));
  for (const auto& [a, b] : start.scene().tested_pairs()) {
    if (start.surfaces_touch(a, b)) options.allowed.push_back({a, b, "touching at the start"});
  }
  out.covers.push_back(make_covers(instance));
  CoverOptions still;
  still.still = true;
  for (const SceneInstance& object : objects) out.covers.push_back(make_covers(object, still));
  objects.insert(objects.begin(), std::move(instance));
  for (std::size_t i = 0; i < objects.size(); ++i) {
    const BodyId root{static_cast<int>(i), 0};
    if (i == 0 || start.scene().has_shape({0, 0}))
      options.allowed.push_back({{0, 0}, root, "the base stands there"});
  }
  out.scene = std::make_shared<const CollisionScene>(std::move(objects), options);
  return out;
}

inline SceneInstance placed_object(const std::string& name, const Geometry& shape,
                                   const Eigen::Vector3d& position) {
  SceneInstance out;
  out.name = name;
  out.shapes = {{collision_shape(shape, nullptr, Pose::Identity(), Friction{})}};
  out.X_WR.translation() = position;
  return out;
}

}  // namespace doppel::test
