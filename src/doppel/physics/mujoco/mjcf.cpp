#include "doppel/physics/mujoco/mjcf.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <iterator>

#include "doppel/kinematics/kinematics.h"
#include "doppel/math/mass_properties.h"
#include "doppel/physics/mujoco/convert.h"

namespace doppel {
namespace {

// MuJoCo refuses bodies below 1e-15; nothing that is measured can tell these from zero.
constexpr double kSmallestMass = 1e-9;     // kg
constexpr double kSmallestMoment = 1e-12;  // kg m^2
constexpr double kRobotFriction = 0.8;     // Coulomb, where no <gazebo> mu1 says otherwise

template <typename... Arguments>
void append(std::string& out, fmt::format_string<Arguments...> format, Arguments&&... arguments) {
  fmt::format_to(std::back_inserter(out), format, std::forward<Arguments>(arguments)...);
}

std::string vec(const Eigen::Vector3d& v) {
  return fmt::format("{:.17g} {:.17g} {:.17g}", v.x(), v.y(), v.z());
}

std::string quat(const Eigen::Matrix3d& R) {
  double q[4];
  quaternion_to_mujoco(Eigen::Quaterniond(R), q);
  return fmt::format("{:.17g} {:.17g} {:.17g} {:.17g}", q[0], q[1], q[2], q[3]);
}

std::string place(const Pose& X) {
  return fmt::format("pos=\"{}\" quat=\"{}\"", vec(X.translation()), quat(X.linear()));
}

std::string inertial(const MassProperties& body) {
  const PrincipalInertia principal = principal_inertia(body.I);
  return fmt::format("<inertial pos=\"{}\" quat=\"{}\" mass=\"{:.17g}\" diaginertia=\"{}\"/>\n",
                     vec(body.com), quat(principal.axes), body.mass, vec(principal.moments));
}

// Heavy enough for the engine.
MassProperties simulable(MassProperties body) {
  body.mass = std::max(body.mass, kSmallestMass);
  if (principal_inertia(body.I).moments.minCoeff() < kSmallestMoment)
    body.I += kSmallestMoment * Eigen::Matrix3d::Identity();
  return body;
}

// The vertices as an asset, unless they are one already; returns the asset's name.
std::string mesh_asset(const CollisionMesh& mesh, std::string& assets) {
  const std::string name = fmt::format("~m{}", mesh.index);
  const std::string start = fmt::format("<mesh name=\"{}\" vertex=\"", name);
  if (assets.find(start) != std::string::npos) return name;
  assets += start;
  for (const Eigen::Vector3f& p : mesh.vertices) append(assets, "{} {} {} ", p.x(), p.y(), p.z());
  assets += "\"/>\n";
  return name;
}

bool positive(const Geometry& geometry) {
  if (const auto* box = std::get_if<Box>(&geometry)) return box->size.minCoeff() > 0;
  if (const auto* c = std::get_if<Cylinder>(&geometry)) return c->radius > 0 && c->length > 0;
  if (const auto* c = std::get_if<Capsule>(&geometry)) return c->radius > 0 && c->length > 0;
  if (const auto* s = std::get_if<Sphere>(&geometry)) return s->radius > 0;
  return true;
}

// One <geom>, or nothing where there is nothing to collide with.
std::string geom(const std::string& name, const Geometry& geometry, const CollisionMesh* mesh, const Pose& X,
                 double friction, std::string& assets) {
  std::string shape;
  Pose X_shape = X;
  if (const auto* box = std::get_if<Box>(&geometry)) {
    shape = fmt::format("type=\"box\" size=\"{}\"", vec(0.5 * box->size));
  } else if (const auto* c = std::get_if<Cylinder>(&geometry)) {
    shape = fmt::format("type=\"cylinder\" size=\"{:.17g} {:.17g}\"", c->radius, 0.5 * c->length);
  } else if (const auto* k = std::get_if<Capsule>(&geometry)) {
    shape = fmt::format("type=\"capsule\" size=\"{:.17g} {:.17g}\"", k->radius, 0.5 * k->length);
  } else if (const auto* s = std::get_if<Sphere>(&geometry)) {
    shape = fmt::format("type=\"sphere\" size=\"{:.17g}\"", s->radius);
  } else if (mesh == nullptr) {
    return "";
  } else if (mesh->vertices.empty()) {
    shape = fmt::format("type=\"box\" size=\"{}\"", vec(0.5 * mesh->box_size));
    X_shape = X * mesh->X_GB;
  } else {
    shape = fmt::format("type=\"mesh\" mesh=\"{}\"", mesh_asset(*mesh, assets));
  }
  return fmt::format("<geom name=\"{}\" {} {} friction=\"{:.17g} 0.005 0.0001\"/>\n", name, shape,
                     place(X_shape), friction);
}

class RobotWriter {
 public:
  RobotWriter(const RobotDescription& robot, const Model& model, const World& world, CollisionMeshes& meshes,
              Diagnostics& diagnostics)
      : robot_(robot), model_(model), world_(world), meshes_(meshes), diagnostics_(diagnostics) {
    out_.has_shape.assign(model.links.size(), false);
    out_.shapes.assign(model.links.size(), 0);
    out_.friction.assign(model.links.size(), kRobotFriction);
    children_.resize(model.links.size());
    for (std::size_t i = 0; i < model.joints.size(); ++i) {
      children_[model.joints[i].parent_link].push_back(static_cast<int>(i));
    }
    lump();
  }

