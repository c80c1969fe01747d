// How the robot stands at the start: where a floating root is put, and what never collides because it touches
// there.

#include <algorithm>
#include <cmath>

#include "doppel/physics/mujoco/mujoco_engine_detail.h"

namespace doppel {
namespace {

constexpr double kOverlap = 1e-4;  // m: what stands on the ground or beside an object is not inside of it

// How far a geom reaches below its centre, m.
double reach_below(const mjModel* m, const mjData* d, int geom) {
  const double* const down = d->geom_xmat + 9 * geom + 6;  // the world's z axis in the geom's frame
  const double* const size = m->geom_size + 3 * geom;
  const double across = std::hypot(down[0], down[1]), along = std::abs(down[2]);
  switch (m->geom_type[geom]) {
    case mjGEOM_SPHERE:
      return size[0];
    case mjGEOM_CAPSULE:
      return size[0] + along * size[1];
    case mjGEOM_CYLINDER:
      return across * size[0] + along * size[1];
    case mjGEOM_BOX:
      return std::abs(down[0]) * size[0] + std::abs(down[1]) * size[1] + along * size[2];
    default:
      break;
  }
  const int mesh = m->geom_dataid[geom];
  double lowest = 0.0;
  for (int i = 0; m->geom_type[geom] == mjGEOM_MESH && i < m->mesh_vertnum[mesh]; ++i) {
    const float* const p = m->mesh_vert + 3 * (m->mesh_vertadr[mesh] + i);
    lowest = std::min(lowest, down[0] * p[0] + down[1] * p[1] + down[2] * p[2]);
  }
  return -lowest;
}

}  // namespace

// z of the robot's lowest point as it stands in MuJoCo's arrays, m; infinite: it has no shapes.
double MujocoEngine::lowest_point() const {
  double lowest = kInfinity;
  for (int geom = 0; geom < m()->ngeom; ++geom) {
    if (state_->link_of_body(m()->geom_bodyid[geom]) < 0) continue;
    lowest = std::min(lowest, d()->geom_xpos[3 * geom + 2] - reach_below(m(), d(), geom));
  }
  return lowest;
}

// Moves a floating joint from the root along the world's z until the robot's lowest point is on the ground.
// False: there is none, or nothing is to move.
bool MujocoEngine::raise_root(Eigen::VectorXd& q, bool only_out_of_ground) {
  const auto root = std::find_if(model_.joints.begin(), model_.joints.end(), [](const ModelJoint& joint) {
    return joint.type == JointType::floating && joint.parent_link == 0;
  });
  if (root == model_.joints.end() || !world_.ground) return false;
  state_->write_q(model_, q.data());
  if (!guarded([this] { mj_kinematics(m(), d()); })) return false;
  const double lowest = lowest_point();
  if (!std::isfinite(lowest) || (only_out_of_ground && lowest >= -kOverlap)) return false;
  const Eigen::Vector3d up =
      (world_.X_WR.linear() * root->X_PJ.linear()).transpose() * Eigen::Vector3d::UnitZ();
  q.segment<3>(root->q) -= lowest * up;
  return true;
}

void MujocoEngine::set_on_ground() {
  const bool placed = !world_.X_WR.isApprox(Pose::Identity());  // by the world file
  raise_root(q0_, placed);
}

void MujocoEngine::lift_out_of_ground() {
  Eigen::VectorXd raised = Eigen::Map<const Eigen::VectorXd>(q().data(), model_.nq);
  const std::vector<double> moving(v().begin(), v().end());
  if (raise_root(raised, true)) set_state({raised.data(), static_cast<std::size_t>(model_.nq)}, moving);
}

void MujocoEngine::choose_exclusions(bool self_collision) {
  for (LinkPair& pair : robot_.pairs) {
    if (pair.reason.empty() && !self_collision) pair.reason = "self-collision is off";
  }
  find_touching();
  state_->apply_exclusions(robot_.pairs, overlaps_);
  list_exclusions();
}

// Of the objects that are there now.
void MujocoEngine::list_exclusions() {
  excluded_.clear();
  for (const LinkPair& pair : robot_.pairs) {
    if (pair.reason.empty()) continue;
    excluded_.push_back({model_.links[pair.a].name, model_.links[pair.b].name, pair.reason});
  }
  for (const Overlap& overlap : overlaps_) {
    if (overlap.object != "ground" && find_object(overlap.object) < 0) continue;
    excluded_.push_back(
        {model_.links[overlap.link].name, overlap.object, "inside at the start", overlap.depth});
  }
  const std::vector<int> groups = rigid_groups(model_);
  for (std::size_t i = 0; i < groups.size(); ++i) {
    if (groups[i] != 0 || !robot_.has_shape[i]) continue;
    if (world_.ground) excluded_.push_back({model_.links[i].name, "ground", "fixed to the world"});
    for (const WorldObject& object : world_.objects) {
      if (!(object.mass > 0))
        excluded_.push_back({model_.links[i].name, object.name, "both fixed to the world"});
    }
  }
}

// Links that touch at the start are shaped so, as a hull that fills a hollow; they would push each other for
// ever. What is inside the ground or an object would be thrown. MuJoCo finds a limited number of contacts at
// a time, so it is asked until there are no further ones.
void MujocoEngine::find_touching() {
  state_->write_q(model_, q0_.data());
  bool found = true;
  while (found) {
    found = false;
    state_->apply_exclusions(robot_.pairs, overlaps_);
    if (!guarded([this] {
          mj_kinematics(m(), d());
          mj_comPos(m(), d());
          mj_collision(m(), d());
        })) {
      return;
    }
    for (int i = 0; i < d()->ncon; ++i) found = note_touching(describe(d()->contact[i])) || found;
  }
}

// False: nothing that was not known.
bool MujocoEngine::note_touching(const Contact& contact) {
  const int a = contact.link_a, b = contact.link_b;
  if (a >= 0 && b >= 0) {
    for (LinkPair& pair : robot_.pairs) {
      if (pair.a != std::min(a, b) || pair.b != std::max(a, b) || !pair.reason.empty()) continue;
      pair.reason = "touching at the start";
      return true;
    }
    return false;
  }
  const int link = std::max(a, b);
  if (link < 0 || contact.depth < kOverlap) return false;
  const std::string object(a < 0 ? contact.object_a : contact.object_b);
  for (Overlap& known : overlaps_) {
    if (known.link != link || known.object != object) continue;
    known.depth = std::max(known.depth, contact.depth);
    return false;
  }
  overlaps_.push_back({link, object, contact.depth});
  return true;
}

}  // namespace doppel
