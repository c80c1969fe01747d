#pragma once
// Worlds and models as scopes of names: the links, joints, frames and nested models of each, with poses as written,
// and their resolution.

#include <deque>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

#include "doppel/description/urdf/robot_description.h"
#include "doppel/scenario/sdf/detail/sdf_elements.h"

namespace doppel::sdf {

inline constexpr const char* kModelFrame = "__model__";
inline constexpr const char* kWorldFrame = "world";

struct Scope;

struct Item {
  enum class Kind { link, joint, frame, model };
  Kind kind = Kind::link;
  std::string name;
  const XmlNode* node = nullptr;
  const Source* source = nullptr;
  WrittenPose pose;
  std::string base;                        // the frame that "__model__" and no name stand for
  std::string attached_to;                 // of a frame; empty: base
  std::string parent, child;               // of a joint
  std::unique_ptr<Scope> scope;            // of a model
  std::shared_ptr<RobotDescription> urdf;  // of a model that is a URDF
  // Of a model or a merged one's frame: the pose of its placement frame in it.
  Pose X_M_placement = Pose::Identity();

  enum class State { open, busy, done } state = State::open;
  Pose X = Pose::Identity();  // in the scope's frame, when done
};

struct Scope {
  std::string name;  // of the model or world
  bool is_world = false, is_static = false, self_collide = false;
  bool is_stand_in = false;  // for a model that is not found: every name is its only link
  std::string canonical_link, placement_frame;
  const XmlNode* node = nullptr;
  const Source* source = nullptr;
  std::deque<Item> items;
  std::vector<const XmlNode*> plugins;  // of the model, and of its <include>
  std::vector<const XmlNode*> sensors;  // directly below the model

  [[nodiscard]] Item* find(std::string_view item);
  void add(Item item);

 private:
  std::unordered_map<std::string, std::size_t> by_name_;  // a link before a joint of the same name
};

// A link in its scope and the scopes around it.
struct LinkRef {
  Scope* scope = nullptr;
  Item* link = nullptr;  // nullptr: the world
  bool found = false;
};

// Resolves frames; every error is reported once, and its frame is then the identity.
class Frames {
 public:
  explicit Frames(Elements& elements) : elements_(elements) {}

  // X of a frame in the scope; `name` may be "inner::frame", `base` is what "__model__" stands for.
  Pose pose(Scope& scope, const std::string& name, const std::string& base, const SourceLocation& where);
  Pose pose(Scope& scope, Item& item);
  // The link that a frame is attached to.
  LinkRef link(Scope& scope, const std::string& name, const std::string& base, const SourceLocation& where);
  LinkRef canonical(Scope& scope);
  // Every pose of the scope and of the models in it, for their errors.
  void resolve_all(Scope& scope);

 private:
  Pose in(Scope& scope, Item& item);
  LinkRef link(Scope& scope, const std::string& name, const std::string& base, const SourceLocation& where,
               int depth);
  void unknown(const Scope& scope, const std::string& name, const SourceLocation& where);
  Item* missing_part(Scope& scope, const std::string& name, const SourceLocation& where);

  Elements& elements_;
  std::vector<const Item*> path_;
  std::set<std::string> reported_;
};

}  // namespace doppel::sdf
