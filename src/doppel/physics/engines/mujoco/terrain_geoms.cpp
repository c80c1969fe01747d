#include "doppel/physics/engines/mujoco/terrain_geoms.h"

#include <mujoco/mujoco.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "doppel/physics/contract/detail/terrain_contacts.h"

namespace doppel {
namespace {

Eigen::Isometry3d placed_geom(const mjData* d, int geom) {
  Eigen::Isometry3d X_WG = Eigen::Isometry3d::Identity();
  X_WG.linear() = Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(d->geom_xmat + 9 * geom);
  X_WG.translation() = Eigen::Map<const Eigen::Vector3d>(d->geom_xpos + 3 * geom);
  return X_WG;
}

class GeomOnTerrain final : public ConvexOnTerrain {
 public:
  GeomOnTerrain(const mjModel* m, int geom, const Eigen::Isometry3d& X_FG)
      : type_(m->geom_type[geom]), size_(m->geom_size + 3 * geom), X_FG_(X_FG) {
    if (type_ != mjGEOM_MESH) return;
    const int mesh = m->geom_dataid[geom];
    vertices_ = m->mesh_vert + 3 * m->mesh_vertadr[mesh];
    vertex_count_ = m->mesh_vertnum[mesh];
  }

  [[nodiscard]] Eigen::Vector3d support(const Eigen::Vector3d& direction_F) const override {
    return X_FG_ * own_support(X_FG_.linear().transpose() * direction_F);
  }
  [[nodiscard]] Eigen::Vector3d centre() const override { return X_FG_.translation(); }
  [[nodiscard]] bool round() const override {
    return type_ == mjGEOM_SPHERE || type_ == mjGEOM_CAPSULE || type_ == mjGEOM_ELLIPSOID;
  }
  [[nodiscard]] int corners() const override {
    return type_ == mjGEOM_BOX || type_ == mjGEOM_CYLINDER ? 8 : vertex_count_;
  }
  [[nodiscard]] Eigen::Vector3d corner(int index) const override {
    if (type_ == mjGEOM_MESH) return X_FG_ * vertex(index);
    if (type_ == mjGEOM_CYLINDER) return X_FG_ * rim(index);
    const Eigen::Vector3d sign(index & 1 ? 1 : -1, index & 2 ? 1 : -1, index & 4 ? 1 : -1);
    return X_FG_ * sign.cwiseProduct(size());
  }
  [[nodiscard]] std::optional<TerrainContact> with_point(const Eigen::Vector3d& p_F) const override {
    const Eigen::Vector3d p = X_FG_.inverse() * p_F;
    Eigen::Vector3d outward = Eigen::Vector3d::UnitZ();  // of the face below which the point is
    double depth = 0;                                    // m
    const Eigen::Vector3d up = X_FG_.linear().row(2);
    if (type_ == mjGEOM_BOX) {
      int axis = 0;
      up.cwiseAbs().maxCoeff(&axis);
      if (((p.cwiseAbs() - size()).array() > 0).any()) return std::nullopt;
      outward = Eigen::Vector3d::Unit(axis) * (up[axis] > 0 ? -1.0 : 1.0);
      depth = size_[axis] - outward.dot(p);
    } else if (type_ == mjGEOM_CYLINDER) {
      const double across = p.head<2>().norm();
      if (across > size_[0] || std::abs(p.z()) > size_[1]) return std::nullopt;
      const bool stands = std::abs(up.z()) > std::sqrt(0.5);
      outward = stands ? Eigen::Vector3d(0, 0, up.z() > 0 ? -1 : 1)
                       : Eigen::Vector3d(-up.x(), -up.y(), 0).normalized();
      depth = stands ? size_[1] - outward.dot(p) : size_[0] - outward.dot(p);
    } else {
      return std::nullopt;
    }
    const Eigen::Vector3d normal = -(X_FG_.linear() * outward);
    return TerrainContact{p_F - 0.5 * depth * normal, normal, -depth};
  }

