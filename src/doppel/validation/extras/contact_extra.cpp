#include "doppel/validation/extras/contact_extra.h"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <optional>

#include "doppel/robot/kinematics/dynamics.h"
#include "doppel/validation/extras/detail/tool_mass.h"
#include "doppel/validation/metrics/contact_speed.h"
#include "doppel/validation/statics/start_pose.h"

namespace doppel {
namespace {

constexpr double kReducedSpeed = 0.25;  // m/s: the reduced speed of ISO 10218-1
constexpr double kMinLever = 0.1;       // of the arm's length: a joint that moves the tool less is left out
constexpr int kMapRings = 10;           // over the horizontal distance

struct HeaviestMotion {
  double mass = 0;  // kg
  int variable = -1;
  Eigen::VectorXd q;
};

class ContactJudge {
 public:
  ContactJudge(const CheckContext& context, CheckResult& out) : context_(context), out_(out) {}

  void judge(const ExtraArm& arm) {
    const std::vector<ArmPlace> places = arm.places(context_.amount(200, 1000, 5000), context_.seed);
    if (places.empty()) return out_.notes.push_back(arm.name() + ": no configuration is free");
    measure(arm, places);
    if (heaviest_.variable < 0) return out_.notes.push_back(arm.name() + ": no joint moves its tool");
    CheckItem item;
    item.subject = arm.name();
    const std::string& joint = arm.joint(heaviest_.variable).name;
    item.message = fmt::format("effective mass at most {:.2f} kg (by {})", heaviest_.mass, joint);
    item.poses.push_back({"largest effective mass", posed_joints(arm.model(), heaviest_.q)});
    out_.metrics.push_back({"largest effective mass", arm.name(), heaviest_.mass, "kg"});
    if (fastest_ > 0) {
      out_.metrics.push_back({"largest tool speed", arm.name(), kMillimetres * fastest_, "mm/s"});
      item.message += fmt::format(", tool speed at most {:.0f} mm/s{}", kMillimetres * fastest_,
                                  fastest_ > kReducedSpeed ? ", above the 250 mm/s of a reduced speed" : "");
      item.poses.push_back({"largest tool speed", posed_joints(arm.model(), fastest_q_)});
    }
    PlotPanel masses;
    masses.title = arm.name() + ": largest effective mass over the horizontal distance";
    masses.unit = "kg";
    masses.x_axis = "distance, m";
    masses.curves.push_back(ring_curve("effective mass", [](double mass) { return mass; }));
    item.curves.push_back(std::move(masses));
    add_regions(arm, item);
    if (!out_.summary.empty()) out_.summary += "; ";
    out_.summary += item.message;
    out_.add(std::move(item));
  }

 private:
  // The tool along the motion of each joint alone.
  void measure(const ExtraArm& arm, const std::vector<ArmPlace>& places) {
    Data data(arm.model());
    heaviest_ = {};
    fastest_ = 0;
    rings_.assign(kMapRings, 0.0);
    farthest_ = std::ranges::max_element(places, {}, &ArmPlace::distance)->distance;
    for (const ArmPlace& place : places) {
      const ToolMobility mobility = tool_mobility(arm, data, place.q, arm.payload());
      if (const double speed = largest_speed(arm, mobility); speed > fastest_) {
        fastest_ = speed;
        fastest_q_ = place.q;
      }
      for (int k = 0; k < arm.chain().size(); ++k) {
        const double lever = mobility.rates.col(k).norm();
        if (lever < kMinLever * arm.chain().length && !arm.slides(k)) continue;
        const double mass = effective_mass(mobility, mobility.rates.col(k) / lever);
        const auto ring =
            static_cast<std::size_t>(std::min(place.distance / farthest_, 1 - 1e-12) * kMapRings);
        rings_[ring] = std::max(rings_[ring], mass);
        if (mass > heaviest_.mass) heaviest_ = {mass, k, place.q};
      }
    }
  }