  RobotMjcf write() {
    write_body(0, world_.X_WR, -1);
    for (std::size_t i = 0; i < model_.joints.size(); ++i) write_coupling(static_cast<int>(i));
    out_.pairs = link_pairs(model_, out_.has_shape);
    const std::vector<int> groups = rigid_groups(model_);
    for (std::size_t i = 0; i < groups.size(); ++i) {
      if (out_.has_shape[i] && groups[i] != 0) out_.movable_shapes.push_back(static_cast<int>(i));
    }
    return std::move(out_);
  }

 private:
  // MuJoCo wants mass on every body that moves itself; a body welded to it may be without. So all that is
  // rigidly joined is weighed at its topmost link.
  void lump() {
    lumped_.resize(model_.links.size());
    const std::vector<int> groups = rigid_groups(model_);
    std::vector<Pose> X_GL(model_.links.size(), Pose::Identity());  // link in its group's topmost link
    for (std::size_t i = 0; i < model_.links.size(); ++i) {
      const ModelLink& link = model_.links[i];
      const auto at = static_cast<std::size_t>(groups[i]);
      if (at != i) {
        const ModelJoint& joint = model_.joints[link.joint];
        X_GL[i] = X_GL[joint.parent_link] * joint.X_PJ;
      }
      if (link.inertia) lumped_[at] = combined(lumped_[at], transformed(*link.inertia, X_GL[i]));
    }
  }

  void write_body(int link, const Pose& X_PL, int joint) {
    append(out_.bodies, "<body name=\"{}\" {}>\n", mjcf_link_name(link), place(X_PL));
    if (joint >= 0) write_joint(joint);
    if (lumped_[link].mass > 0) out_.bodies += inertial(simulable(lumped_[link]));
    write_shapes(link);
    for (const int child : children_[link]) {
      write_body(model_.joints[child].child_link, model_.joints[child].X_PJ, child);
    }
    out_.bodies += "</body>\n";
  }

  void write_joint(int index) {
    const ModelJoint& joint = model_.joints[index];
    switch (joint.type) {
      case JointType::fixed:
        return;
      case JointType::revolute:
      case JointType::continuous:
        write_dof(mjcf_joint_name(index), "hinge", joint.axis, joint);
        return;
      case JointType::prismatic:
        write_dof(mjcf_joint_name(index), "slide", joint.axis, joint);
        return;
      case JointType::planar: {
        const Eigen::Matrix<double, 3, 2> directions = planar_directions(joint.axis);
        write_dof(mjcf_joint_name(index), "slide", directions.col(0), joint);
        write_dof(mjcf_joint_name(index) + "y", "slide", directions.col(1), joint);
        write_dof(mjcf_joint_name(index) + "angle", "hinge", joint.axis, joint);
        return;
      }
      case JointType::floating:
        for (int axis = 0; axis < 3; ++axis) {
          const std::string name = mjcf_joint_name(index) + (axis == 0 ? "" : axis == 1 ? "y" : "z");
          append(out_.bodies, "<joint name=\"{}\" type=\"slide\" axis=\"{}\"/>\n", name,
                 vec(Eigen::Vector3d::Unit(axis)));
        }
        append(out_.bodies, "<joint name=\"{}turn\" type=\"ball\"/>\n", mjcf_joint_name(index));
        return;
    }
  }

