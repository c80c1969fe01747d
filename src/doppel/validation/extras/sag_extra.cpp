#include "doppel/validation/extras/sag_extra.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "doppel/validation/extras/detail/extra_arm.h"
#include "doppel/validation/extras/detail/tool_sag.h"
#include "doppel/validation/statics/start_pose.h"

namespace doppel {
namespace {

constexpr int kRings = 10;  // of the map, over the distance of the tool

struct WorstSag {
  ToolSag sag;
  Eigen::VectorXd q;
};

class SagJudge {
 public:
  SagJudge(const CheckContext& context, CheckResult& out) : context_(context), out_(out) {}

  void judge(const ExtraArm& arm) {
    const std::vector<ArmPlace> places = arm.places(context_.amount(200, 1000, 10'000), context_.seed);
    if (places.empty()) return out_.notes.push_back(arm.name() + ": no configuration is free");
    CheckItem item;
    item.subject = arm.name();
    PlotPanel panel;
    panel.title =
        fmt::format("{}: largest sag over the horizontal distance from the first joint", arm.name());
    panel.unit = "mm";
    panel.x_axis = "distance, m";
    const double farthest = arm.farthest(places).distance;
    for (const double payload : {0.0, arm.payload()}) {
      if (payload == 0 && !item.message.empty()) continue;
      const char* const load = payload > 0 ? "with payload" : "without payload";
      judge_load(arm, places, farthest, payload, load, item, panel);
    }
    item.curves.push_back(std::move(panel));
    out_.add(std::move(item));
  }

 private:
  void judge_load(const ExtraArm& arm, const std::vector<ArmPlace>& places, double farthest, double payload,
                  const char* load, CheckItem& item, PlotPanel& panel) {
    Data data(arm.model());
    std::optional<WorstSag> worst;
    std::vector<double> rings(kRings, -1.0);
    double sum = 0;
    for (const ArmPlace& place : places) {
      const ToolSag sag = tool_sag(arm, data, place.q, payload);
      const double size = sag.displacement.norm();
      sum += size;
      if (!worst || size > worst->sag.displacement.norm()) worst = WorstSag{sag, place.q};
      const auto ring = static_cast<std::size_t>(std::min(place.distance / farthest, 1 - 1e-12) * kRings);
      rings[ring] = std::max(rings[ring], size);
    }
    const double largest = worst->sag.displacement.norm(), mean = sum / static_cast<double>(places.size());
    PlotCurve curve{load, {}, {}};
    for (int i = 0; i < kRings; ++i) {
      if (rings[static_cast<std::size_t>(i)] < 0) continue;
      curve.times.push_back((i + 0.5) / kRings * farthest);
      curve.values.push_back(kMillimetres * rings[static_cast<std::size_t>(i)]);
    }
    panel.curves.push_back(std::move(curve));
    const std::string subject = fmt::format("{}, {}", arm.name(), load);
    out_.metrics.push_back({"largest sag", subject, kMillimetres * largest, "mm"});
    out_.metrics.push_back({"mean sag", subject, kMillimetres * mean, "mm"});
    const std::string decisive = worst->sag.variable < 0 ? "no drive" : arm.joint(worst->sag.variable).name;
    item.message += fmt::format("{}{}: at most {:.2f} mm, most of it by {}; mean {:.2f} mm",
                                item.message.empty() ? "" : "; ", load, kMillimetres * largest, decisive,
                                kMillimetres * mean);
    item.poses.push_back({fmt::format("largest sag {}: {:.2f} mm", load, kMillimetres * largest),
                          posed_joints(arm.model(), worst->q)});
    worst_ = std::max(worst_, largest);
    out_.summary = fmt::format("at most {:.2f} mm", kMillimetres * worst_);
  }

  const CheckContext& context_;
  CheckResult& out_;
  double worst_ = 0;  // m
};

}  // namespace

ToolSag tool_sag(const ExtraArm& arm, Data& data, const Eigen::VectorXd& q, double payload) {
  Eigen::VectorXd load = arm.gravity_load(data, q);
  if (payload > 0) load += payload * arm.unit_load(data, q);
  forward_kinematics(arm.model(), data, q);
  const Eigen::Matrix<double, 6, Eigen::Dynamic> J = arm.tool_jacobian(data, Eigen::Vector3d::Zero());
  ToolSag out;
  double most = 0;
  for (int k = 0; k < arm.chain().size(); ++k) {
    const ServoParameters& servo = arm.servo(k);
    if (servo.ideal || !(servo.stiffness > 0)) continue;
    const auto joint = static_cast<Eigen::Index>(arm.chain().variables[static_cast<std::size_t>(k)]);
    // The drive holds the load with the spring that the load has stretched against its direction.
    const Eigen::Vector3d part = -J.col(k).tail<3>() * load[joint] / servo.stiffness;
    out.displacement += part;
    if (part.norm() > most) {
      most = part.norm();
      out.variable = k;
    }
  }
  return out;
}

CheckResult check_sag(const CheckContext& context) {
  const std::vector<ExtraArm> arms = extra_arms(context);
  if (arms.empty()) return not_applicable("X7", no_arm_reason(context));
  CheckResult out = begin_result("X7");
  SagJudge judge(context, out);
  for (const ExtraArm& arm : arms) judge.judge(arm);
  if (out.items.empty()) return not_applicable("X7", "no configuration of an arm is free");
  out.notes.emplace_back("J K^-1 g(q) with the stiffness K of the simulated drives; links are rigid");
  return out;
}

}  // namespace doppel