  template <class Value>
  PlotCurve ring_curve(const std::string& label, Value value) const {
    PlotCurve out{label, {}, {}};
    for (int i = 0; i < kMapRings; ++i) {
      const double mass = rings_[static_cast<std::size_t>(i)];
      if (mass <= 0) continue;
      out.times.push_back((i + 0.5) / kMapRings * farthest_);
      out.values.push_back(value(mass));
    }
    return out;
  }

  void add_regions(const ExtraArm& arm, CheckItem& item) {
    if (context_.suite.contact.empty()) return;
    PlotPanel speeds;
    speeds.title = arm.name() + ": contact speed over the horizontal distance";
    speeds.unit = "mm/s";
    speeds.x_axis = "distance, m";
    for (const auto& [region, limits] : context_.suite.contact) {
      const ContactLimits contact{limits.force, limits.stiffness, limits.mass};
      const auto speed = max_contact_speed(contact, heaviest_.mass);
      if (!speed) continue;
      out_.metrics.push_back({"contact speed", fmt::format("{}, {}", arm.name(), region),
                              kMillimetres * *speed, "mm/s", std::nullopt, Metric::Better::higher});
      item.message += fmt::format(", {} at most {:.0f} mm/s", region, kMillimetres * *speed);
      speeds.curves.push_back(ring_curve(
          region, [&](double mass) { return kMillimetres * max_contact_speed(contact, mass).value_or(0); }));
    }
    item.curves.push_back(std::move(speeds));
  }

  const CheckContext& context_;
  CheckResult& out_;
  HeaviestMotion heaviest_;
  double fastest_ = 0, farthest_ = 0;  // m/s, m
  Eigen::VectorXd fastest_q_;
  std::vector<double> rings_;  // kg
};

}  // namespace

ToolMobility tool_mobility(const ExtraArm& arm, Data& data, const Eigen::VectorXd& q, double payload) {
  mass_matrix(arm.model(), data, q);
  Eigen::MatrixXd M = arm.coupling().transpose() * data.M * arm.coupling();
  forward_kinematics(arm.model(), data, q);
  if (payload > 0) {
    const auto J = arm.tool_jacobian(data, arm.p_LoC_L());
    M += payload * J.bottomRows<3>().transpose() * J.bottomRows<3>();
  }
  ToolMobility out;
  out.rates = arm.tool_jacobian(data, Eigen::Vector3d::Zero()).bottomRows<3>();
  out.inverse_mass = out.rates * M.ldlt().solve(out.rates.transpose());
  return out;
}

double effective_mass(const ToolMobility& mobility, const Eigen::Vector3d& direction) {
  const double inverse = direction.dot(mobility.inverse_mass * direction);
  return inverse > 0 ? 1 / inverse : kInfinity;
}

// The norm is convex, so that it is largest in a corner of the joints' speeds.
double largest_speed(const ExtraArm& arm, const ToolMobility& mobility) {
  const int count = arm.chain().size();
  double out = 0;
  for (std::uint32_t corner = 0; corner < (1U << std::max(count - 1, 0)); ++corner) {
    Eigen::Vector3d speed = Eigen::Vector3d::Zero();
    for (int k = 0; k < count; ++k) {
      const double limit = arm.joint(k).velocity;
      if (std::isfinite(limit)) speed += ((corner >> k) & 1U ? -limit : limit) * mobility.rates.col(k);
    }
    out = std::max(out, speed.norm());
  }
  return out;
}

CheckResult check_contact(const CheckContext& context) {
  const std::vector<ExtraArm> arms = extra_arms(context);
  if (arms.empty()) return not_applicable("X10", no_arm_reason(context));
  CheckResult out = begin_result("X10");
  ContactJudge judge(context, out);
  for (const ExtraArm& arm : arms) judge.judge(arm);
  if (out.items.empty()) return not_applicable("X10", out.notes.front());
  if (context.suite.contact.empty())
    out.notes.emplace_back(
        "no contact speed: the suite's contact: has no region; doppel ships no table of a standard");
  out.notes.emplace_back("the rotors of motors behind gears are not part of a description's masses");
  out.notes.emplace_back("a layout aid: it replaces no measurement and no risk assessment");
  return out;
}

}  // namespace doppel