 private:
  [[nodiscard]] Eigen::Map<const Eigen::Vector3d> size() const {
    return Eigen::Map<const Eigen::Vector3d>(size_);
  }
  [[nodiscard]] Eigen::Vector3d vertex(int index) const {
    return Eigen::Map<const Eigen::Vector3f>(vertices_ + 3 * index).cast<double>();
  }
  // Four points of each rim, of which one is the lowest.
  [[nodiscard]] Eigen::Vector3d rim(int index) const {
    const Eigen::Vector2d down = -X_FG_.linear().row(2).head<2>();
    const Eigen::Vector2d lowest =
        down.norm() > 1e-9 ? Eigen::Vector2d(down.normalized()) : Eigen::Vector2d::UnitX();
    const Eigen::Vector2d side(-lowest.y(), lowest.x());
    const Eigen::Vector2d at = (index & 1 ? -size_[0] : size_[0]) * (index & 2 ? side : lowest);
    return {at.x(), at.y(), index & 4 ? size_[1] : -size_[1]};
  }
  [[nodiscard]] Eigen::Vector3d own_support(const Eigen::Vector3d& d) const {
    switch (type_) {
      case mjGEOM_SPHERE:
        return size_[0] * d.normalized();
      case mjGEOM_CAPSULE:
        return size_[0] * d.normalized() + Eigen::Vector3d(0, 0, std::copysign(size_[1], d.z()));
      case mjGEOM_ELLIPSOID: {
        const Eigen::Vector3d stretched = size().cwiseProduct(d);
        return size().cwiseProduct(stretched) / stretched.norm();
      }
      case mjGEOM_CYLINDER: {
        const double across = d.head<2>().norm();
        const Eigen::Vector2d at =
            across > 1e-12 ? Eigen::Vector2d(size_[0] / across * d.head<2>()) : Eigen::Vector2d(size_[0], 0);
        return {at.x(), at.y(), std::copysign(size_[1], d.z())};
      }
      case mjGEOM_BOX:
        return size().cwiseProduct(
            Eigen::Vector3d(std::copysign(1, d.x()), std::copysign(1, d.y()), std::copysign(1, d.z())));
      default:
        return farthest_vertex(d);
    }
  }
  [[nodiscard]] Eigen::Vector3d farthest_vertex(const Eigen::Vector3d& d) const {
    int best = 0;
    for (int i = 1; i < vertex_count_; ++i) {
      if (d.dot(vertex(i)) > d.dot(vertex(best))) best = i;
    }
    return vertex(best);
  }

  const int type_;
  const mjtNum* const size_;
  const Eigen::Isometry3d X_FG_;
  const float* vertices_ = nullptr;
  int vertex_count_ = 0;
};

int geom_terrain_contacts(const mjModel* m, const mjData* d, mjContact* contacts, int field, int geom,
                          mjtNum margin) {
  const int id = m->geom_dataid[field];
  const mjtNum* const size = m->hfield_size + 4 * id;
  const TerrainView view{m->hfield_ncol[id],
                         m->hfield_nrow[id],
                         {2 * size[0], 2 * size[1]},
                         m->hfield_data + m->hfield_adr[id],
                         size[2]};
  const Eigen::Isometry3d X_WF = placed_geom(d, field);
  const TerrainContacts found =
      terrain_contacts(view, GeomOnTerrain(m, geom, X_WF.inverse() * placed_geom(d, geom)), margin);
  for (int i = 0; i < found.count; ++i) {
    const TerrainContact& contact = found.points[static_cast<std::size_t>(i)];
    mjContact& out = contacts[i];
    out.dist = contact.distance;
    Eigen::Map<Eigen::Vector3d>(out.pos) = X_WF * contact.p_F;
    Eigen::Map<Eigen::Vector3d>(out.frame) = X_WF.linear() * contact.normal_F;
    std::fill_n(out.frame + 3, 6, 0.0);
  }
  return found.count;
}

}  // namespace

void install_terrain_contacts() {
  for (const int type :
       {mjGEOM_SPHERE, mjGEOM_CAPSULE, mjGEOM_ELLIPSOID, mjGEOM_CYLINDER, mjGEOM_BOX, mjGEOM_MESH})
    mjCOLLISIONFUNC[mjGEOM_HFIELD][type] = &geom_terrain_contacts;
}

}  // namespace doppel