  void write_dof(const std::string& name, const char* type, const Eigen::Vector3d& axis,
                 const ModelJoint& joint) {
    // Damping, drives and stops with a stiffness are the engine's own (mujoco_step.cpp).
    append(out_.bodies, "<joint name=\"{}\" type=\"{}\" axis=\"{}\" frictionloss=\"{:.17g}\"", name, type,
           vec(axis), joint.friction);
    if (std::isfinite(joint.lower) && std::isfinite(joint.upper) && !(joint.stop_stiffness > 0)) {
      // MuJoCo's compiler refuses an empty range; a joint that is held in one place has a very small one.
      const double upper = std::max(joint.upper, joint.lower + 1e-6);
      append(out_.bodies, " limited=\"true\" range=\"{:.17g} {:.17g}\"", joint.lower, upper);
    }
    out_.bodies += "/>\n";
  }

  void write_shapes(int index) {
    const std::string& name = model_.links[index].name;
    const auto link = std::find_if(robot_.links.begin(), robot_.links.end(),
                                   [&](const Link& candidate) { return candidate.name == name; });
    if (link == robot_.links.end()) return;  // the world that a floating base was given
    double friction = kRobotFriction;
    for (const GazeboExtension& extension : robot_.gazebo) {
      if (extension.reference == name && extension.mu1) friction = *extension.mu1;
    }
    for (const Collision& collision : link->collisions) {
      const std::string text =
          shape_of(*link, collision, mjcf_shape_name(index, out_.shapes[index]), friction);
      out_.bodies += text;
      if (text.empty()) continue;
      out_.has_shape[index] = true;
      ++out_.shapes[index];
      out_.friction[index] = friction;
    }
  }

  std::string shape_of(const Link& link, const Collision& collision, const std::string& name,
                       double friction) {
    if (!positive(collision.geometry)) {
      diagnostics_.warning(
          "physics.empty_shape", collision.source,
          fmt::format("a collision shape of link '{}' has no size and collides with nothing", link.name),
          "write positive sizes, m");
      return "";
    }
    const CollisionMesh* mesh = nullptr;
    if (const auto* geometry = std::get_if<MeshGeometry>(&collision.geometry)) {
      try {
        mesh = meshes_.find(*geometry, fmt::format("link '{}'", link.name), collision.source, diagnostics_);
      } catch (const InputError& error) {
        for (Diagnostic diagnostic : error.diagnostics()) {
          diagnostic.severity = Severity::warning;
          diagnostic.message += fmt::format("; this shape of link '{}' collides with nothing", link.name);
          if (!diagnostic.where.known()) diagnostic.where = collision.source;
          diagnostics_.add(std::move(diagnostic));
        }
      }
    }
    return geom(name, collision.geometry, mesh, collision.origin.pose(), friction, out_.assets);
  }

  void write_coupling(int index) {
    const ModelJoint& joint = model_.joints[index];
    if (!joint.scalar()) return;
    if (joint.mimics()) {
      append(out_.equalities, "<joint joint1=\"{}\" joint2=\"{}\" polycoef=\"{:.17g} {:.17g} 0 0 0\"/>\n",
             mjcf_joint_name(index), mjcf_joint_name(joint.mimic_leader), joint.mimic_offset,
             joint.mimic_multiplier);
      return;
    }
    out_.driven.push_back(index);
  }

