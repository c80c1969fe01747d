#include "doppel/physics/mujoco/mjcf.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <iterator>
#include <map>

#include "doppel/kinematics/kinematics.h"
#include "doppel/math/mass_properties.h"
#include "doppel/physics/mjcf_convert.h"

namespace doppel {
namespace {

// MuJoCo refuses bodies below 1e-15; nothing that is measured can tell these from zero.
constexpr double kSmallestMass = 1e-9;     // kg
constexpr double kSmallestMoment = 1e-12;  // kg m^2

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

// The shapes' meshes, each once.
class MeshAssets {
 public:
  std::string name_of(const SharedHull& hull) {
    const auto [found, fresh] = names_.try_emplace(hull.get(), fmt::format("~m{}", names_.size()));
    if (fresh) {
      text_ += fmt::format("<mesh name=\"{}\" vertex=\"", found->second);
      for (const Eigen::Vector3f& p : hull->vertices) append(text_, "{} {} {} ", p.x(), p.y(), p.z());
      text_ += "\"/>\n";
    }
    return found->second;
  }
  [[nodiscard]] const std::string& text() const { return text_; }

 private:
  std::map<const CollisionHull*, std::string> names_;
  std::string text_;
};

struct ShapeText {
  MeshAssets& assets;
  std::string operator()(const Box& box) const {
    return fmt::format("type=\"box\" size=\"{}\"", vec(0.5 * box.size));
  }
  std::string operator()(const Cylinder& c) const {
    return fmt::format("type=\"cylinder\" size=\"{:.17g} {:.17g}\"", c.radius, 0.5 * c.length);
  }
  std::string operator()(const Capsule& c) const {
    return fmt::format("type=\"capsule\" size=\"{:.17g} {:.17g}\"", c.radius, 0.5 * c.length);
  }
  std::string operator()(const Sphere& s) const {
    return fmt::format("type=\"sphere\" size=\"{:.17g}\"", s.radius);
  }
  std::string operator()(const SharedHull& hull) const {
    return fmt::format("type=\"mesh\" mesh=\"{}\"", assets.name_of(hull));
  }
};

std::string shape_name(int link, std::size_t shape) {
  return fmt::format("~g{}s{}", link, shape);
}

// The bodies and couplings of one instance.
class InstanceWriter {
 public:
  InstanceWriter(const ModelInstance& instance, const InstanceOffsets& offsets, MeshAssets& assets)
      : instance_(instance), model_(*instance.model), offsets_(offsets), assets_(assets) {
    children_.resize(model_.links.size());
    for (std::size_t i = 0; i < model_.joints.size(); ++i)
      children_[model_.joints[i].parent_link].push_back(static_cast<int>(i));
    lump();
  }

  void write(std::string& bodies, std::string& equalities) {
    write_body(0, instance_.X_WR, -1);
    for (std::size_t i = 0; i < model_.joints.size(); ++i) write_coupling(static_cast<int>(i), equalities);
    bodies += bodies_;
  }

 private:
  [[nodiscard]] std::string joint_name(int joint) const { return mjcf_joint_name(offsets_.joint + joint); }

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
    append(bodies_, "<body name=\"{}\" {}>\n", mjcf_link_name(offsets_.link + link), place(X_PL));
    if (joint >= 0) write_joint(joint);
    if (lumped_[link].mass > 0) bodies_ += inertial(simulable(lumped_[link]));
    for (std::size_t i = 0; i < instance_.shapes[link].size(); ++i) {
      const CollisionShape& shape = instance_.shapes[link][i];
      append(bodies_, "<geom name=\"{}\" {} {} friction=\"{:.17g} 0.005 0.0001\"/>\n",
             shape_name(offsets_.link + link, i), std::visit(ShapeText{assets_}, shape.geometry),
             place(shape.X_LS), shape.friction);
    }
    for (const int child : children_[link])
      write_body(model_.joints[child].child_link, model_.joints[child].X_PJ, child);
    bodies_ += "</body>\n";
  }

  void write_joint(int index) {
    const ModelJoint& joint = model_.joints[index];
    switch (joint.type) {
      case JointType::fixed:
        return;
      case JointType::revolute:
      case JointType::continuous:
        write_dof(joint_name(index), "hinge", joint.axis, joint);
        return;
      case JointType::prismatic:
        write_dof(joint_name(index), "slide", joint.axis, joint);
        return;
      case JointType::planar: {
        const Eigen::Matrix<double, 3, 2> directions = planar_directions(joint.axis);
        write_dof(joint_name(index), "slide", directions.col(0), joint);
        write_dof(joint_name(index) + "y", "slide", directions.col(1), joint);
        write_dof(joint_name(index) + "angle", "hinge", joint.axis, joint);
        return;
      }
      case JointType::floating:
        for (int axis = 0; axis < 3; ++axis) {
          const std::string name = joint_name(index) + (axis == 0 ? "" : axis == 1 ? "y" : "z");
          append(bodies_, "<joint name=\"{}\" type=\"slide\" axis=\"{}\"/>\n", name,
                 vec(Eigen::Vector3d::Unit(axis)));
        }
        append(bodies_, "<joint name=\"{}turn\" type=\"ball\"/>\n", joint_name(index));
        return;
    }
  }

