#include "doppel/physics/engines/mujoco/box_contacts.h"

#include <mujoco/mujoco.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace doppel {
namespace {

constexpr double kRounding = 1e-6;  // m, by which a correct depth may exceed the overlap

// The normal of a face and the distance of the other box along it.
struct Face {
  int axis = 0;              // of the box that has the face
  bool of_a = true;          // else of b
  Eigen::Vector3d normal_W;  // unit, outward, to the other box
  double distance = -std::numeric_limits<double>::infinity();
};

double reach(const PlacedBox& box, const Eigen::Vector3d& direction_W) {
  return box.half.dot((box.X_WB.linear().transpose() * direction_W).cwiseAbs());
}

Face nearest_face(const PlacedBox& a, const PlacedBox& b) {
  Face best;
  const Eigen::Vector3d between = b.X_WB.translation() - a.X_WB.translation();
  for (const bool of_a : {true, false}) {
    const PlacedBox &own = of_a ? a : b, &other = of_a ? b : a;
    for (int axis = 0; axis < 3; ++axis) {
      Eigen::Vector3d normal = own.X_WB.linear().col(axis);
      const double along = normal.dot(of_a ? between : Eigen::Vector3d(-between));
      if (along < 0) normal = -normal;
      const double distance = std::abs(along) - own.half[axis] - reach(other, normal);
      if (distance > best.distance) best = {axis, of_a, normal, distance};
    }
  }
  return best;
}

// A convex polygon of at most 8 corners: a face clipped at four planes.
struct Polygon {
  std::array<Eigen::Vector3d, 8> corners;
  int count = 0;
  void add(const Eigen::Vector3d& corner) {
    if (count < 8) corners[static_cast<std::size_t>(count++)] = corner;
  }
  // Keeps the part where normal . p <= offset.
  void clip(const Eigen::Vector3d& normal, double offset) {
    Polygon out;
    for (int i = 0; i < count; ++i) {
      const Eigen::Vector3d &p = corners[static_cast<std::size_t>(i)],
                            &q = corners[static_cast<std::size_t>((i + 1) % count)];
      const double at_p = normal.dot(p) - offset, at_q = normal.dot(q) - offset;
      if (at_p <= 0) out.add(p);
      if ((at_p < 0 && at_q > 0) || (at_p > 0 && at_q < 0)) out.add(p + (q - p) * (at_p / (at_p - at_q)));
    }
    *this = out;
  }
};

// The face of the box that looks most against `direction_W`.
Polygon facing(const PlacedBox& box, const Eigen::Vector3d& direction_W) {
  const Eigen::Vector3d direction = box.X_WB.linear().transpose() * direction_W;
  int axis = 0;
  direction.cwiseAbs().maxCoeff(&axis);
  const int side = (axis + 1) % 3, third = (axis + 2) % 3;
  Polygon out;
  for (const auto& [s, t] : {std::pair{1, 1}, {-1, 1}, {-1, -1}, {1, -1}}) {
    Eigen::Vector3d corner = Eigen::Vector3d::Zero();
    corner[axis] = direction[axis] > 0 ? -box.half[axis] : box.half[axis];
    corner[side] = s * box.half[side];
    corner[third] = t * box.half[third];
    out.add(box.X_WB * corner);
  }
  return out;
}

mjfCollision original = nullptr;

PlacedBox box_of(const mjModel* m, const mjData* d, int geom) {
  PlacedBox out;
  out.half = Eigen::Map<const Eigen::Vector3d>(m->geom_size + 3 * geom);
  out.X_WB.linear() = Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(d->geom_xmat + 9 * geom);
  out.X_WB.translation() = Eigen::Map<const Eigen::Vector3d>(d->geom_xpos + 3 * geom);
  return out;
}

int checked_box_contacts(const mjModel* m, const mjData* d, mjContact* contacts, int geom_a, int geom_b,
                         mjtNum margin) {
  const int found = original(m, d, contacts, geom_a, geom_b, margin);
  if (found == 0) return 0;
  const PlacedBox a = box_of(m, d, geom_a), b = box_of(m, d, geom_b);
  const double limit = face_distance(a, b) - kRounding;
  if (std::all_of(contacts, contacts + found, [&](const mjContact& c) { return c.dist >= limit; }))
    return found;
  const BoxContacts right = face_contacts(a, b, margin);
  for (int i = 0; i < right.count; ++i) {
    mjContact& out = contacts[i];
    out.dist = right.points[i].distance;
    Eigen::Map<Eigen::Vector3d>(out.pos) = right.points[i].p_W;
    Eigen::Map<Eigen::Vector3d>(out.frame) = right.normal_W;
    std::fill_n(out.frame + 3, 6, 0.0);
  }
  return right.count;
}

}  // namespace

double face_distance(const PlacedBox& a, const PlacedBox& b) {
  return nearest_face(a, b).distance;
}

BoxContacts face_contacts(const PlacedBox& a, const PlacedBox& b, double margin) {
  const Face face = nearest_face(a, b);
  const PlacedBox &own = face.of_a ? a : b, &other = face.of_a ? b : a;
  Polygon touching = facing(other, face.normal_W);
  for (int side = 0; side < 3; ++side) {
    if (side == face.axis) continue;
    const Eigen::Vector3d across = own.X_WB.linear().col(side);
    const double middle = across.dot(own.X_WB.translation());
    touching.clip(across, middle + own.half[side]);
    touching.clip(-across, own.half[side] - middle);
  }
  BoxContacts out;
  out.normal_W = face.of_a ? face.normal_W : Eigen::Vector3d(-face.normal_W);
  const double surface = face.normal_W.dot(own.X_WB.translation()) + own.half[face.axis];
  for (int i = 0; i < touching.count; ++i) {
    const Eigen::Vector3d& p = touching.corners[static_cast<std::size_t>(i)];
    const double distance = face.normal_W.dot(p) - surface;
    if (distance < margin) out.points[out.count++] = {p - 0.5 * distance * face.normal_W, distance};
  }
  return out;
}

void install_checked_box_contacts() {
  mjfCollision& used = mjCOLLISIONFUNC[mjGEOM_BOX][mjGEOM_BOX];
  original = used;
  used = &checked_box_contacts;
}

}  // namespace doppel
