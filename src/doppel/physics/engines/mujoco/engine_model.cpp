#include "doppel/physics/engines/mujoco/engine_model.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <iterator>
#include <map>

#include "doppel/base/math/decimals.h"
#include "doppel/base/math/mass_properties.h"
#include "doppel/base/xml/element.h"
#include "doppel/physics/mjcf/mjcf.h"
#include "doppel/robot/collision/link_pairs.h"

namespace doppel {
namespace {

// MuJoCo rejects bodies below 1e-15, and no measured quantity distinguishes these values from zero.
constexpr double kMinMass = 1e-9;     // kg
constexpr double kMinMoment = 1e-12;  // kg m^2

// Heavy enough for the engine.
MassProperties simulable(MassProperties body) {
  body.mass = std::max(body.mass, kMinMass);
  if (principal_inertia(body.I).moments.minCoeff() < kMinMoment)
    body.I += kMinMoment * Eigen::Matrix3d::Identity();
  return body;
}

// The shapes' meshes, each once.
class MeshAssets {
 public:
  std::string name_of(const SharedHull& hull) {
    const auto [found, fresh] = names_.try_emplace(hull.get(), fmt::format("~m{}", names_.size()));
    if (fresh) {
      std::string vertices;
      for (const Eigen::Vector3f& p : hull->vertices)
        fmt::format_to(std::back_inserter(vertices), "{} {} {} ", p.x(), p.y(), p.z());
      assets_.children.push_back(element("mesh", {{"name", found->second}, {"vertex", std::move(vertices)}}));
    }
    return found->second;
  }
  // MuJoCo's heights are from 0 to 1 above the geom's origin, which is at the lowest point.
  std::string name_of(const SharedField& field) {
    const auto found = std::ranges::find(fields_, field);
    const auto index = static_cast<std::size_t>(found - fields_.begin());
    const std::string name = mjcf_field_name(index);
    if (found != fields_.end()) return name;
    fields_.push_back(field);
    const auto [low, high] = std::ranges::minmax(field->heights);
    const double rise = std::max(static_cast<double>(high) - low, kLeastRise);
    assets_.children.push_back(
        element("hfield", {{"name", name},
                           {"ncol", std::to_string(field->columns)},
                           {"nrow", std::to_string(field->rows)},
                           {"size", fmt::format("{} {} {} {}", decimal(field->size.x() / 2),
                                                decimal(field->size.y() / 2), decimal(rise), kFieldBase)}}));
    return name;
  }
  XmlNode take() { return std::move(assets_); }
  [[nodiscard]] std::vector<SharedField> take_fields() { return std::move(fields_); }

 private:
  static constexpr double kLeastRise = 1e-3;  // m
  static constexpr int kFieldBase = 1;        // m, of solid below the lowest point
  std::vector<SharedField> fields_;
  std::map<const CollisionHull*, std::string> names_;
  XmlNode assets_ = element("asset");
};

constexpr double kTorsion = 0.005;  // m, MuJoCo's default; of no effect with condim 3

// Of a pair, or of a shape: friction in the tangent plane, by rotation about the normal, by rolling. Rules
// that need more than these numbers are applied to each contact (contact_rules.h).
void add_friction(XmlNode& node, const std::string& coefficient, double torsion, bool pair) {
  if (torsion > 0) add_attribute(node, "condim", "4");
  const std::string twist = decimal(torsion > 0 ? torsion : kTorsion);
  add_attribute(node, "friction",
                pair ? coefficient + " " + coefficient + " " + twist + " 0.0001 0.0001"
                     : coefficient + " " + twist + " 0.0001");
}

// The naming of one instance in the engine's document: by index over all instances.
class InstanceNaming final : public MjcfNaming {
 public:
  InstanceNaming(const ModelInstance& instance, const InstanceOffsets& offsets, MeshAssets& assets)
      : instance_(instance), model_(*instance.model), offsets_(offsets), assets_(assets) {
    lump();
  }