  const RobotDescription& robot_;
  const Model& model_;
  const World& world_;
  CollisionMeshes& meshes_;
  Diagnostics& diagnostics_;
  RobotMjcf out_;
  std::vector<std::vector<int>> children_;  // joints below each link
  std::vector<MassProperties> lumped_;      // [links]
};

// The principal moments of a body of unit mass with the shape of `geometry` (a mesh: of its box).
MassProperties object_inertia(const WorldObject& object, const CollisionMesh* mesh) {
  Eigen::Vector3d size = Eigen::Vector3d::Ones();  // of the box with about the same inertia
  MassProperties body{object.mass, Eigen::Vector3d::Zero(), Eigen::Matrix3d::Zero()};
  if (const auto* box = std::get_if<Box>(&object.shape)) {
    size = box->size;
  } else if (const auto* c = std::get_if<Cylinder>(&object.shape)) {
    size = {std::sqrt(3.0) * c->radius, std::sqrt(3.0) * c->radius, c->length};
  } else if (const auto* k = std::get_if<Capsule>(&object.shape)) {
    size = {std::sqrt(3.0) * k->radius, std::sqrt(3.0) * k->radius, k->length + 4.0 / 3.0 * k->radius};
  } else if (const auto* s = std::get_if<Sphere>(&object.shape)) {
    size = Eigen::Vector3d::Constant(std::sqrt(2.4) * s->radius);
  } else if (mesh != nullptr && mesh->vertices.empty()) {
    size = mesh->box_size;
  } else if (mesh != nullptr) {
    Eigen::AlignedBox3f bounds;
    for (const Eigen::Vector3f& p : mesh->vertices) bounds.extend(p);
    size = bounds.sizes().cast<double>();
    body.com = bounds.center().cast<double>();
  }
  const Eigen::Vector3d squares = size.cwiseAbs2() * (object.mass / 12.0);
  body.I.diagonal() << squares.y() + squares.z(), squares.x() + squares.z(), squares.x() + squares.y();
  return body;
}

void write_object(const WorldObject& object, int index, CollisionMeshes& meshes, Diagnostics& diagnostics,
                  std::string& assets, std::string& bodies) {
  const CollisionMesh* mesh = nullptr;
  if (const auto* geometry = std::get_if<MeshGeometry>(&object.shape)) {
    mesh = meshes.find(*geometry, fmt::format("object '{}'", object.name), object.source, diagnostics);
  }
  if (!positive(object.shape)) {
    throw InputError("world.size", object.source, fmt::format("object '{}' has no size", object.name),
                     "write positive sizes, m");
  }
  if (!object.X_WO.matrix().allFinite() || !object.X_OS.matrix().allFinite() || !std::isfinite(object.mass) ||
      !std::isfinite(object.friction)) {
    throw InputError(
        "world.not_finite", object.source,
        fmt::format("the pose, mass or friction of object '{}' is not a finite number", object.name));
  }
  append(bodies, "<body name=\"{}\" {}>\n", mjcf_object_name(index), place(object.X_WO));
  if (object.mass > 0)
    bodies += "<freejoint/>\n" + inertial(transformed(object_inertia(object, mesh), object.X_OS));
  bodies += geom(mjcf_object_shape_name(index), object.shape, mesh, object.X_OS, object.friction, assets) +
            "</body>\n";
}

// What never collides, where MuJoCo looks for pairs itself; it is told of every pair, and what may collide is
// taken out of the compiled table.
std::string exclusions(const RobotMjcf& robot, const World& world) {
  std::string out;
  for (std::size_t i = 0; i < robot.pairs.size(); ++i) {
    append(out, "<exclude name=\"{}\" body1=\"{}\" body2=\"{}\"/>\n", mjcf_exclusion_name(i),
           mjcf_link_name(robot.pairs[i].a), mjcf_link_name(robot.pairs[i].b));
  }
  for (std::size_t i = 0; i < robot.movable_shapes.size(); ++i) {
    for (int object = -1; object < static_cast<int>(world.objects.size()); ++object) {
      append(out, "<exclude name=\"{}\" body1=\"{}\" body2=\"{}\"/>\n", mjcf_surrounding_name(i, object),
             object < 0 ? "world" : mjcf_object_name(object), mjcf_link_name(robot.movable_shapes[i]));
    }
  }
  return out;
}

// Every two shapes that may ever touch, as MuJoCo would find them.
class PairWriter {
 public:
  PairWriter(const RobotMjcf& robot, const World& world) : robot_(robot), world_(world) {
    for (const LinkPair& pair : robot.pairs) {
      if (pair.reason.empty()) add_links(pair.a, pair.b);
    }
    const int objects = static_cast<int>(world.objects.size());
    for (const int link : robot.movable_shapes) {
      for (int object = world.ground ? -1 : 0; object < objects; ++object)
        add_link_and(link, shape_of(object));
    }
    for (int i = 0; i < objects; ++i) add_object(i);
  }
  [[nodiscard]] std::size_t count() const { return count_; }
  [[nodiscard]] const std::string& text() const { return text_; }

