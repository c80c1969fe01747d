#include "doppel/validation/statics/shape_gates.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "doppel/description/meshes/mesh_report.h"
#include "doppel/robot/kinematics/kinematics.h"
#include "doppel/validation/statics/detail/audit_split.h"

namespace doppel {
namespace {

constexpr std::size_t kMaxTriangles = 2000;  // of a collision mesh
constexpr std::size_t kMinRatio = 10;        // of visual to collision triangles, above kMaxTriangles

// 0: it is no mesh, or cannot be read.
std::size_t triangles_of(const Geometry& geometry) {
  const auto* const mesh = std::get_if<MeshGeometry>(&geometry);
  return mesh == nullptr || mesh->path.empty() ? 0 : cached_mesh_report(mesh->path).triangles;
}

// The visual that belongs to a collision mesh: the one with the most triangles of its link.
std::size_t visual_triangles(const Link& link) {
  std::size_t out = 0;
  for (const Visual& visual : link.visuals) out = std::max(out, triangles_of(visual.geometry));
  return out;
}

struct Counts {
  std::size_t shapes = 0, meshes = 0, most = 0;
  std::string worst;
};

void judge_link(const Link& link, Counts& counts, CheckResult& out) {
  for (const Collision& collision : link.collisions) {
    ++counts.shapes;
    const std::size_t triangles = triangles_of(collision.geometry);
    if (triangles == 0) continue;
    ++counts.meshes;
    if (triangles > counts.most) {
      counts.most = triangles;
      counts.worst = link.name;
    }
    const std::size_t visual = visual_triangles(link);
    const std::string subject = fmt::format("link '{}'", link.name);
    if (triangles > kMaxTriangles) {
      out.fail(subject,
               fmt::format("its collision mesh has {} triangles (limit {})", triangles, kMaxTriangles),
               "export a simplified mesh, or use boxes and cylinders", collision.source);
    } else if (visual > kMaxTriangles && triangles * kMinRatio > visual) {
      out.add({subject, Verdict::warned,
               fmt::format("its collision mesh has {} triangles, 1/{:.1f} of its visual's {} (at most 1/{})",
                           triangles, static_cast<double>(visual) / static_cast<double>(triangles), visual,
                           kMinRatio),
               "export a simplified mesh, or use boxes and cylinders", collision.source});
    }
  }
}

// Positions of one scalar joint that are tried.
std::vector<double> positions_of(const ModelJoint& joint) {
  constexpr double kTurn = 3.14, kSlide = 1.0;  // of joints without limits
  const double far = joint.type == JointType::prismatic ? kSlide : kTurn;
  const double lower = std::isfinite(joint.lower) ? joint.lower : -far;
  const double upper = std::isfinite(joint.upper) ? joint.upper : far;
  return {lower, 0.5 * (lower + upper), upper};
}

bool is_finite(const Data& data) {
  return std::ranges::all_of(data.X_WL, [](const Pose& pose) { return pose.matrix().allFinite(); });
}

}  // namespace

CheckResult check_collision_shapes(const CheckContext& context) {
  CheckResult out = begin_result("G05");
  Counts counts;
  for (const Link& link : context.subject.description().links) judge_link(link, counts, out);
  out.metrics.push_back(
      {"triangles", counts.worst, static_cast<double>(counts.most), "", static_cast<double>(kMaxTriangles)});
  out.notes.push_back("in the simulation a mesh collides as its convex hull, whatever its triangles");
  if (counts.shapes == 0) {
    out.fail("", "no link has a collision shape, so that the robot touches nothing",
             "add <collision> elements: boxes, cylinders or simplified meshes");
  }
  out.summary = counts.most == 0 ? fmt::format("{} shapes, no mesh", counts.shapes)
                                 : fmt::format("{} shapes, {} meshes, at most {} triangles (limit {})",
                                               counts.shapes, counts.meshes, counts.most, kMaxTriangles);
  return out;
}

CheckResult check_motion_ranges(const CheckContext& context) {
  const Model& model = *context.subject.model;
  CheckResult out = begin_result("G07");
  add_findings(context.subject.audit, AuditPart::meshes, out);
  Data data(model);
  std::size_t joints = 0;
  for (const ModelJoint& joint : model.joints) {
    if (!joint.scalar() || joint.mimics()) continue;
    ++joints;
    for (const double position : positions_of(joint)) {
      Eigen::VectorXd q = model.neutral();
      q[joint.q] = position;
      model.apply_mimics(q);
      forward_kinematics(model, data, q);
      if (!is_finite(data))
        out.fail(joint.name, fmt::format("at {:.3g} a link has a pose that is not finite", position));
    }
  }
  const auto failures = std::ranges::count(out.items, Verdict::failed, &CheckItem::verdict);
  out.summary = fmt::format("{} joints at their lower, middle and upper positions", joints);
  if (failures > 0) out.summary += fmt::format(", {} meshes or poses missing", failures);
  return out;
}

}  // namespace doppel
