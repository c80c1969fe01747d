#include <Eigen/Geometry>

#include "doppel/base/core/diagnostic.h"
#include "doppel/base/core/read_file.h"
#include "doppel/review/comparison/detail/comparison.h"

namespace doppel::comparison {
namespace {

// The tensor about the centre of mass in the link's axes, independent of the inertial frame's rotation.
Eigen::Matrix3d in_link_axes(const Inertial& inertial) {
  const Eigen::Matrix3d R = rotation_from_rpy(inertial.origin.rpy);
  return R * inertial.tensor() * R.transpose();
}

std::string tensor_text(const Eigen::Matrix3d& I) {
  return fmt::format("{:.4g} {:.4g} {:.4g} | {:.4g} {:.4g} {:.4g} kg m^2", I(0, 0), I(1, 1), I(2, 2),
                     I(0, 1) + 0.0, I(0, 2) + 0.0, I(1, 2) + 0.0);
}

void compare_inertials(const Link& a, const Link& b, Changes& changes) {
  if (!a.inertial && !b.inertial) return;
  if (!a.inertial || !b.inertial) {
    const auto one = [](const Link& link) {
      return link.inertial ? Changes::shown(link.inertial->mass * 1e3, "g") : std::string("none");
    };
    return changes.add("inertia", one(a), one(b));
  }
  const Inertial &from = *a.inertial, &to = *b.inertial;
  changes.number("mass", from.mass, to.mass, 1e3, "g");
  if ((from.origin.xyz - to.origin.xyz).norm() > kSameLength) {
    changes.add("centre of mass", Changes::shown(from.origin.xyz, 1e3, "mm"),
                Changes::shown(to.origin.xyz, 1e3, "mm"),
                fmt::format("moved by {:.6g} mm", (from.origin.xyz - to.origin.xyz).norm() * 1e3));
  }
  const Eigen::Matrix3d I = in_link_axes(from), J = in_link_axes(to);
  if ((I - J).norm() > kSameRelative * std::max(I.norm(), J.norm()))
    changes.add("inertia", tensor_text(I), tensor_text(J), "xx yy zz | xy xz yz, about the centre of mass");
}

std::string size_text(const Geometry& geometry) {
  if (const auto* box = std::get_if<Box>(&geometry)) return "box " + Changes::shown(box->size, 1e3, "mm");
  if (const auto* c = std::get_if<Cylinder>(&geometry))
    return fmt::format("cylinder r {:.6g} l {:.6g} mm", c->radius * 1e3, c->length * 1e3);
  if (const auto* c = std::get_if<Capsule>(&geometry))
    return fmt::format("capsule r {:.6g} l {:.6g} mm", c->radius * 1e3, c->length * 1e3);
  if (const auto* s = std::get_if<Sphere>(&geometry))
    return fmt::format("sphere r {:.6g} mm", s->radius * 1e3);
  if (const auto* e = std::get_if<Ellipsoid>(&geometry))
    return "ellipsoid " + Changes::shown(e->radii, 1e3, "mm");
  if (const auto* c = std::get_if<Cone>(&geometry))
    return fmt::format("cone r {:.6g} l {:.6g} mm", c->radius * 1e3, c->length * 1e3);
  if (const auto* p = std::get_if<Plane>(&geometry)) return "plane " + Changes::shown(p->normal, 1, "");
  if (const auto* e = std::get_if<Extrusion>(&geometry))
    return fmt::format("extrusion of {} corners, {:.6g} mm high", e->outline.size(), e->height * 1e3);
  if (const auto* h = std::get_if<Heightmap>(&geometry))
    return fmt::format("heightmap {} {}", h->image.uri, Changes::shown(h->size, 1, "m"));
  const auto& mesh = std::get<MeshGeometry>(geometry);
  return "mesh " + mesh.uri.substr(mesh.uri.find_last_of('/') + 1);
}

// The same bytes under another name are the same shape.
bool same_file(const MeshGeometry& a, const MeshGeometry& b) {
  if (a.path == b.path) return a.path.empty() ? a.uri == b.uri : true;
  if (a.path.empty() || b.path.empty()) return size_text(a) == size_text(b);
  constexpr std::size_t kMaxBytes = std::size_t{1} << 30;
  try {
    return read_file(a.path, kMaxBytes) == read_file(b.path, kMaxBytes);
  } catch (const InputError&) {
    return false;
  }
}

void compare_shapes(const Geometry& a, const Geometry& b, const std::string& what, Changes& changes) {
  const auto *mesh_a = std::get_if<MeshGeometry>(&a), *mesh_b = std::get_if<MeshGeometry>(&b);
  if (mesh_a == nullptr || mesh_b == nullptr) {
    if (size_text(a) != size_text(b)) changes.add(what, size_text(a), size_text(b));
    return;
  }
  if (!same_file(*mesh_a, *mesh_b)) {
    changes.add(what, size_text(a), size_text(b),
                size_text(a) == size_text(b) ? "the file's content differs" : "");
  }
  if ((mesh_a->scale - mesh_b->scale).norm() > kSameRelative * mesh_a->scale.norm())
    changes.add(what + " scale", Changes::shown(mesh_a->scale, 1, ""), Changes::shown(mesh_b->scale, 1, ""));
}

void compare_origins(const Origin& a, const Origin& b, const std::string& what, Changes& changes) {
  const double moved = (a.xyz - b.xyz).norm();
  const double turned =
      std::abs(Eigen::AngleAxisd(rotation_from_rpy(a.rpy).transpose() * rotation_from_rpy(b.rpy)).angle());
  if (moved > kSameLength) {
    changes.add(what + " position", Changes::shown(a.xyz, 1e3, "mm"), Changes::shown(b.xyz, 1e3, "mm"),
                fmt::format("moved by {:.6g} mm", moved * 1e3));
  }
  if (turned > kSameAngle) {
    changes.add(what + " orientation", Changes::shown(a.rpy, 1, "rad"), Changes::shown(b.rpy, 1, "rad"),
                fmt::format("turned by {:.6g} deg", turned / kDegree));
  }
}

template <class Part>
void compare_parts(const std::vector<Part>& a, const std::vector<Part>& b, const char* what,
                   Changes& changes) {
  if (a.size() != b.size()) {
    const auto list = [](const std::vector<Part>& parts) {
      std::string out = parts.empty() ? "none" : "";
      for (const Part& part : parts) out += (out.empty() ? "" : ", ") + size_text(part.geometry);
      return out;
    };
    return changes.add(what, list(a), list(b));
  }
  for (std::size_t i = 0; i < a.size(); ++i) {
    const std::string which = a.size() == 1 ? std::string(what) : fmt::format("{} {}", what, i + 1);
    compare_shapes(a[i].geometry, b[i].geometry, which, changes);
    compare_origins(a[i].origin, b[i].origin, which, changes);
  }
}

}  // namespace

void compare_link(const Link& a, const Link& b, std::vector<Change>& out) {
  Changes changes(out, "link", b.name);
  compare_inertials(a, b, changes);
  compare_parts(a.visuals, b.visuals, "visual", changes);
  compare_parts(a.collisions, b.collisions, "collision", changes);
}

}  // namespace doppel::comparison