 private:
  [[nodiscard]] bool loose(int object) const {
    return world_.objects[static_cast<std::size_t>(object)].mass > 0;
  }

  struct Shape {
    std::string name;
    double friction;
  };
  [[nodiscard]] Shape shape_of(int object) const {
    if (object < 0) return {"~ground", world_.ground_friction};
    return {mjcf_object_shape_name(object), world_.objects[static_cast<std::size_t>(object)].friction};
  }
  [[nodiscard]] Shape shape_of(int link, int shape) const {
    return {mjcf_shape_name(link, shape), robot_.friction[static_cast<std::size_t>(link)]};
  }

  // The larger friction of the two counts, as where MuJoCo finds the pair.
  void add(const Shape& a, const Shape& b) {
    if (++count_ > kMostListedPairs) return;
    const double friction = std::max(a.friction, b.friction);
    append(text_, "<pair geom1=\"{}\" geom2=\"{}\" friction=\"{:.17g} {:.17g} 0.005 0.0001 0.0001\"/>\n",
           a.name, b.name, friction, friction);
  }
  void add_link_and(int link, const Shape& other) {
    for (int shape = 0; shape < robot_.shapes[static_cast<std::size_t>(link)]; ++shape)
      add(other, shape_of(link, shape));
  }
  void add_links(int a, int b) {
    for (int shape = 0; shape < robot_.shapes[static_cast<std::size_t>(a)]; ++shape)
      add_link_and(b, shape_of(a, shape));
  }
  // With the ground, the objects before it, and links that are fixed to the world.
  void add_object(int object) {
    if (world_.ground && loose(object)) add(shape_of(-1), shape_of(object));
    for (int before = 0; before < object; ++before) {
      if (loose(object) || loose(before)) add(shape_of(before), shape_of(object));
    }
    for (std::size_t link = 0; loose(object) && link < robot_.shapes.size(); ++link) {
      const auto& movable = robot_.movable_shapes;
      if (std::find(movable.begin(), movable.end(), static_cast<int>(link)) == movable.end())
        add_link_and(static_cast<int>(link), shape_of(object));
    }
  }

