#include "doppel/review/conversion/sdf.h"

#include <map>
#include <set>

#include "conversion_fixture.h"
#include "doppel/base/core/text.h"

namespace doppel {
namespace {

// A small reader of SDF's pose graph, written from the specification alone: the pose of each link and frame
// with the joints at q.
class SdfReader {
 public:
  explicit SdfReader(const std::string& text)
      : root_(parse_xml(text, "out.sdf")), model_(*root_.first("model")) {
    for (const XmlNode& node : model_.children) {
      if (!node.is("link") && !node.is("joint") && !node.is("frame")) continue;
      const std::string name = node.find("name")->value;
      EXPECT_TRUE(nodes_.emplace(name, &node).second) << "expected unique names; defined twice: " << name;
      if (node.is("joint")) joint_above_[node.first("child")->content()] = &node;
    }
  }

  Pose at_zero(const std::string& name) const {
    if (name.empty() || name == "__model__" || name == "world") return Pose::Identity();
    const XmlNode& node = *nodes_.at(name);
    const XmlNode* pose = node.first("pose");
    std::string base = node.is("frame") && node.find("attached_to") ? node.find("attached_to")->value : "";
    if (node.is("joint")) base = node.first("child")->content();
    Pose X = Pose::Identity();
    if (pose != nullptr) {
      X = read(*pose);
      if (pose->find("relative_to")) base = pose->find("relative_to")->value;
    }
    return at_zero(base) * X;
  }

  // Up through the joints: the child moves about the joint's axis.
  Pose at(const std::string& name, const std::map<std::string, double>& q) const {
    if (name == "world" || name == "__model__" || name.empty()) return Pose::Identity();
    const XmlNode& node = *nodes_.at(name);
    if (node.is("frame")) {
      const std::string base = node.find("attached_to") ? node.find("attached_to")->value : "";
      return at(base, q) * (at_zero(base).inverse() * at_zero(name));
    }
    if (node.is("joint")) {  // fixed to its child in SDF; moves with its parent only if it is a fixed joint
      return at(node.first("child")->content(), q) *
             (at_zero(node.first("child")->content()).inverse() * at_zero(name));
    }
    const auto above = joint_above_.find(name);
    if (above == joint_above_.end()) return at_zero(name);
    const XmlNode& joint = *above->second;
    const std::string joint_name = joint.find("name")->value, parent = joint.first("parent")->content();
    const Pose X_PJ = at_zero(parent).inverse() * at_zero(joint_name);
    const Pose X_JC = at_zero(joint_name).inverse() * at_zero(name);
    return at(parent, q) * X_PJ * motion(joint, q) * X_JC;
  }

  const XmlNode& node(const std::string& name) const { return *nodes_.at(name); }
  bool has(const std::string& name) const { return nodes_.contains(name); }
  const XmlNode& model() const { return model_; }

  static std::vector<double> numbers(const std::string& text) {
    std::vector<double> out;
    std::size_t at = 0;
    while (at < text.size()) {
      const std::size_t end = std::min(text.find(' ', at), text.size());
      if (end > at) out.push_back(parse_number(text.substr(at, end - at)).value());
      at = end + 1;
    }
    return out;
  }

 private:
  static Pose read(const XmlNode& pose) {
    const auto n = numbers(pose.content());
    EXPECT_EQ(n.size(), 6u);
    return make_pose({n[0], n[1], n[2]}, {n[3], n[4], n[5]});
  }

  static Pose motion(const XmlNode& joint, const std::map<std::string, double>& q) {
    Pose X = Pose::Identity();
    const std::string type = joint.find("type")->value;
    if (type == "fixed") return X;
    const auto n = numbers(joint.first("axis")->first("xyz")->content());
    const Eigen::Vector3d axis(n[0], n[1], n[2]);
    const double value = q.at(joint.find("name")->value);
    if (type == "prismatic") {
      X.translation() = axis * value;
    } else {
      X.linear() = Eigen::AngleAxisd(value, axis).toRotationMatrix();
    }
    return X;
  }

