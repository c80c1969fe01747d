#include "doppel/physics/engines/bullet/collision_pieces.h"

#include <BulletCollision/CollisionShapes/btBoxShape.h>
#include <BulletCollision/CollisionShapes/btCapsuleShape.h>
#include <BulletCollision/CollisionShapes/btConvexHullShape.h>
#include <BulletCollision/CollisionShapes/btConvexPolyhedron.h>
#include <BulletCollision/CollisionShapes/btCylinderShape.h>
#include <BulletCollision/CollisionShapes/btSphereShape.h>

#include <algorithm>
#include <cmath>

#include "doppel/base/core/overloaded.h"

namespace doppel {
namespace {

// The part of a line inside a convex body, as a range of the line's parameter.
struct Within {
  double from = -kInfinity, to = kInfinity;
  // Keeps the inner side of a plane: offset + rate * t <= 0.
  void cut(double offset, double rate) {
    if (rate > 0) {
      to = std::min(to, -offset / rate);
    } else if (rate < 0) {
      from = std::max(from, -offset / rate);
    } else if (offset > 0) {
      to = -kInfinity;
    }
  }
  // Keeps a t^2 + 2 b t + c <= 0.
  void cut_round(double a, double b, double c) {
    if (!(a > 0)) return cut(c, 0.0);
    const double root = b * b - a * c;
    if (root < 0) {
      to = -kInfinity;
      return;
    }
    from = std::max(from, (-b - std::sqrt(root)) / a);
    to = std::min(to, (-b + std::sqrt(root)) / a);
  }
  // The first surface in front of the start: the entry, or the exit if the start is inside.
  [[nodiscard]] double first() const {
    if (from > to || to < 0) return -1.0;
    return from >= 0 ? from : to;
  }
};

// Bullet has no ellipsoid.
class EllipsoidShape final : public btConvexInternalShape {
 public:
  explicit EllipsoidShape(const Eigen::Vector3d& radii) : radii_(to_bullet(radii)) {
    m_shapeType = CUSTOM_CONVEX_SHAPE_TYPE;
    setImplicitShapeDimensions(radii_);
  }
  [[nodiscard]] btVector3 localGetSupportingVertexWithoutMargin(const btVector3& direction) const override {
    const btVector3 stretched = direction * radii_;
    const btScalar length = stretched.length();
    return length > 0 ? btVector3(radii_ * stretched / length) : btVector3(radii_.x(), 0, 0);
  }
  void batchedUnitVectorGetSupportingVertexWithoutMargin(const btVector3* directions, btVector3* out,
                                                         int count) const override {
    for (int i = 0; i < count; ++i) out[i] = localGetSupportingVertexWithoutMargin(directions[i]);
  }
  void getAabb(const btTransform& X, btVector3& low, btVector3& high) const override {
    btVector3 half;
    for (int i = 0; i < 3; ++i) half[i] = (X.getBasis()[i] * radii_).length();
    low = X.getOrigin() - half;
    high = X.getOrigin() + half;
  }
  void calculateLocalInertia(btScalar mass, btVector3& inertia) const override {
    const btVector3 squares = radii_ * radii_ * (mass / 5);
    inertia = {squares.y() + squares.z(), squares.x() + squares.z(), squares.x() + squares.y()};
  }
  [[nodiscard]] const char* getName() const override { return "Ellipsoid"; }