  const RobotMjcf& robot_;
  const World& world_;
  std::string text_;
  std::size_t count_ = 0;
};

std::string header(const World& world, bool listed_pairs) {
  const double step = to_seconds(world.step);
  // Twice the step is the stiffest that MuJoCo's constraints stay stable with.
  const double stiff = 2.0 * step;
  std::string out = "<mujoco model=\"doppel\">\n";
  out += "<compiler angle=\"radian\" inertiafromgeom=\"false\" fusestatic=\"false\"/>\n";
  // Elliptic cones with a high impedance ratio: what sticks does not creep.
  append(out,
         "<option timestep=\"{:.17g}\" gravity=\"{}\" integrator=\"{}\" collision=\"{}\" "
         "cone=\"elliptic\" impratio=\"100\">"
         "<flag filterparent=\"disable\"/></option>\n",
         step, vec(world.gravity), world.integrator == Integrator::implicit ? "implicit" : "Euler",
         listed_pairs ? "predefined" : "all");
  const std::size_t loose = static_cast<std::size_t>(std::count_if(
      world.objects.begin(), world.objects.end(), [](const WorldObject& o) { return o.mass > 0; }));
  append(out, "<size nconmax=\"{}\" njmax=\"{}\"/>\n", 100 + 8 * loose, 400 + 24 * loose);
  append(out,
         "<default><geom contype=\"1\" conaffinity=\"1\" condim=\"3\" solref=\"{0:.17g} 1\" solimp=\"0.95 "
         "0.99 0.001\"/><pair condim=\"3\" solref=\"{0:.17g} 1\" solimp=\"0.95 0.99 0.001\"/>"
         "<joint armature=\"0\" solreffriction=\"{1:.17g} 1\" solimpfriction=\"0.9999 0.9999 0.001\" "
         "solreflimit=\"{0:.17g} 1\" solimplimit=\"0.95 0.99 0.001\"/>"
         "<equality solref=\"{1:.17g} 1\" solimp=\"0.9999 0.9999 0.001\"/></default>\n",
         2.5 * stiff, stiff);
  return out;
}

}  // namespace

std::string mjcf_link_name(int link) {
  return fmt::format("~l{}", link);
}
std::string mjcf_joint_name(int joint) {
  return fmt::format("~j{}", joint);
}
std::string mjcf_object_name(int object) {
  return fmt::format("~o{}", object);
}
std::string mjcf_shape_name(int link, int shape) {
  return fmt::format("~g{}s{}", link, shape);
}
std::string mjcf_object_shape_name(int object) {
  return fmt::format("~h{}", object);
}
std::string mjcf_exclusion_name(std::size_t pair) {
  return fmt::format("~x{}", pair);
}
std::string mjcf_surrounding_name(std::size_t shape, int object) {
  return fmt::format("~s{}o{}", shape, object);
}

RobotMjcf write_robot(const RobotDescription& robot, const Model& model, const World& world,
                      CollisionMeshes& meshes, Diagnostics& diagnostics) {
  return RobotWriter(robot, model, world, meshes, diagnostics).write();
}

std::string write_document(const RobotMjcf& robot, const World& world, CollisionMeshes& meshes,
                           Diagnostics& diagnostics) {
  std::string assets = robot.assets, objects;
  for (std::size_t i = 0; i < world.objects.size(); ++i) {
    write_object(world.objects[i], static_cast<int>(i), meshes, diagnostics, assets, objects);
  }
  const PairWriter pairs(robot, world);
  const bool listed = pairs.count() <= kMostListedPairs;
  std::string out = header(world, listed);
  append(out, "<asset>\n{}</asset>\n<worldbody>\n", assets);
  if (world.ground) {
    append(out, "<geom name=\"~ground\" type=\"plane\" size=\"0 0 1\" friction=\"{:.17g} 0.005 0.0001\"/>\n",
           world.ground_friction);
  }
  append(out, "{}{}</worldbody>\n", robot.bodies, objects);
  append(out, "<contact>\n{}</contact>\n<equality>\n{}</equality>\n</mujoco>\n",
         listed ? pairs.text() : exclusions(robot, world), robot.equalities);
  return out;
}

std::string in_user_terms(std::string message, const Model& model, const World& world) {
  // Numbers and lines of a text that the user never sees say nothing.
  if (const std::size_t id = message.find(", id ="); id != std::string::npos) message.resize(id);
  std::replace(message.begin(), message.end(), '\n', ' ');
  for (std::size_t at = message.find('~'); at != std::string::npos; at = message.find('~', at)) {
    std::size_t end = at + 2, index = 0;
    while (end < message.size() && std::isdigit(static_cast<unsigned char>(message[end])) != 0) {
      index = 10 * index + static_cast<std::size_t>(message[end++] - '0');
    }
    const char kind = at + 1 < message.size() ? message[at + 1] : ' ';
    std::string name = "?";
    if (kind == 'l' && index < model.links.size()) name = model.links[index].name;
    if (kind == 'j' && index < model.joints.size()) name = model.joints[index].name;
    if (kind == 'o' && index < world.objects.size()) name = world.objects[index].name;
    name = "'" + name + "'";
    message.replace(at, std::min(end, message.size()) - at, name);
    at += name.size();
  }
  return message;
}

}  // namespace doppel