  void write_dof(const std::string& name, const char* type, const Eigen::Vector3d& axis,
                 const ModelJoint& joint) {
    // Damping, drives and stops with a stiffness are the engine's own (mujoco_step.cpp).
    append(bodies_, "<joint name=\"{}\" type=\"{}\" axis=\"{}\" frictionloss=\"{:.17g}\"", name, type,
           vec(axis), joint.friction);
    if (std::isfinite(joint.lower) && std::isfinite(joint.upper) && !(joint.stop_stiffness > 0)) {
      // MuJoCo's compiler refuses an empty range; a joint that is held in one place has a very small one.
      const double upper = std::max(joint.upper, joint.lower + 1e-6);
      append(bodies_, " limited=\"true\" range=\"{:.17g} {:.17g}\"", joint.lower, upper);
    }
    bodies_ += "/>\n";
  }

  void write_coupling(int index, std::string& equalities) const {
    const ModelJoint& joint = model_.joints[index];
    if (!joint.scalar() || !joint.mimics()) return;
    append(equalities, "<joint joint1=\"{}\" joint2=\"{}\" polycoef=\"{:.17g} {:.17g} 0 0 0\"/>\n",
           joint_name(index), joint_name(joint.mimic_leader), joint.mimic_offset, joint.mimic_multiplier);
  }

  const ModelInstance& instance_;
  const Model& model_;
  const InstanceOffsets& offsets_;
  MeshAssets& assets_;
  std::string bodies_;
  std::vector<std::vector<int>> children_;  // joints below each link
  std::vector<MassProperties> lumped_;      // [links]
};

// The pairs of bodies that may ever touch, as text for MuJoCo.
class PairWriter {
 public:
  PairWriter(const WorldSettings& settings, std::span<const ModelInstance> instances,
             std::span<const InstanceOffsets> offsets, const Exclusions& exclusions)
      : settings_(settings), instances_(instances), offsets_(offsets) {
    std::vector<BodyId> bodies;
    if (settings.ground) bodies.push_back({});
    for (std::size_t i = 0; i < instances.size(); ++i) {
      for (std::size_t link = 0; link < instances[i].shapes.size(); ++link) {
        if (!instances[i].shapes[link].empty())
          bodies.push_back({static_cast<int>(i), static_cast<int>(link)});
      }
    }
    for (std::size_t a = 0; a < bodies.size(); ++a) {
      for (std::size_t b = a + 1; b < bodies.size(); ++b) {
        const bool excluded = exclusions.contains(bodies[a], bodies[b]);
        if (!excluded) add_pairs(bodies[a], bodies[b]);
        if (may_be_excluded(bodies[a], bodies[b])) exclusions_.emplace_back(bodies[a], bodies[b]);
      }
    }
  }
  [[nodiscard]] bool few() const { return count_ <= kMostListedPairs; }
  [[nodiscard]] const std::string& pairs() const { return pairs_; }
  [[nodiscard]] const std::vector<std::pair<BodyId, BodyId>>& exclusions() const { return exclusions_; }

  // What never collides, where MuJoCo looks for pairs itself; every pair is written, and what may collide is
  // taken out of the compiled table.
  [[nodiscard]] std::string exclusion_text() const {
    std::string out;
    for (std::size_t i = 0; i < exclusions_.size(); ++i) {
      append(out, "<exclude name=\"{}\" body1=\"{}\" body2=\"{}\"/>\n", mjcf_exclusion_name(i),
             body_name(exclusions_[i].first), body_name(exclusions_[i].second));
    }
    return out;
  }

 private:
  struct Shape {
    std::string name;
    double friction;
  };

  // Objects collide with each other and with the ground, wherever they start.
  [[nodiscard]] bool may_be_excluded(BodyId a, BodyId b) const {
    const auto object = [this](BodyId body) { return body.is_ground() || instance(body).is_object(); };
    return !object(a) || !object(b);
  }
  [[nodiscard]] const ModelInstance& instance(BodyId body) const {
    return instances_[static_cast<std::size_t>(body.instance)];
  }
  [[nodiscard]] int link(BodyId body) const {
    return offsets_[static_cast<std::size_t>(body.instance)].link + body.link;
  }
  [[nodiscard]] std::string body_name(BodyId body) const {
    return body.is_ground() ? "world" : mjcf_link_name(link(body));
  }
  [[nodiscard]] std::size_t shape_count(BodyId body) const {
    return body.is_ground() ? 1 : instance(body).shapes[static_cast<std::size_t>(body.link)].size();
  }
  [[nodiscard]] Shape shape_of(BodyId body, std::size_t index) const {
    if (body.is_ground()) return {"~ground", settings_.ground_friction};
    return {shape_name(link(body), index),
            instance(body).shapes[static_cast<std::size_t>(body.link)][index].friction};
  }