  [[nodiscard]] std::string body_name(int link) const override {
    return mjcf_link_name(offsets_.link + link);
  }
  [[nodiscard]] std::string joint_name(int joint, std::string_view part) const override {
    return mjcf_joint_name(offsets_.joint + joint) + std::string(part == "x" ? "" : part);
  }
  [[nodiscard]] std::optional<MassProperties> inertia(int link) const override {
    const MassProperties& body = lumped_[static_cast<std::size_t>(link)];
    return body.mass > 0 ? std::optional(simulable(body)) : std::nullopt;
  }
  // Damping, drives and stops with a stiffness are the engine's own (mujoco_step.cpp).
  [[nodiscard]] bool limits(const ModelJoint& joint) const override { return !(joint.stop_stiffness > 0); }
  void complete(const ModelJoint& joint, XmlNode& dof) const override {
    add_attribute(dof, "frictionloss", decimal(joint.friction));
  }
  void add_shapes(int link, XmlNode& body) override {
    const std::vector<CollisionShape>& shapes = instance_.shapes[static_cast<std::size_t>(link)];
    for (std::size_t i = 0; i < shapes.size(); ++i) {
      XmlNode geom = element("geom", {{"name", mjcf_shape_name(offsets_.link + link, i)}});
      std::visit([&](const auto& shape) { add_form(shape, geom); }, shapes[i].geometry);
      Pose X_LG = shapes[i].X_LS;
      if (const auto* field = std::get_if<SharedField>(&shapes[i].geometry))
        X_LG.translate(Eigen::Vector3d(0, 0, std::ranges::min((*field)->heights)));
      mjcf_place(geom, X_LG);
      add_friction(geom, decimal(shapes[i].friction.along), shapes[i].friction.torsion, false);
      body.children.push_back(std::move(geom));
    }
  }

 private:
  template <class Shape>
  void add_form(const Shape& shape, XmlNode& geom) {
    if constexpr (std::is_same_v<Shape, SharedHull>) {
      add_attribute(geom, "type", "mesh");
      add_attribute(geom, "mesh", assets_.name_of(shape));
    } else if constexpr (std::is_same_v<Shape, SharedField>) {
      add_attribute(geom, "type", "hfield");
      add_attribute(geom, "hfield", assets_.name_of(shape));
    } else {
      mjcf_size(geom, shape);
    }
  }

  // The mass of rigidly joined links is at the topmost one: MuJoCo accepts a welded body without mass.
  void lump() {
    lumped_.resize(model_.links.size());
    const std::vector<int> groups = rigid_groups(model_);
    const std::vector<Pose> X_GL = poses_in_groups(model_, groups);
    for (std::size_t i = 0; i < model_.links.size(); ++i) {
      if (!model_.links[i].inertia) continue;
      MassProperties& whole = lumped_[static_cast<std::size_t>(groups[i])];
      whole = combined(whole, transformed(*model_.links[i].inertia, X_GL[i]));
    }
  }

  const ModelInstance& instance_;
  const Model& model_;
  const InstanceOffsets& offsets_;
  MeshAssets& assets_;
  std::vector<MassProperties> lumped_;  // [links]
};

// The pairs of bodies that can touch in any configuration.
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
  [[nodiscard]] bool few() const { return count_ <= kMaxListedPairs; }
  [[nodiscard]] const std::vector<std::pair<BodyId, BodyId>>& exclusions() const { return exclusions_; }

  // With few pairs every pair of shapes is written. With many, MuJoCo searches for pairs itself and
  // needs the excluded ones: every pair is written as excluded, and the allowed ones are removed from
  // the compiled table.
  XmlNode take() {
    if (few()) return std::move(pairs_);
    XmlNode out = element("contact");
    for (std::size_t i = 0; i < exclusions_.size(); ++i) {
      out.children.push_back(element("exclude", {{"name", mjcf_exclusion_name(i)},
                                                 {"body1", body_name(exclusions_[i].first)},
                                                 {"body2", body_name(exclusions_[i].second)}}));
    }
    return out;
  }

 private:
  struct Shape {
    std::string name;
    double friction = 0, torsion = 0;
  };

  // Objects collide with each other and with the ground, even if they overlap at the start.
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
    if (body.is_ground()) return {kMjcfGround, settings_.ground_friction};
    const Friction& friction = instance(body).shapes[static_cast<std::size_t>(body.link)][index].friction;
    return {mjcf_shape_name(link(body), index), friction.along, friction.torsion};
  }

  // The larger friction of the two, as for pairs that MuJoCo finds itself.
  void add_pairs(BodyId a, BodyId b) {
    for (std::size_t i = 0; i < shape_count(a); ++i) {
      for (std::size_t k = 0; k < shape_count(b); ++k) {
        if (++count_ > kMaxListedPairs) return;
        const Shape first = shape_of(a, i), second = shape_of(b, k);
        XmlNode pair = element("pair", {{"geom1", first.name}, {"geom2", second.name}});
        add_friction(pair, decimal(std::max(first.friction, second.friction)),
                     std::max(first.torsion, second.torsion), true);
        pairs_.children.push_back(std::move(pair));
      }
    }
  }

  const WorldSettings& settings_;
  std::span<const ModelInstance> instances_;
  std::span<const InstanceOffsets> offsets_;
  std::vector<std::pair<BodyId, BodyId>> exclusions_;
  XmlNode pairs_ = element("contact");
  std::size_t count_ = 0;
};

