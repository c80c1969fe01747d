#include "doppel/scenario/sdf/detail/sdf_trees.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <deque>
#include <numbers>

#include "doppel/base/xml/element.h"
#include "doppel/description/gazebo/simulator_plugins.h"
#include "doppel/scenario/sdf/detail/sdf_labels.h"

namespace doppel::sdf {
namespace {

constexpr const char* kWorldLink = "world";
constexpr int kMaxJointsInChain = 500;  // algorithms on the tree are recursive

// True if the twin reads a plugin of a model.
bool is_read(const std::string& filename, const std::string& name) {
  return find_attachment_plugin(filename, name) || drives_base(filename, name) ||
         find_joint_plugin(filename, name) || is_sensor_plugin(filename) || is_label_plugin(filename, name);
}

// The replacement of a plugin that is not loaded, if there is one.
std::string replacement_of(const std::string& filename) {
  static constexpr std::array<std::pair<std::string_view, const char*>, 4> kInstead{
      {{"pose-publisher", "poses are published on /tf and /doppel/objects"},
       {"odometry-publisher", "the true pose of a driven model is on ground_truth/odom"},
       {"wheel-slip", "write <slip1> and <slip2> in the <friction> of the wheels"},
       {"triggered-publisher", "a program can publish what depends on another topic"}}};
  for (const auto& [part, instead] : kInstead) {
    if (filename.find(part) != std::string::npos) return instead;
  }
  return "plugins of SDF are kept, but not loaded";
}

Origin placed(const Pose& X, const SourceLocation& where) {
  return {X.translation(), rpy_from_rotation(X.linear()), where};
}

}  // namespace

std::vector<SdfModel> Trees::build() {
  for (Item& item : world_.items) {
    if (item.kind != Item::Kind::model) continue;
    Model model;
    model.item = &item;
    model.X = frames_.pose(world_, item);
    if (const auto moved = state_.models.find(item.name); moved != state_.models.end())
      model.X = moved->second;
    models_.push_back(std::move(model));
    if (item.urdf == nullptr)
      collect(*item.scope, "", static_cast<int>(models_.size()) - 1, models_.back().X);
  }
  for (std::size_t i = 0; i < models_.size(); ++i) {
    Model& model = models_[i];
    if (const LinkRef root = frames_.canonical(*model.item->scope); root.found) model.canonical = flat(root);
    if (model.links.empty() && model.item->urdf == nullptr)
      elements_.without_effect(model.item->node->where, fmt::format("the model '{}'", model.item->name),
                               "it has no links");
  }
  for (std::size_t i = 0; i < models_.size(); ++i) {
    // Joints are collected after all links, because they may lead to any of them.
    const auto each = [&](const auto& self, Scope& scope, const std::string& prefix, const Pose& X) -> void {
      for (Item& item : scope.items) {
        if (item.kind == Item::Kind::joint) collect_joint(scope, item, prefix, X);
        if (item.scope != nullptr)
          self(self, *item.scope, prefix + item.name + "::", X * frames_.pose(scope, item));
      }
    };
    if (models_[i].item->urdf == nullptr) each(each, *models_[i].item->scope, "", models_[i].X);
  }
  for (Item& item : world_.items) {
    if (item.kind == Item::Kind::joint) collect_joint(world_, item, "", Pose::Identity());
  }
  elements_.diagnostics.throw_if_errors();
  hold_nested();
  connect();
  std::vector<SdfModel> out;
  for (const Model& model : models_) {
    if (model.item->urdf != nullptr) out.push_back(build_urdf(model));
  }
  std::map<int, std::vector<int>> groups;
  std::vector<int> order;  // of the groups, by their first link
  for (int i = 0; i < static_cast<int>(links_.size()); ++i) {
    std::vector<int>& members = groups[component(i)];
    if (members.empty()) order.push_back(component(i));
    members.push_back(i);
  }
  for (const int group : order) out.push_back(build_tree(groups[group]));
  return out;
}

void Trees::collect(Scope& scope, const std::string& prefix, int model, const Pose& X) {
  for (Item& item : scope.items) {
    if (item.kind == Item::Kind::link) {
      const int index = static_cast<int>(links_.size());
      FlatLink link{&scope, &item, prefix + item.name, model, X * frames_.pose(scope, item)};
      Model& owner = models_[static_cast<std::size_t>(model)];
      owner.links.push_back(index);
      owner.by_name[link.name] = index;
      index_[&item] = index;
      links_.push_back(std::move(link));
    } else if (item.scope != nullptr && item.urdf == nullptr) {
      const std::size_t before = links_.size();
      collect(*item.scope, prefix + item.name + "::", model, X * frames_.pose(scope, item));
      if (!item.scope->is_static) continue;
      for (std::size_t i = before; i < links_.size(); ++i) links_[i].held = true;
    }
  }
}

// A model around an <include> of a static one, as many worlds write it, is static itself.
void Trees::hold_nested() {
  for (const Model& model : models_) {
    const auto held = [this](int link) { return links_[static_cast<std::size_t>(link)].held; };
    const auto count = std::count_if(model.links.begin(), model.links.end(), held);
    if (count == 0 || model.item->scope->is_static) continue;
    if (static_cast<std::size_t>(count) == model.links.size()) {
      model.item->scope->is_static = true;
    } else {
      elements_.without_effect(model.item->node->where, "<static> of a nested model",
                               fmt::format("other links of '{}' move", model.item->name));
    }
  }
}

int Trees::flat(const LinkRef& ref) const {
  const auto found = index_.find(ref.link);
  return found == index_.end() ? -1 : found->second;
}

void Trees::collect_joint(Scope& scope, Item& item, const std::string& prefix, const Pose& X) {
  const SourceLocation& where = item.node->where;
  const LinkRef parent = frames_.link(scope, item.parent, item.base, where);
  const LinkRef child = frames_.link(scope, item.child, item.base, where);
  if (!parent.found || !child.found) return;
  FlatJoint joint;
  joint.scope = &scope;
  joint.item = &item;
  joint.name = prefix + item.name;
  joint.parent = flat(parent);
  joint.child = flat(child);
  joint.X = X * frames_.pose(scope, item);
  if (joint.parent == joint.child) {
    elements_.diagnostics.warning(
        "sdf.joint_ends", where,
        fmt::format("the joint '{}' connects '{}' with itself; it is left out", joint.name, item.child),
        "name two links");
    return;
  }
  joints_.push_back(std::move(joint));
}

int Trees::component(int link) {
  const auto up = [this](int at) -> int& { return group_[static_cast<std::size_t>(at)]; };
  while (up(link) != link) link = up(link) = up(up(link));
  return link;
}

void Trees::connect() {
  group_.resize(links_.size());
  joints_of_.resize(links_.size());
  for (std::size_t i = 0; i < group_.size(); ++i) group_[i] = static_cast<int>(i);
  const auto join = [&](int a, int b) {
    const int one = component(a), other = component(b);
    group_[static_cast<std::size_t>(std::max(one, other))] = std::min(one, other);
  };
  for (const Model& model : models_) {
    if (!model.item->scope->is_static) continue;
    for (const int link : model.links) join(model.links.front(), link);
  }
  for (std::size_t i = 0; i < joints_.size(); ++i) {
    const FlatJoint& joint = joints_[i];
    if (joint.is_gearbox()) continue;  // it carries nothing
    for (const int end : {joint.parent, joint.child}) {
      if (end >= 0) joints_of_[static_cast<std::size_t>(end)].push_back(static_cast<int>(i));
    }
    if (joint.parent >= 0 && joint.child >= 0) join(joint.parent, joint.child);
  }
}

SdfModel Trees::build_urdf(const Model& model) {
  SdfModel out;
  out.name = model.item->name;
  out.description = model.item->urdf;
  out.is_static = model.item->scope->is_static;
  const bool has_world = out.description->find_link(kWorldLink) != nullptr;
  out.base = out.is_static || has_world ? BaseKind::fixed : BaseKind::floating;
  out.X_WR = model.X;
  out.source = model.item->node->where;
  return out;
}

std::string Trees::name_in(const Tree& tree, int link) const {
  const FlatLink& flat = links_[static_cast<std::size_t>(link)];
  if (flat.model == tree.primary) return flat.name;
  return models_[static_cast<std::size_t>(flat.model)].item->name + "::" + flat.name;
}

// A link, or -1 for a link "world" above all links.
int Trees::choose_root(const std::vector<int>& members, Tree& tree) {
  const auto set_primary = [&](int link) { tree.primary = links_[static_cast<std::size_t>(link)].model; };
  const auto contains = [&](int link) {
    return std::find(members.begin(), members.end(), link) != members.end();
  };
  set_primary(members.front());
  for (const int link : members) {
    if (!is_static(link)) continue;
    set_primary(link);
    tree.out.is_static = true;
    tree.out.base = BaseKind::fixed;
    const int canonical = models_[static_cast<std::size_t>(tree.primary)].canonical;
    return canonical >= 0 ? canonical : link;
  }
  int count = 0;
  FlatJoint* only = nullptr;
  for (FlatJoint& joint : joints_) {
    const int link = joint.parent < 0 ? joint.child : joint.child < 0 ? joint.parent : -1;
    if (link < 0 || !contains(link)) continue;
    ++count;
    only = &joint;
  }
  if (count > 0) {
    tree.out.base = BaseKind::fixed;
    const int link = std::max(only->parent, only->child);
    if (count == 1 && Elements::attribute(*only->item->node, "type") == "fixed") {
      only->used = true;
      return link;
    }
    tree.world_root = true;
    return -1;
  }
  const int canonical = models_[static_cast<std::size_t>(tree.primary)].canonical;
  return canonical >= 0 && contains(canonical) ? canonical : members.front();
}

SdfModel Trees::build_tree(const std::vector<int>& members) {
  Tree tree;
  tree.group = component(members.front());
  const int root = choose_root(members, tree);
  Item& model = *models_[static_cast<std::size_t>(tree.primary)].item;
  const int canonical = models_[static_cast<std::size_t>(tree.primary)].canonical;
  const bool whole = canonical < 0 || std::find(members.begin(), members.end(), canonical) != members.end();
  const int first = root < 0 ? members.front() : root;
  tree.out.name = whole ? model.name : model.name + "::" + links_[static_cast<std::size_t>(first)].name;
  tree.out.source = model.node->where;
  tree.out.self_collide = model.scope->self_collide;
  tree.robot->name = tree.out.name;
  tree.robot->source = model.node->where;
  if (tree.world_root) tree.robot->links.push_back({kWorldLink, {}, {}, {}, model.node->where});
  place(tree, root);
  grow(tree, root);
  close_loops(members, tree);
  couple(tree);
  set_positions(tree);
  if (whole) add_extras(tree);
  tree.out.description = tree.robot;
  return std::move(tree.out);
}

void Trees::place(Tree& tree, int root) {
  const Pose& X_WM = models_[static_cast<std::size_t>(tree.primary)].X;
  tree.out.X_WR = X_WM;
  if (root < 0) return;
  const FlatLink& link = links_[static_cast<std::size_t>(root)];
  tree.out.X_WR = link.X;
  tree.out.X_RM = link.X.inverse() * X_WM;
  if (const Pose* const moved = in_state(root)) tree.out.X_WR = *moved;
}

const Pose* Trees::in_state(int link) const {
  const FlatLink& flat = links_[static_cast<std::size_t>(link)];
  const auto found =
      state_.links.find(models_[static_cast<std::size_t>(flat.model)].item->name + "::" + flat.name);
  return found == state_.links.end() ? nullptr : &found->second;
}

// The positions of joints between links whose poses <state> gives.
void Trees::set_positions(Tree& tree) {
  constexpr double kZero = 1e-6;  // rad or m
  for (const Moved& joint : tree.moved) {
    const Pose* const X_WU = joint.up < 0 ? nullptr : in_state(joint.up);
    const Pose* const X_WD = in_state(joint.down);
    const Joint* const made = tree.robot->find_joint(joint.spec.name);
    if (X_WU == nullptr || X_WD == nullptr || made == nullptr || !is_scalar(*made)) continue;
    const Pose motion = joint.spec.X_UJ.inverse() * X_WU->inverse() * *X_WD * joint.spec.X_JD.inverse();
    const Eigen::Vector3d a_J =
        joint.spec.reversed ? Eigen::Vector3d(-joint.spec.axis.a_J) : joint.spec.axis.a_J;
    const Eigen::Quaterniond turned(motion.linear());
    const double q = made->type == JointType::prismatic ? motion.translation().dot(a_J)
                                                        : 2 * std::atan2(turned.vec().dot(a_J), turned.w());
    if (std::abs(q) > kZero) tree.out.positions.emplace_back(made->name, q);
  }
}

// Breadth first from the root; every link is reached once.
void Trees::grow(Tree& tree, int root) {
  std::deque<int> open;
  std::vector<bool> reached(links_.size(), false);
  std::vector<int> depth(links_.size(), 0);
  const auto reach = [&](int link) {
    reached[static_cast<std::size_t>(link)] = true;
    tree.order.push_back(link);
    open.push_back(link);
  };
  if (root >= 0) {
    reach(root);
    add_link(tree, root);
    if (is_static(root)) {
      weld_static(tree, root);
      for (const int link :
           models_[static_cast<std::size_t>(links_[static_cast<std::size_t>(root)].model)].links) {
        if (link != root) reach(link);
      }
    }
  } else {
    for (FlatJoint& joint : joints_) {
      const int link = joint.parent < 0 ? joint.child : joint.child < 0 ? joint.parent : -1;
      if (link < 0 || component(link) != tree.group || reached[static_cast<std::size_t>(link)]) continue;
      attach(tree, -1, link, joint);
      reach(link);
    }
  }
  while (!open.empty()) {
    const int up = open.front();
    open.pop_front();
    for (const int index : joints_of_[static_cast<std::size_t>(up)]) {
      FlatJoint& joint = joints_[static_cast<std::size_t>(index)];
      const int down = joint.parent == up ? joint.child : joint.parent;
      if (joint.used || down < 0 || reached[static_cast<std::size_t>(down)]) continue;
      if (is_static(up) && is_static(down)) continue;
      depth[static_cast<std::size_t>(down)] = depth[static_cast<std::size_t>(up)] + 1;
      if (depth[static_cast<std::size_t>(down)] > kMaxJointsInChain) {
        throw InputError(
            "sdf.too_deep", joint.item->node->where,
            fmt::format("more than {} joints of '{}' are in a chain", kMaxJointsInChain, tree.out.name));
      }
      attach(tree, up, down, joint);
      reach(down);
    }
  }
}

void Trees::weld_static(Tree& tree, int root) {
  const Model& model = models_[static_cast<std::size_t>(links_[static_cast<std::size_t>(root)].model)];
  const Pose X_RW = links_[static_cast<std::size_t>(root)].X.inverse();
  for (const int link : model.links) {
    if (link == root) continue;
    Joint joint;
    joint.name = name_in(tree, link) + "_static";
    joint.parent = name_in(tree, root);
    joint.child = name_in(tree, link);
    joint.source = links_[static_cast<std::size_t>(link)].item->node->where;
    joint.origin = placed(X_RW * links_[static_cast<std::size_t>(link)].X, joint.source);
    tree.robot->joints.push_back(std::move(joint));
    add_link(tree, link);
  }
}

// The axis in the joint's frame; without the element, SDF's default.
JointAxis Trees::axis_of(FlatJoint& joint, const char* name) {
  const XmlNode* const written = joint.item->node->first(name);
  if (written == nullptr) return JointAxis{};
  const XmlNode* const xyz = written->first("xyz");
  const std::string frame = xyz == nullptr ? "" : Elements::attribute(*xyz, "expressed_in");
  Eigen::Matrix3d R_JE = Eigen::Matrix3d::Identity();
  const bool of_model = elements_.truth(*written, "use_parent_model_frame", joint.item->source->before(5));
  if (!frame.empty() || of_model) {
    const Pose X_J = frames_.pose(*joint.scope, *joint.item);
    const Pose X_E = frames_.pose(*joint.scope, frame, joint.item->base, written->where);
    R_JE = X_J.linear().transpose() * X_E.linear();
  }
  return read_axis(*written, R_JE, elements_);
}

void Trees::attach(Tree& tree, int up, int down, FlatJoint& joint) {
  joint.used = true;
  add_link(tree, down);
  const XmlNode& node = *joint.item->node;
  JointSpec spec;
  spec.name = joint.name;
  const FlatLink& lower = links_[static_cast<std::size_t>(down)];
  if (lower.model != tree.primary && joint.scope != &world_)
    spec.name = models_[static_cast<std::size_t>(lower.model)].item->name + "::" + joint.name;
  spec.type = Elements::attribute(node, "type");
  spec.source = node.where;
  spec.up = up < 0 ? kWorldLink : name_in(tree, up);
  spec.down = name_in(tree, down);
  const Pose X_WU =
      up < 0 ? models_[static_cast<std::size_t>(tree.primary)].X : links_[static_cast<std::size_t>(up)].X;
  spec.X_UJ = X_WU.inverse() * joint.X;
  spec.X_JD = joint.X.inverse() * lower.X;
  spec.reversed = joint.child != down;
  if (const Link& link = tree.robot->links.back(); link.inertial) spec.lower_mass = link.inertial->mass;
  spec.axis = axis_of(joint, "axis");
  spec.axis2 = axis_of(joint, "axis2");
  if (const auto old = elements_.number(node, "thread_pitch"); old && *old != 0)
    spec.screw_pitch = -2 * std::numbers::pi / *old;
  spec.screw_pitch = elements_.number_or(node, "screw_thread_pitch", spec.screw_pitch);
  ComposedJoint made = compose_joint(spec, elements_);
  if (spec.axis.stop_stiffness) {
    GazeboExtension stop;
    stop.reference = spec.name;
    stop.stop_stiffness = spec.axis.stop_stiffness;
    stop.source = spec.axis.source;
    tree.robot->gazebo.push_back(std::move(stop));
  }
  for (Link& link : made.links) tree.robot->links.push_back(std::move(link));
  for (const Joint& part : made.joints) tree.robot->joints.push_back(part);
  tree.moved.push_back({std::move(spec), up, down});
}

void Trees::add_link(Tree& tree, int index) {
  FlatLink& flat = links_[static_cast<std::size_t>(index)];
  const XmlNode& node = *flat.item->node;
  const Source& source = *flat.item->source;
  const Pose X_link = frames_.pose(*flat.scope, *flat.item);
  // A shape's pose is in the link, or in any frame of the model.
  const auto pose_in_link = [&](const XmlNode& part) {
    const WrittenPose pose = elements_.pose(part);
    if (pose.relative_to.empty()) return pose.X;
    return Pose(X_link.inverse() * frames_.pose(*flat.scope, pose.relative_to, flat.item->base, pose.where) *
                pose.X);
  };
  Link link;
  link.name = name_in(tree, index);
  link.source = node.where;
  for (const XmlNode& child : node.children) {
    if (child.is("visual")) {
      for (Visual& visual : shapes_.visuals(child, pose_in_link(child), source))
        link.visuals.push_back(std::move(visual));
    } else if (child.is("collision")) {
      for (Collision& part : shapes_.collisions(child, pose_in_link(child), source)) {
        if (!part.surface.fdir1_frame.empty())
          turn_friction(tree, index, child, pose_in_link(child).linear(), part.surface);
        link.collisions.push_back(std::move(part));
      }
    } else if (child.is("light")) {
      elements_.without_effect(child.where, "<light> of a <link>");
    }
  }
  if (!is_static(index)) {
    const XmlNode* const written = node.first("inertial");
    link.inertial =
        shapes_.inertial(node, link, written == nullptr ? Pose::Identity() : pose_in_link(*written));
  }
  if (!elements_.truth(node, "gravity", true)) {
    GazeboExtension weightless;
    weightless.reference = link.name;
    weightless.gravity = false;
    weightless.source = node.first("gravity")->where;
    tree.robot->gazebo.push_back(std::move(weightless));
  }
  if (auto labels = labels_of(node, link.name, elements_)) tree.robot->gazebo.push_back(std::move(*labels));
  tree.robot->links.push_back(std::move(link));
  for (const XmlNode& child : node.children) {
    if (child.is("sensor")) add_sensor(tree, child, index, "");
  }
}

// The direction of friction in the axes of the link that its frame is attached to: a wheel turns, and its rollers do
// not. In the axes of the collision if that is the link itself.
void Trees::turn_friction(const Tree& tree, int index, const XmlNode& collision, const Eigen::Matrix3d& R_LC,
                          ContactSurface& surface) {
  const FlatLink& own = links_[static_cast<std::size_t>(index)];
  const Pose X_link = frames_.pose(*own.scope, *own.item);
  const Pose X_frame = frames_.pose(*own.scope, surface.fdir1_frame, own.item->base, collision.where);
  const Eigen::Matrix3d R_WF = own.X.linear() * X_link.linear().transpose() * X_frame.linear();
  const LinkRef at = frames_.link(*own.scope, surface.fdir1_frame, own.item->base, collision.where);
  const int other = at.found ? flat(at) : -1;
  if (other >= 0 && other != index && component(other) == component(index)) {
    const FlatLink& carrier = links_[static_cast<std::size_t>(other)];
    surface.fdir1 = carrier.X.linear().transpose() * R_WF * *surface.fdir1;
    surface.fdir1_frame = name_in(tree, other);
    return;
  }
  surface.fdir1 = R_LC.transpose() * own.X.linear().transpose() * R_WF * *surface.fdir1;
  surface.fdir1_frame.clear();
}

void Trees::add_sensor(Tree& tree, const XmlNode& node, int link, const std::string& frame,
                       const std::string& joint) {
  FlatLink& flat = links_[static_cast<std::size_t>(link)];
  const WrittenPose pose = elements_.pose(node);
  const std::string relative = pose.relative_to.empty() ? frame : pose.relative_to;
  SdfSensor sensor;
  sensor.name = Elements::attribute(node, "name");
  sensor.type = Elements::attribute(node, "type");
  sensor.link = name_in(tree, link);
  sensor.joint = joint;
  sensor.node = node;
  sensor.source = node.where;
  sensor.X_LS = pose.X;
  if (!relative.empty()) {
    const Pose X_link = frames_.pose(*flat.scope, *flat.item);
    sensor.X_LS =
        X_link.inverse() * frames_.pose(*flat.scope, relative, flat.item->base, node.where) * pose.X;
  }
  tree.out.sensors.push_back(std::move(sensor));
}

// Joints that would close a loop of links, which a tree does not have.
void Trees::close_loops(const std::vector<int>& members, const Tree& tree) {
  for (const int link : members) {
    for (const int index : joints_of_[static_cast<std::size_t>(link)]) {
      FlatJoint& joint = joints_[static_cast<std::size_t>(index)];
      if (joint.used) continue;
      joint.used = true;
      if (tree.out.is_static) continue;
      elements_.diagnostics.note("sdf.loop", joint.item->node->where,
                                 fmt::format("the joint '{}' closes a loop of links of '{}'; it is left out, "
                                             "because the simulated models are "
                                             "trees",
                                             joint.name, tree.out.name));
    }
  }
}

// Gearboxes: theta_2 = -ratio theta_1, of the joints that carry the two links on the reference body.
void Trees::couple(Tree& tree) {
  for (FlatJoint& joint : joints_) {
    const XmlNode& node = *joint.item->node;
    if (!joint.is_gearbox() || joint.parent < 0 || joint.child < 0) continue;
    if (std::find(tree.order.begin(), tree.order.end(), joint.child) == tree.order.end()) continue;
    const double ratio = elements_.number_or(node, "gearbox_ratio", 1);
    const auto carrier = [&](int link) -> Joint* {
      for (Joint& candidate : tree.robot->joints) {
        if (candidate.child == name_in(tree, link) && is_scalar(candidate)) return &candidate;
      }
      return nullptr;
    };
    Joint* const first = carrier(joint.parent);
    Joint* const second = carrier(joint.child);
    if (first == nullptr || second == nullptr || first == second) {
      elements_.diagnostics.note(
          "sdf.gearbox", node.where,
          fmt::format("the gearbox '{}' is left out: its links are not both carried by a joint with one axis",
                      joint.name));
      continue;
    }
    second->mimic = Mimic{first->name, -ratio, 0, node.where};
  }
}

void Trees::add_extras(Tree& tree) {
  Scope& scope = *models_[static_cast<std::size_t>(tree.primary)].item->scope;
  GazeboExtension plugins;
  XmlNode gazebo = element("gazebo");
  for (const XmlNode* plugin : scope.plugins) {
    const std::string filename = Elements::attribute(*plugin, "filename"),
                      name = Elements::attribute(*plugin, "name");
    if (!is_read(filename, name)) {
      elements_.without_effect(
          plugin->where,
          fmt::format("the plugin '{}' of a <model>", (filename.empty() ? name : filename).substr(0, 60)),
          replacement_of(filename));
    }
    gazebo.children.push_back(*plugin);
    plugins.plugins.push_back({filename, name, {}, to_xml(*plugin), plugin->where});
  }
  if (!plugins.plugins.empty()) {
    plugins.source = plugins.plugins.front().source;
    plugins.node = std::make_shared<const XmlNode>(std::move(gazebo));
    tree.robot->gazebo.push_back(std::move(plugins));
  }
  const int canonical = models_[static_cast<std::size_t>(tree.primary)].canonical;
  for (const XmlNode* sensor : scope.sensors) {
    if (canonical >= 0) add_sensor(tree, *sensor, canonical, kModelFrame);
  }
  for (Item& item : scope.items) {
    if (item.kind == Item::Kind::joint) {
      const LinkRef child = frames_.link(scope, item.child, item.base, item.node->where);
      const int link = child.found ? flat(child) : -1;
      for (const XmlNode& part : item.node->children) {
        if (part.is("sensor") && link >= 0) add_sensor(tree, part, link, item.name, item.name);
      }
    }
    if (item.kind != Item::Kind::frame) continue;
    const LinkRef at = frames_.link(scope, item.name, item.base, item.node->where);
    const int link = at.found ? flat(at) : -1;
    if (link < 0 || std::find(tree.order.begin(), tree.order.end(), link) == tree.order.end()) continue;
    const Pose X_MF = frames_.pose(scope, item);
    const Pose& X_WM = models_[static_cast<std::size_t>(tree.primary)].X;
    const FlatLink& owner = links_[static_cast<std::size_t>(link)];
    tree.out.frames.push_back({item.name, name_in(tree, link), owner.X.inverse() * X_WM * X_MF});
  }
}

}  // namespace doppel::sdf
