#pragma once
// Random worlds of SDF whose poses are known: chosen in the world, then written relative to frames that are already
// placed, in all ways that SDF has.

#include <fmt/format.h>

#include <algorithm>
#include <numbers>
#include <random>
#include <string>
#include <tuple>
#include <vector>

#include "doppel/base/math/decimals.h"
#include "doppel/base/math/pose.h"

namespace doppel {

enum PoseFeature {
  kDegrees,
  kQuaternion,
  kRelativeTo,
  kFrames,
  kAttached,
  kPlacement,
  kNested,
  kJointPose,
  kExpressedIn,
  kShuffled,
  kPoseFeatures
};

struct GeneratedWorld {
  std::string text;
  std::vector<std::tuple<std::string, std::string, Pose>> links;  // model, link, X_WL
  // Model, joint, a point of the axis and its direction in the world.
  std::vector<std::tuple<std::string, std::string, Eigen::Vector3d, Eigen::Vector3d>> axes;
};

class SdfGenerator {
 public:
  SdfGenerator(unsigned features, unsigned seed) : features_(features), random_(seed) {}

  GeneratedWorld world() {
    std::vector<Placed> known;
    std::vector<std::string> parts;
    if (has(kFrames)) {
      const Pose X = pose();
      parts.push_back("<frame name='wf'>" + written(X, "", "") + "</frame>\n");
      known.push_back({"wf", X});
    }
    for (int i = 0; i < 3; ++i) {
      const std::string name = fmt::format("m{}", i);
      const Pose X_WM = pose();
      Model made = model(name, i == 0 ? 0 : 1);
      const auto [reference, X_WF] = choose(known);
      const std::string text = written(X_WF.inverse() * X_WM * made.X_M_placement, reference, "");
      parts.push_back(
          fmt::format("<model name='{}'{}>{}{}</model>\n", name, made.attributes, text, made.content));
      known.push_back({name, X_WM});
      for (const auto& [link, X_ML] : made.links) {
        out_.links.emplace_back(name, link, X_WM * X_ML);
        known.push_back({name + "::" + link, X_WM * X_ML});
      }
      for (const auto& [joint, p_M, a_M] : made.axes)
        out_.axes.emplace_back(name, joint, X_WM * p_M, X_WM.linear() * a_M);
    }
    shuffle(parts);
    out_.text = "<?xml version='1.0'?>\n<sdf version='1.9'><world name='w'>\n";
    for (const std::string& part : parts) out_.text += part;
    out_.text += "</world></sdf>\n";
    return std::move(out_);
  }

 private:
  struct Placed {
    std::string name;
    Pose X = Pose::Identity();
  };
  struct Model {
    std::string content, attributes;
    Pose X_M_placement = Pose::Identity();
    std::vector<std::pair<std::string, Pose>> links;  // in the model
    std::vector<std::tuple<std::string, Eigen::Vector3d, Eigen::Vector3d>> axes;
  };

  [[nodiscard]] bool has(PoseFeature feature) const { return (features_ >> feature & 1u) != 0; }
  double number(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random_);
  }
  std::size_t index(std::size_t count) { return random_() % count; }
  Pose pose() {
    using std::numbers::pi;
    return make_pose({number(-3, 3), number(-3, 3), number(-3, 3)},
                     {number(-pi, pi), number(-1.5, 1.5), number(-pi, pi)});
  }
  void shuffle(std::vector<std::string>& parts) {
    if (has(kShuffled)) std::shuffle(parts.begin(), parts.end(), random_);
  }

  // A frame that is already placed; none: the frame that a pose is in anyhow.
  Placed choose(const std::vector<Placed>& known) {
    if (!has(kRelativeTo) || known.empty() || index(4) == 0) return {};
    return known[index(known.size())];
  }

  std::string written(const Pose& X, const std::string& relative_to, const std::string& more) {
    const std::string relative = relative_to.empty() ? "" : fmt::format(" relative_to='{}'", relative_to);
    const std::string p = decimals(X.translation());
    if (has(kQuaternion) && index(2) == 0) {
      const Eigen::Quaterniond q(X.linear());
      return fmt::format("<pose{}{} rotation_format='quat_xyzw'>{}  {} {} {} {}</pose>", relative, more, p,
                         decimal(q.x()), decimal(q.y()), decimal(q.z()), decimal(q.w()));
    }
    const Eigen::Vector3d rpy = rpy_from_rotation(X.linear());
    if (has(kDegrees) && index(2) == 0)
      return fmt::format("<pose{}{} degrees='true'>{} {}</pose>", relative, more, p,
                         decimals(rpy * (180 / std::numbers::pi)));
    return fmt::format("<pose{}{}>{} {}</pose>", relative, more, p, decimals(rpy));
  }