  // The larger friction of the two counts, as where MuJoCo finds the pair.
  void add_pairs(BodyId a, BodyId b) {
    for (std::size_t i = 0; i < shape_count(a); ++i) {
      for (std::size_t k = 0; k < shape_count(b); ++k) {
        if (++count_ > kMostListedPairs) return;
        const Shape first = shape_of(a, i), second = shape_of(b, k);
        const double friction = std::max(first.friction, second.friction);
        append(pairs_, "<pair geom1=\"{}\" geom2=\"{}\" friction=\"{:.17g} {:.17g} 0.005 0.0001 0.0001\"/>\n",
               first.name, second.name, friction, friction);
      }
    }
  }

  const WorldSettings& settings_;
  std::span<const ModelInstance> instances_;
  std::span<const InstanceOffsets> offsets_;
  std::vector<std::pair<BodyId, BodyId>> exclusions_;
  std::string pairs_;
  std::size_t count_ = 0;
};

std::string header(const WorldSettings& world, std::span<const ModelInstance> instances, bool listed_pairs) {
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
  // Those that stand still touch nothing by themselves, and MuJoCo's memory grows with the square of njmax.
  const auto objects = static_cast<std::size_t>(std::ranges::count_if(instances, &ModelInstance::is_object));
  const auto loose = static_cast<std::size_t>(
      std::ranges::count_if(instances, [](const ModelInstance& i) { return i.is_object() && i.floating(); }));
  const std::size_t robots = std::max<std::size_t>(instances.size() - objects, 1);
  append(out, "<size nconmax=\"{}\" njmax=\"{}\"/>\n", 100 * robots + 8 * loose, 400 * robots + 24 * loose);
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

std::vector<InstanceOffsets> instance_offsets(std::span<const ModelInstance> instances) {
  std::vector<InstanceOffsets> out;
  InstanceOffsets next;
  for (const ModelInstance& instance : instances) {
    out.push_back(next);
    next.link += static_cast<int>(instance.model->links.size());
    next.joint += static_cast<int>(instance.model->joints.size());
    next.q += instance.model->nq;
    next.v += instance.model->nv;
  }
  return out;
}

std::string mjcf_link_name(int link) {
  return fmt::format("~l{}", link);
}
std::string mjcf_joint_name(int joint) {
  return fmt::format("~j{}", joint);
}
std::string mjcf_exclusion_name(std::size_t pair) {
  return fmt::format("~x{}", pair);
}

MjcfDocument write_document(const WorldSettings& settings, std::span<const ModelInstance> instances,
                            const Exclusions& exclusions) {
  const std::vector<InstanceOffsets> offsets = instance_offsets(instances);
  MeshAssets assets;
  std::string bodies, equalities;
  for (std::size_t i = 0; i < instances.size(); ++i)
    InstanceWriter(instances[i], offsets[i], assets).write(bodies, equalities);
  const PairWriter pairs(settings, instances, offsets, exclusions);
  std::string out = header(settings, instances, pairs.few());
  append(out, "<asset>\n{}</asset>\n<worldbody>\n", assets.text());
  if (settings.ground) {
    append(out, "<geom name=\"~ground\" type=\"plane\" size=\"0 0 1\" friction=\"{:.17g} 0.005 0.0001\"/>\n",
           settings.ground_friction);
  }
  append(out, "{}</worldbody>\n", bodies);
  append(out, "<contact>\n{}</contact>\n<equality>\n{}</equality>\n</mujoco>\n",
         pairs.few() ? pairs.pairs() : pairs.exclusion_text(), equalities);
  return {out, pairs.few() ? std::vector<std::pair<BodyId, BodyId>>{} : pairs.exclusions()};
}

namespace {

// The name of the link or joint with this index over all instances.
std::string name_at(std::span<const ModelInstance> instances, char kind, std::size_t index) {
  for (const ModelInstance& instance : instances) {
    const std::size_t count = kind == 'j' ? instance.model->joints.size() : instance.model->links.size();
    if (index >= count) {
      index -= count;
      continue;
    }
    if (kind == 'j') return instance.model->joints[index].name;
    return instance.is_object() ? instance.name : instance.model->links[index].name;
  }
  return "?";
}

}  // namespace

std::string in_user_terms(std::string message, std::span<const ModelInstance> instances) {
  // Numbers and lines of a text that the user never sees say nothing.
  if (const std::size_t id = message.find(", id ="); id != std::string::npos) message.resize(id);
  std::replace(message.begin(), message.end(), '\n', ' ');
  for (std::size_t at = message.find('~'); at != std::string::npos; at = message.find('~', at)) {
    std::size_t end = at + 2, index = 0;
    while (end < message.size() && std::isdigit(static_cast<unsigned char>(message[end])) != 0) {
      index = 10 * index + static_cast<std::size_t>(message[end++] - '0');
    }
    const char kind = at + 1 < message.size() ? message[at + 1] : ' ';
    const bool known = kind == 'l' || kind == 'g' || kind == 'j';
    const std::string name = "'" + (known ? name_at(instances, kind, index) : "?") + "'";
    message.replace(at, std::min(end, message.size()) - at, name);
    at += name.size();
  }
  return message;
}

}  // namespace doppel
