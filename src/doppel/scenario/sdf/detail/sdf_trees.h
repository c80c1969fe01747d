#pragma once
// From scopes to trees of links: every connected set of links is one model with a description.

#include <map>
#include <string>
#include <vector>

#include "doppel/scenario/sdf/detail/sdf_joints.h"
#include "doppel/scenario/sdf/detail/sdf_scope.h"
#include "doppel/scenario/sdf/detail/sdf_shapes.h"
#include "doppel/scenario/sdf/detail/sdf_state.h"
#include "doppel/scenario/sdf/sdf_world.h"

namespace doppel::sdf {

class Trees {
 public:
  Trees(Scope& world, Frames& frames, Elements& elements, Files& files, const StatePoses& state)
      : world_(world), frames_(frames), elements_(elements), shapes_(elements, files), state_(state) {}

  std::vector<SdfModel> build();

 private:
  struct FlatLink {
    Scope* scope = nullptr;
    Item* item = nullptr;
    std::string name;  // in its model: "inner::link"
    int model = 0;
    Pose X = Pose::Identity();  // in the world, all joints at zero
    bool held = false;          // by the <static> of a nested model
  };
  struct FlatJoint {
    Scope* scope = nullptr;
    Item* item = nullptr;
    std::string name;
    int parent = -1, child = -1;  // links; -1: the world
    Pose X = Pose::Identity();    // in the world
    bool used = false;
    [[nodiscard]] bool is_gearbox() const { return Elements::attribute(*item->node, "type") == "gearbox"; }
  };
  struct Model {
    Item* item = nullptr;
    Pose X = Pose::Identity();  // in the world
    int canonical = -1;         // link
    std::vector<int> links;
    std::map<std::string, int> by_name;
  };
  // A joint with the links that it was made for.
  struct Moved {
    JointSpec spec;
    int up = -1, down = -1;
  };
  // One tree under construction.
  struct Tree {
    SdfModel out;
    std::shared_ptr<RobotDescription> robot = std::make_shared<RobotDescription>();
    int group = 0;    // component() of its links
    int primary = 0;  // the model that gives names without a prefix
    std::vector<Moved> moved;
    std::vector<int> order;   // links, parents first
    bool world_root = false;  // its root is a link "world" at the primary model's frame
  };

  void collect(Scope& scope, const std::string& prefix, int model, const Pose& X);
  void collect_joint(Scope& scope, Item& item, const std::string& prefix, const Pose& X);
  int flat(const LinkRef& ref) const;
  void hold_nested();
  void connect();
  int component(int link);
  SdfModel build_urdf(const Model& model);
  SdfModel build_tree(const std::vector<int>& members);
  int choose_root(const std::vector<int>& members, Tree& tree);
  void grow(Tree& tree, int root);
  void attach(Tree& tree, int up, int down, FlatJoint& joint);
  JointAxis axis_of(FlatJoint& joint, const char* name);
  void weld_static(Tree& tree, int root);
  void add_link(Tree& tree, int link);
  void add_extras(Tree& tree);
  void turn_friction(const Tree& tree, int index, const XmlNode& collision, const Eigen::Matrix3d& R_LC,
                     ContactSurface& surface);
  void add_sensor(Tree& tree, const XmlNode& node, int link, const std::string& frame,
                  const std::string& joint = {});
  void place(Tree& tree, int root);
  void close_loops(const std::vector<int>& members, const Tree& tree);
  void couple(Tree& tree);
  void set_positions(Tree& tree);
  [[nodiscard]] const Pose* in_state(int link) const;
  [[nodiscard]] std::string name_in(const Tree& tree, int link) const;
  [[nodiscard]] bool is_static(int link) const {
    return models_[static_cast<std::size_t>(links_[static_cast<std::size_t>(link)].model)]
        .item->scope->is_static;
  }

  Scope& world_;
  Frames& frames_;
  Elements& elements_;
  ShapeReader shapes_;
  const StatePoses& state_;
  std::vector<FlatLink> links_;
  std::vector<FlatJoint> joints_;
  std::vector<Model> models_;
  std::map<const Item*, int> index_;
  std::vector<int> group_;                   // [links] union-find
  std::vector<std::vector<int>> joints_of_;  // [links]
};

}  // namespace doppel::sdf