  XmlNode root_;
  const XmlNode& model_;
  std::map<std::string, const XmlNode*> nodes_, joint_above_;
};

std::string exported(const Converted& converted, Diagnostics& diagnostics) {
  MeshFiles files({DOPPEL_SOURCE_DIR, false, std::nullopt});
  return to_sdf(converted.robot, converted.model, files, diagnostics);
}

void expect_same_kinematics(const Converted& converted, const SdfReader& sdf,
                            const std::map<std::string, std::string>& renamed = {}) {
  SCOPED_TRACE("seed 11");
  std::mt19937 generator(11);
  const Model& model = converted.model;
  Data data(model);
  for (int trial = 0; trial < 20; ++trial) {
    const Eigen::VectorXd q = random_q(model, generator);
    forward_kinematics(model, data, q);
    std::map<std::string, double> by_name;
    for (const ModelJoint& joint : model.joints) {
      const auto other = renamed.find(joint.name);
      if (joint.scalar()) by_name[other == renamed.end() ? joint.name : other->second] = q[joint.q];
    }
    // The model's frame is that of the root link, or of the first link below a world.
    for (std::size_t i = 0; i < model.links.size(); ++i) {
      if (model.links[i].name == "world") continue;
      ASSERT_TRUE(same(sdf.at(model.links[i].name, by_name), data.X_WL[i], 1e-9)) << model.links[i].name;
    }
  }
}

double number_in(const XmlNode& node, const char* name) {
  return parse_number(node.first(name)->content()).value();
}

TEST(SdfTest, BundledRobotsKeepPoses) {
  for (const char* name : {"omarm_one", "omarm_zero", "lab_arm"}) {
    SCOPED_TRACE(name);
    const Converted converted = bundled(name);
    Diagnostics diagnostics;
    const SdfReader sdf(exported(converted, diagnostics));
    expect_same_kinematics(converted, sdf);
    double mass = 0;
    for (const XmlNode& node : sdf.model().children) {
      if (node.is("link")) mass += number_in(*node.first("inertial"), "mass");
    }
    EXPECT_NEAR(mass, converted.model.total_mass, 1e-9);
  }
}

TEST(SdfTest, EveryElementIsConverted) {
  const Converted converted = from_text(kWholeRobot);
  Diagnostics diagnostics;
  const SdfReader sdf(exported(converted, diagnostics));
  expect_same_kinematics(converted, sdf, {{"slide", "slide_2"}});
  EXPECT_TRUE(sdf.node("base_footprint").is("frame"))
      << "expected a frame: without mass and shape it would weigh 1 kg as a link";
  EXPECT_TRUE(sdf.node("tool0").is("frame"));
  EXPECT_TRUE(sdf.node("slide").is("link"));
  ASSERT_TRUE(sdf.has("slide_2")) << "expected a new name: SDF requires unique names";
  EXPECT_TRUE(sdf.node("slide_2").is("joint"));
  const XmlNode& axis = *sdf.node("turn & \"twist\"").first("axis");
  EXPECT_EQ(number_in(*axis.first("limit"), "lower"), -1);
  EXPECT_EQ(number_in(*axis.first("limit"), "effort"), 5);
  EXPECT_EQ(number_in(*axis.first("dynamics"), "friction"), 0.02);
  const XmlNode& mimic = *sdf.node("follower").first("axis")->first("mimic");
  EXPECT_EQ(mimic.find("joint")->value, "slide_2");
  EXPECT_EQ(number_in(mimic, "multiplier"), 1.5);
  EXPECT_EQ(sdf.node("wheel").find("type")->value, "continuous");
  EXPECT_EQ(sdf.node("wheel").first("axis")->first("limit"), nullptr);
  const XmlNode& base = sdf.node("base");
  const XmlNode& surface = *base.first("collision")->first("surface");
  EXPECT_EQ(number_in(*surface.first("friction")->first("ode"), "mu"), 0.7);
  EXPECT_EQ(number_in(*surface.first("contact")->first("ode"), "kp"), 1e6);
  EXPECT_EQ(base.first("self_collide")->content(), "true");
  EXPECT_EQ(base.first("visual")->first("material")->first("diffuse")->content(), "1 0 0 1");
  ASSERT_NE(sdf.model().first("plugin"), nullptr);
  EXPECT_EQ(sdf.model().first("plugin")->find("filename")->value, "libx.so");
}

TEST(SdfTest, FixedBaseJoinsWorld) {
  const Converted converted = bundled("omarm_one");
  Diagnostics diagnostics;
  const SdfReader sdf(exported(converted, diagnostics));
  EXPECT_FALSE(sdf.has("world"));
  const XmlNode& joint = sdf.node("world_to_base");
  EXPECT_EQ(joint.find("type")->value, "fixed");
  EXPECT_EQ(joint.first("parent")->content(), "world");
}

TEST(SdfTest, UnsupportedElementsAreWarnings) {
  const Converted converted = from_text(
      "<robot name=\"r\"><link name=\"a\"><visual><geometry><sphere radius=\"1\"/></geometry></visual></link>"
      "<gazebo reference=\"a\"><strange>1</strange></gazebo></robot>");
  Diagnostics diagnostics;
  const SdfReader sdf(exported(converted, diagnostics));
  std::set<std::string> rules;
  for (const Diagnostic& diagnostic : diagnostics.all()) rules.insert(diagnostic.rule);
  EXPECT_EQ(rules, (std::set<std::string>{"sdf.dropped", "sdf.no_mass"}));
  EXPECT_EQ(number_in(*sdf.node("a").first("inertial"), "mass"), 1e-3);
}

}  // namespace
}  // namespace doppel