 private:
  btVector3 radii_;
};

double ray_to_sphere(const Eigen::Vector3d& from, const Eigen::Vector3d& along, double radius) {
  Within within;
  within.cut_round(along.squaredNorm(), from.dot(along), from.squaredNorm() - radius * radius);
  return within.first();
}

Within within_cylinder(const Eigen::Vector3d& from, const Eigen::Vector3d& along, double radius,
                       double length) {
  Within within;
  within.cut_round(along.head<2>().squaredNorm(), from.head<2>().dot(along.head<2>()),
                   from.head<2>().squaredNorm() - radius * radius);
  within.cut(from.z() - length / 2, along.z());
  within.cut(-from.z() - length / 2, -along.z());
  return within;
}

// A cylinder and two balls: the outer surface of their union.
double ray_to_capsule(const Eigen::Vector3d& from, const Eigen::Vector3d& along, const Capsule& capsule) {
  Within whole{kInfinity, -kInfinity};
  const auto join = [&whole](const Within& part) {
    if (part.from > part.to) return;
    whole.from = std::min(whole.from, part.from);
    whole.to = std::max(whole.to, part.to);
  };
  join(within_cylinder(from, along, capsule.radius, capsule.length));
  for (const double end : {-capsule.length / 2, capsule.length / 2}) {
    const Eigen::Vector3d beside = from - end * Eigen::Vector3d::UnitZ();
    Within ball;
    ball.cut_round(along.squaredNorm(), beside.dot(along),
                   beside.squaredNorm() - capsule.radius * capsule.radius);
    join(ball);
  }
  return whole.first();
}

// Four points on the rim of a disc at height z, of which one is the lowest.
void add_rim(double radius, double z, const Eigen::Vector3d& down, std::vector<Eigen::Vector3d>& out) {
  Eigen::Vector2d lowest = down.head<2>();
  lowest = lowest.norm() > 1e-9 ? Eigen::Vector2d(lowest.normalized()) : Eigen::Vector2d::UnitX();
  const Eigen::Vector2d side(-lowest.y(), lowest.x());
  for (const Eigen::Vector2d& at : {lowest, side, Eigen::Vector2d(-lowest), Eigen::Vector2d(-side)})
    out.emplace_back(radius * at.x(), radius * at.y(), z);
}

}  // namespace

std::shared_ptr<btConvexShape> ShapeMaker::make(const CollisionShape& shape) {
  std::shared_ptr<btConvexShape> out = std::visit(
      Overloaded{
          [](const Box& box) -> std::shared_ptr<btConvexShape> {
            auto made = std::make_shared<btBoxShape>(to_bullet(box.size / 2));
            made->setMargin(0.0);
            made->initializePolyhedralFeatures();  // contacts of hulls are clipped faces instead of one point
            return made;
          },
          [](const Cylinder& cylinder) -> std::shared_ptr<btConvexShape> {
            return std::make_shared<btCylinderShapeZ>(
                btVector3(cylinder.radius, cylinder.radius, cylinder.length / 2));
          },
          [](const Capsule& capsule) -> std::shared_ptr<btConvexShape> {
            return std::make_shared<btCapsuleShapeZ>(capsule.radius, capsule.length);
          },
          [](const Sphere& sphere) -> std::shared_ptr<btConvexShape> {
            return std::make_shared<btSphereShape>(sphere.radius);
          },
          [](const Ellipsoid& ellipsoid) -> std::shared_ptr<btConvexShape> {
            return std::make_shared<EllipsoidShape>(ellipsoid.radii);
          },
          [this](const SharedHull& hull) -> std::shared_ptr<btConvexShape> {
            for (const auto& [known, made] : hulls_) {
              if (known == hull) return made;
            }
            auto made = std::make_shared<btConvexHullShape>();
            for (const Eigen::Vector3f& vertex : hull->vertices)
              made->addPoint(to_bullet(Eigen::Vector3d(vertex.cast<double>())), false);
            made->setMargin(0.0);
            made->recalcLocalAabb();
            made->initializePolyhedralFeatures();
            hulls_.emplace_back(hull, made);
            return made;
          },
          [](const SharedField&) -> std::shared_ptr<btConvexShape> { return nullptr; }},
      shape.geometry);
  // Bullet's default margin of 4 cm would enlarge hulls and round smaller shapes; spheres and capsules
  // consist of margin only.
  const int type = out->getShapeType();
  if (type != SPHERE_SHAPE_PROXYTYPE && type != CAPSULE_SHAPE_PROXYTYPE) out->setMargin(0.0);
  return out;
}

double ray_distance(const Piece& piece, const Eigen::Vector3d& from, const Eigen::Vector3d& along) {
  return std::visit(
      Overloaded{[&](const Box& box) {
                   Within within;
                   for (int i = 0; i < 3; ++i) {
                     within.cut(from[i] - box.size[i] / 2, along[i]);
                     within.cut(-from[i] - box.size[i] / 2, -along[i]);
                   }
                   return within.first();
                 },
                 [&](const Cylinder& cylinder) {
                   return within_cylinder(from, along, cylinder.radius, cylinder.length).first();
                 },
                 [&](const Capsule& capsule) { return ray_to_capsule(from, along, capsule); },
                 [&](const Sphere& sphere) { return ray_to_sphere(from, along, sphere.radius); },
                 [&](const Ellipsoid& ellipsoid) {
                   return ray_to_sphere(from.cwiseQuotient(ellipsoid.radii),
                                        along.cwiseQuotient(ellipsoid.radii), 1.0);
                 },
                 [&](const SharedHull&) {
                   Within within;
                   const auto& hull = static_cast<const btPolyhedralConvexShape&>(*piece.shape);
                   const btConvexPolyhedron& faces = *hull.getConvexPolyhedron();
                   for (int i = 0; i < faces.m_faces.size(); ++i) {
                     const btScalar* const plane = faces.m_faces[i].m_plane;
                     const Eigen::Vector3d normal(plane[0], plane[1], plane[2]);
                     within.cut(normal.dot(from) + plane[3], normal.dot(along));
                   }
                   return within.first();
                 },
                 [](const SharedField&) { return -1.0; }},
      piece.source.geometry);
}

void lowest_points(const Piece& piece, const Eigen::Vector3d& down, std::vector<Eigen::Vector3d>& out) {
  out.clear();
  std::visit(Overloaded{[&](const Box& box) {
                          for (int corner = 0; corner < 8; ++corner)
                            out.emplace_back((corner & 1 ? 0.5 : -0.5) * box.size.x(),
                                             (corner & 2 ? 0.5 : -0.5) * box.size.y(),
                                             (corner & 4 ? 0.5 : -0.5) * box.size.z());
                        },
                        [&](const Cylinder& cylinder) {
                          for (const double z : {-cylinder.length / 2, cylinder.length / 2})
                            add_rim(cylinder.radius, z, down, out);
                        },
                        [&](const Capsule& capsule) {
                          for (const double z : {-capsule.length / 2, capsule.length / 2})
                            out.push_back(z * Eigen::Vector3d::UnitZ() + capsule.radius * down);
                        },
                        [&](const Sphere& sphere) { out.push_back(sphere.radius * down); },
                        [&](const Ellipsoid& ellipsoid) {
                          const Eigen::Vector3d stretched = ellipsoid.radii.cwiseProduct(down);
                          out.push_back(ellipsoid.radii.cwiseProduct(stretched) / stretched.norm());
                        },
                        [&](const SharedHull& hull) {
                          for (const Eigen::Vector3f& vertex : hull->vertices)
                            out.push_back(vertex.cast<double>());
                        },
                        [](const SharedField&) {}},
             piece.source.geometry);
}

}  // namespace doppel
