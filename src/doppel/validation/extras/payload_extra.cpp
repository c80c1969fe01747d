#include "doppel/validation/extras/payload_extra.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "doppel/validation/extras/detail/held_mass.h"
#include "doppel/validation/statics/start_pose.h"

namespace doppel {
namespace {

constexpr int kBins = 20;                 // of the reach
constexpr double kHalfBin = 0.5 / kBins;  // of the reach
constexpr std::array<int, 4> kShares = {25, 50, 75, 100};

struct BinValue {
  HeldMass held;
  Eigen::VectorXd q;
};

// Configurations whose distance is within half a bin of a share of the reach. The worst one is sought from
// the samples by single joints.
class PayloadSearch {
 public:
  PayloadSearch(const ExtraArm& arm, const CheckContext& context)
      : arm_(arm), data_(arm.model()), reach_(arm.reach()) {
    places_ = arm.places(context.amount(200, 1000, 4000), context.seed);
    if (places_.empty()) return;
    farthest_ = arm.farthest(places_);
    places_.push_back(farthest_);
  }

  [[nodiscard]] bool empty() const { return places_.empty(); }
  [[nodiscard]] double farthest() const { return farthest_.distance; }

  std::optional<BinValue> worst(double share) {
    std::optional<BinValue> out;
    for (const ArmPlace& place : places_) {
      if (!is_inside(place.distance, share)) continue;
      const HeldMass held = held_mass(arm_, data_, place.q, kPayloadShare);
      if (!out || held.mass < out->held.mass) out = BinValue{held, place.q};
    }
    if (out) descend(*out, share);
    return out;
  }

 private:
  [[nodiscard]] bool is_inside(double distance, double share) const {
    return std::abs(distance / farthest_.distance - share) <= kHalfBin;
  }

  void descend(BinValue& value, double share) {
    constexpr std::array<double, 5> kSteps = {0.4, 0.2, 0.1, 0.05, 0.02};
    constexpr int kRounds = 10;  // at most, for each step
    for (const double step : kSteps) {
      for (int round = 0; round < kRounds && improve(value, share, step); ++round) {
      }
    }
  }

  bool improve(BinValue& value, double share, double step) {
    const Chain& chain = arm_.chain();
    bool any = false;
    for (int k = 0; k < chain.size(); ++k) {
      for (const double sign : {1.0, -1.0}) {
        Eigen::VectorXd u = chain.variables_of(arm_.model(), value.q);
        u[k] = std::clamp(u[k] + sign * step, chain.lower[k], chain.upper[k]);
        BinValue next{{}, value.q};
        chain.apply(arm_.model(), u, next.q);
        next.held = held_mass(arm_, data_, next.q, kPayloadShare);
        if (next.held.mass >= value.held.mass) continue;
        forward_kinematics(arm_.model(), data_, next.q);
        if (!is_inside(arm_.distance(data_), share) || !reach_.is_free(next.q)) continue;
        value = std::move(next);
        any = true;
      }
    }
    return any;
  }

  const ExtraArm& arm_;
  Data data_;
  ArmReach reach_;
  std::vector<ArmPlace> places_;
  ArmPlace farthest_;
};

std::string mass_text(double mass) {
  return mass < 1 ? fmt::format("{:.0f} g", 1e3 * mass) : fmt::format("{:.2f} kg", mass);
}

class PayloadJudge {
 public:
  PayloadJudge(const CheckContext& context, CheckResult& out) : context_(context), out_(out) {}

  void judge(const ExtraArm& arm) {
    PayloadSearch search(arm, context_);
    if (search.empty()) return out_.notes.push_back(arm.name() + ": no configuration is free");
    CheckItem item;
    item.subject = arm.name();
    PlotPanel panel;
    panel.title = fmt::format("{}: payload over the horizontal distance from the first joint", arm.name());
    panel.unit = "kg";
    panel.x_axis = "distance, m";
    PlotCurve curve{"worst pose", {}, {}};
    std::optional<double> least;
    double held_until = 0;  // m
    bool holds = true;
    for (int i = 1; i <= kBins; ++i) {
      const double share = static_cast<double>(i) / kBins;
      const auto worst = search.worst(share);
      context_.report(share);
      if (!worst || !std::isfinite(worst->held.mass)) continue;
      curve.times.push_back(share * search.farthest());
      curve.values.push_back(worst->held.mass);
      holds = holds && worst->held.mass >= arm.payload();
      if (holds) held_until = share * search.farthest();
      const int percent = static_cast<int>(std::lround(kPercent * share));
      if (std::ranges::find(kShares, percent) == kShares.end()) continue;
      add(arm, item, percent, *worst);
      least = std::min(least.value_or(worst->held.mass), worst->held.mass);
    }
    if (!least) {
      out_.notes.push_back(arm.name() + ": no drive that carries the tool has an effort limit");
      return;
    }
    panel.curves.push_back(std::move(curve));
    item.curves.push_back(std::move(panel));
    if (arm.payload() > 0)
      item.message += fmt::format("; the suite's {} are held up to {:.3f} m of {:.3f} m",
                                  mass_text(arm.payload()), held_until, search.farthest());
    out_.summary += fmt::format("{}{} holds {} in its worst pose", out_.summary.empty() ? "" : "; ",
                                arm.name(), mass_text(*least));
    out_.add(std::move(item));
  }

 private:
  void add(const ExtraArm& arm, CheckItem& item, int percent, const BinValue& worst) {
    out_.metrics.push_back({fmt::format("payload at {} % of the reach", percent), arm.name(), worst.held.mass,
                            "kg", std::nullopt, Metric::Better::higher});
    const std::string& decisive = arm.joint(worst.held.variable).name;
    item.message += fmt::format("{}{} at {} % of the reach ({})", item.message.empty() ? "" : ", ",
                                mass_text(worst.held.mass), percent, decisive);
    item.poses.push_back({fmt::format("worst pose at {} % of the reach: {}, by {}", percent,
                                      mass_text(worst.held.mass), decisive),
                          posed_joints(arm.model(), worst.q)});
  }

  const CheckContext& context_;
  CheckResult& out_;
};

}  // namespace

HeldMass held_mass(const ExtraArm& arm, Data& data, const Eigen::VectorXd& q, double eta) {
  const Eigen::VectorXd unit = arm.unit_load(data, q), gravity = arm.gravity_load(data, q);
  HeldMass out;
  for (int k = 0; k < arm.chain().size(); ++k) {
    const auto joint = static_cast<Eigen::Index>(arm.chain().variables[static_cast<std::size_t>(k)]);
    const double limit = arm.joint(k).effort;
    if (!std::isfinite(limit) || unit[joint] == 0) continue;
    const double sign = unit[joint] > 0 ? 1 : -1;
    const double mass = (eta * limit - sign * gravity[joint]) / std::abs(unit[joint]);
    if (mass < out.mass) out = {std::max(mass, 0.0), k};
  }
  return out;
}

CheckResult check_payload(const CheckContext& context) {
  const std::vector<ExtraArm> arms = extra_arms(context);
  if (arms.empty()) return not_applicable("X6", no_arm_reason(context));
  CheckResult out = begin_result("X6");
  PayloadJudge judge(context, out);
  for (const ExtraArm& arm : arms) judge.judge(arm);
  if (out.items.empty()) return not_applicable("X6", out.notes.empty() ? "no payload" : out.notes.front());
  out.notes.push_back(fmt::format("a load at rest may take {:.0f} % of an effort limit; motion takes more",
                                  kPercent * kPayloadShare));
  return out;
}

}  // namespace doppel