XmlNode option_of(const WorldSettings& world, bool listed_pairs) {
  // Elliptic cones with a high impedance ratio, so that sticking contacts do not creep. With one contact of two
  // hulls instead of several, an object that stands on another walks.
  return element("option",
                 {{"timestep", decimal(to_seconds(world.step))},
                  {"gravity", decimals(world.gravity)},
                  {"integrator", world.integrator == Integrator::implicit ? "implicit" : "Euler"},
                  {"collision", listed_pairs ? "predefined" : "all"},
                  {"cone", "elliptic"},
                  {"impratio", "100"}},
                 {element("flag", {{"filterparent", "disable"}, {"multiccd", "enable"}})});
}

constexpr std::size_t kMaxTouchingShapes = 12;  // of a link at once
constexpr std::size_t kContactsOfRobot = 100, kContactsOfLooseShape = 8;

XmlNode size_of(std::span<const ModelInstance> instances) {
  const MjcfSizes sizes = sizes_of(instances);
  return element("size",
                 {{"nconmax", std::to_string(sizes.contacts)}, {"njmax", std::to_string(sizes.rows)}});
}

XmlNode defaults_of(const WorldSettings& world) {
  // Twice the step is the smallest time constant with which MuJoCo's constraints are stable.
  const double stiff = 2.0 * to_seconds(world.step);
  const std::string soft = decimal(2.5 * stiff) + " 1", hard = decimal(stiff) + " 1";
  const std::string yields = "0.95 0.99 0.001", holds = "0.9999 0.9999 0.001";
  return element(
      "default", {},
      {element(
           "geom",
           {{"contype", "1"}, {"conaffinity", "1"}, {"condim", "3"}, {"solref", soft}, {"solimp", yields}}),
       element("pair", {{"condim", "3"}, {"solref", soft}, {"solimp", yields}}),
       element("joint", {{"armature", "0"},
                         {"solreffriction", hard},
                         {"solimpfriction", holds},
                         {"solreflimit", soft},
                         {"solimplimit", yields}}),
       element("equality", {{"solref", hard}, {"solimp", holds}})});
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

MjcfSizes sizes_of(std::span<const ModelInstance> instances) {
  MjcfSizes out;
  for (const ModelInstance& instance : instances) {
    if (!instance.is_object()) ++out.robots;
    if (!instance.is_object() || instance.model->nv == 0) continue;
    for (const auto& shapes : instance.shapes) out.loose += std::min(shapes.size(), kMaxTouchingShapes);
  }
  out.robots = std::max<std::size_t>(out.robots, 1);
  out.contacts = kContactsOfRobot * out.robots + kContactsOfLooseShape * out.loose;
  out.rows = kRowsOfRobot * out.robots + kRowsOfLooseShape * out.loose;
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
std::string mjcf_field_name(std::size_t field) {
  return fmt::format("~h{}", field);
}
std::string mjcf_shape_name(int link, std::size_t shape) {
  return fmt::format("~g{}s{}", link, shape);
}

MjcfDocument write_document(const WorldSettings& settings, std::span<const ModelInstance> instances,
                            const Exclusions& exclusions) {
  const std::vector<InstanceOffsets> offsets = instance_offsets(instances);
  MeshAssets assets;
  XmlNode world = element("worldbody"), equality = element("equality");
  if (settings.ground) {
    XmlNode ground = element("geom", {{"name", kMjcfGround}, {"type", "plane"}, {"size", "0 0 1"}});
    add_friction(ground, decimal(settings.ground_friction), 0.0, false);
    world.children.push_back(std::move(ground));
  }
  for (std::size_t i = 0; i < instances.size(); ++i) {
    const Model& model = *instances[i].model;
    InstanceNaming terms(instances[i], offsets[i], assets);
    world.children.push_back(MjcfBodies(model, terms).tree(instances[i].X_WR));
    for (XmlNode& coupling : mjcf_couplings(model, terms)) equality.children.push_back(std::move(coupling));
  }
  PairWriter pairs(settings, instances, offsets, exclusions);
  const XmlNode root = element(
      "mujoco", {{"model", "doppel"}},
      {element("compiler", {{"angle", "radian"}, {"inertiafromgeom", "false"}, {"fusestatic", "false"}}),
       option_of(settings, pairs.few()), size_of(instances), defaults_of(settings), assets.take(),
       std::move(world), pairs.take(), std::move(equality)});
  return {to_xml(root), pairs.few() ? std::vector<std::pair<BodyId, BodyId>>{} : pairs.exclusions(),
          assets.take_fields()};
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
  // Line numbers refer to a text that the user never sees.
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