  Model model(const std::string& name, int depth) {
    Model out;
    std::vector<Placed> known;
    std::vector<std::string> parts;
    for (int i = 0; i < 3; ++i) {
      const std::string link = fmt::format("l{}", i);
      const Pose X = pose();
      const auto [reference, X_MF] = choose(known);
      parts.push_back(fmt::format("<link name='{}'>{}<inertial><mass>1</mass></inertial></link>\n", link,
                                  written(X_MF.inverse() * X, reference, "")));
      known.push_back({link, X});
      out.links.emplace_back(link, X);
      if (has(kFrames)) add_frame(i, known, parts);
    }
    for (int i = 0; i < 2; ++i)
      add_joint(fmt::format("l{}", i), fmt::format("l{}", i + 1), known, parts, out);
    if (has(kNested) && depth < 2) add_nested(name, depth, known, parts, out);
    if (has(kPlacement)) {
      const Placed& at = known[index(known.size())];
      out.attributes = fmt::format(" placement_frame='{}'", at.name);
      out.X_M_placement = at.X;
    }
    shuffle_keeping_first(parts);
    for (const std::string& part : parts) out.content += part;
    return out;
  }

  // The first link is the canonical one.
  void shuffle_keeping_first(std::vector<std::string>& parts) {
    if (has(kShuffled)) std::shuffle(parts.begin() + 1, parts.end(), random_);
  }

  void add_frame(int i, std::vector<Placed>& known, std::vector<std::string>& parts) {
    const std::string name = fmt::format("f{}", i);
    const Pose X = pose();
    auto [reference, X_MF] = choose(known);
    std::string attached;
    if (has(kAttached)) {
      const Placed& to = known[index(known.size())];
      attached = fmt::format(" attached_to='{}'", to.name);
      if (reference.empty()) X_MF = to.X;
    }
    parts.push_back(fmt::format("<frame name='{}'{}>{}</frame>\n", name, attached,
                                written(X_MF.inverse() * X, reference, "")));
    known.push_back({name, X});
  }

  void add_joint(const std::string& parent, const std::string& child, std::vector<Placed>& known,
                 std::vector<std::string>& parts, Model& out) {
    const std::string name = parent + "_" + child;
    const auto pose_of = [&](const std::string& frame) {
      for (const Placed& one : known) {
        if (one.name == frame) return one.X;
      }
      return Pose(Pose::Identity());
    };
    Pose X = pose_of(child);
    std::string place;
    if (has(kJointPose)) {
      X = pose();
      const auto [reference, X_MF] = choose(known);
      place = written((reference.empty() ? pose_of(child) : X_MF).inverse() * X, reference, "");
    }
    Eigen::Vector3d axis(number(-1, 1), number(-1, 1), number(0.1, 1));
    Eigen::Matrix3d R = X.linear();
    std::string expressed;
    if (has(kExpressedIn)) {
      const Placed in = index(3) == 0 ? Placed{"__model__", Pose::Identity()} : known[index(known.size())];
      expressed = fmt::format(" expressed_in='{}'", in.name);
      R = in.X.linear();
    }
    parts.push_back(fmt::format(
        "<joint name='{}' "
        "type='revolute'>{}<parent>{}</parent><child>{}</child><axis><xyz{}>{}</xyz></axis></joint>\n",
        name, place, parent, child, expressed, decimals(axis)));
    known.push_back({name, X});
    out.axes.emplace_back(name, X.translation(), (R * axis).normalized());
  }

  void add_nested(const std::string& outer, int depth, std::vector<Placed>& known,
                  std::vector<std::string>& parts, Model& out) {
    const std::string name = "inner";
    Model inner = model(outer + "_inner", depth + 1);
    const Pose X = pose();
    const auto [reference, X_MF] = choose(known);
    parts.push_back(fmt::format("<model name='{}'{}>{}{}</model>\n", name, inner.attributes,
                                written(X_MF.inverse() * X * inner.X_M_placement, reference, ""),
                                inner.content));
    parts.push_back(
        "<joint name='to_inner' type='fixed'><parent>l0</parent><child>inner::l0</child></joint>\n");
    known.push_back({name, X});
    for (const auto& [link, X_IL] : inner.links) {
      out.links.emplace_back(name + "::" + link, X * X_IL);
      known.push_back({name + "::" + link, X * X_IL});
    }
    for (const auto& [joint, p_I, a_I] : inner.axes)
      out.axes.emplace_back(name + "::" + joint, X * p_I, X.linear() * a_I);
  }

  unsigned features_;
  std::mt19937 random_;
  GeneratedWorld out_;
};

}  // namespace doppel
