#include "doppel/physics/engines/mujoco/cylinder_contacts.h"

#include <mujoco/mujoco.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <limits>

namespace doppel {
namespace {

constexpr double kLying = 0.1;     // sine of the largest angle between axis and face
constexpr double kShallow = 0.25;  // of the radius; the face through which a deeper one left is not certain

mjfCollision searched = nullptr;

using Matrix = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;

// In the axes of the box, from its centre.
struct LyingCylinder {
  Eigen::Vector3d centre, axis;
  double radius = 0, half = 0;
};

// A face of the box by its outward normal, sign * e(axis), and how far the cylinder is outside of it.
struct BoxFace {
  int axis = 0;
  double sign = 1, distance = -std::numeric_limits<double>::infinity();
};

BoxFace nearest_face(const LyingCylinder& of, const Eigen::Vector3d& box) {
  BoxFace best;
  for (int axis = 0; axis < 3; ++axis) {
    const double along = std::abs(of.axis[axis]);
    const double reach = of.radius * std::sqrt(std::max(1 - along * along, 0.0)) + of.half * along;
    const double distance = std::abs(of.centre[axis]) - box[axis] - reach;
    if (distance > best.distance) best = {axis, of.centre[axis] < 0 ? -1.0 : 1.0, distance};
  }
  return best;
}

// Shortens the segment from `a` to `b` to the part over the face. False: nothing is left.
bool clip_to_face(const BoxFace& face, const Eigen::Vector3d& box, Eigen::Vector3d& a, Eigen::Vector3d& b) {
  double from = 0, to = 1;
  const Eigen::Vector3d way = b - a;
  for (int axis = 0; axis < 3; ++axis) {
    if (axis == face.axis) continue;
    for (const double side : {-1.0, 1.0}) {
      const double start = side * a[axis] - box[axis], rise = side * way[axis];  // beyond the side
      if (std::abs(rise) < mjMINVAL) {
        if (start > 0) return false;
      } else if (rise > 0) {
        to = std::min(to, -start / rise);
      } else {
        from = std::max(from, -start / rise);
      }
    }
  }
  if (!(from < to)) return false;
  const Eigen::Vector3d first = a;
  a = first + from * way;
  b = first + to * way;
  return true;
}

int lying_contacts(const mjModel* m, const mjData* d, mjContact* contacts, int cylinder, int box,
                   mjtNum margin) {
  const Eigen::Map<const Matrix> R_WB(d->geom_xmat + 9 * box), R_WC(d->geom_xmat + 9 * cylinder);
  const Eigen::Map<const Eigen::Vector3d> p_B(d->geom_xpos + 3 * box), p_C(d->geom_xpos + 3 * cylinder),
      half(m->geom_size + 3 * box);
  const LyingCylinder of{R_WB.transpose() * (p_C - p_B), R_WB.transpose() * R_WC.col(2),
                         m->geom_size[3 * cylinder], m->geom_size[3 * cylinder + 1]};
  const BoxFace face = nearest_face(of, half);
  if (face.distance > margin) return 0;
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();
  normal[face.axis] = face.sign;
  const Eigen::Vector3d down = (normal.dot(of.axis) * of.axis - normal).normalized();
  Eigen::Vector3d a = of.centre + of.radius * down - of.half * of.axis,
                  b = of.centre + of.radius * down + of.half * of.axis;
  const bool lies = std::abs(of.axis[face.axis]) < kLying && face.distance > -kShallow * of.radius;
  if (!lies || !clip_to_face(face, half, a, b)) return searched(m, d, contacts, cylinder, box, margin);
  int count = 0;
  for (const Eigen::Vector3d& point : {a, b}) {
    const double distance = face.sign * point[face.axis] - half[face.axis];
    if (distance >= margin) continue;
    mjContact& out = contacts[count++];
    out.dist = distance;
    Eigen::Map<Eigen::Vector3d>(out.pos) = p_B + R_WB * (point - 0.5 * distance * normal);
    Eigen::Map<Eigen::Vector3d>(out.frame) = R_WB * -normal;  // from the cylinder to the box
    std::fill_n(out.frame + 3, 6, 0.0);
  }
  return count;
}

}  // namespace

void install_cylinder_contacts() {
  mjfCollision& used = mjCOLLISIONFUNC[mjGEOM_CYLINDER][mjGEOM_BOX];
  searched = used;
  used = &lying_contacts;
}

}  // namespace doppel
