#include "doppel/validation/extras/stopping_extra.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>

#include "doppel/base/math/units.h"
#include "doppel/validation/extras/detail/extra_arm.h"
#include "doppel/validation/extras/detail/joint_stop.h"
#include "doppel/validation/extras/detail/twin_touch.h"
#include "doppel/validation/statics/start_pose.h"

namespace doppel {
namespace {

constexpr std::array<int, 3> kStopShares = {33, 66, 100};  // % of the speed and of the extension
constexpr std::array<StopCategory, 3> kCategories = {StopCategory::off, StopCategory::brake_then_off,
                                                     StopCategory::brake_and_hold};
constexpr double kSettled = 0.2;     // s at a pose before a stop
constexpr double kTolerance = 0.05;  // of the reach, in which a pose counts for an extension

int number_of(StopCategory category) {
  return static_cast<int>(category);
}

// The worst over extensions and loads.
struct StopCell {
  double time = 0, way = 0, tool_way = 0;  // s, rad or m, m
  int extension = 0;                       // %
  bool stops = true, ends_at_limit = false, payload = false;
  Eigen::VectorXd q;
  PlotCurve curve;
};

class StoppingJudge {
 public:
  StoppingJudge(const CheckContext& context, const ExtraArm& arm, CheckResult& out)
      : context_(context), arm_(arm), out_(out) {}

  void run(double begin, double end) {
    places_ = arm_.places(context_.amount(100, 300, 1000), context_.seed);
    if (places_.empty()) return out_.notes.push_back(arm_.name() + ": no configuration is free");
    farthest_ = arm_.farthest(places_);
    places_.push_back(farthest_);
    // The twin has the ground, too, and a link that lies on it creeps for seconds.
    TwinTouch touch(context_);
    std::erase_if(places_, [&](const ArmPlace& place) { return !touch.is_free(arm_.model(), place.q); });
    for (const bool payload : {false, true}) {
      if (payload && !(arm_.payload() > 0)) continue;
      MachineOptions options;
      options.payload = payload;
      MachineRun machine(context_, options);
      const std::shared_ptr<const SavedState> start = machine.save();
      for (int k = 0; k < arm_.chain().size(); ++k) {
        if (!context_.joint.empty() && arm_.joint(k).name != context_.joint) continue;
        measure_joint(machine, *start, k, payload);
        context_.report(begin + (end - begin) * (k + 1) / arm_.chain().size());
      }
    }
    for (int k = 0; k < arm_.chain().size(); ++k) add_joint(k);
  }

  [[nodiscard]] double longest() const { return longest_; }
  [[nodiscard]] double widest() const { return widest_; }

 private:
  // The place of an extension at which the joint has the most room to both sides.
  [[nodiscard]] const ArmPlace* place_for(int variable, int extension) const {
    const ArmPlace* out = nullptr;
    double most = -1;
    const ModelJoint& joint = arm_.joint(variable);
    for (const ArmPlace& place : places_) {
      const double share = place.distance / farthest_.distance;
      if (std::abs(share - extension / kPercent) > kTolerance) continue;
      const double room = std::min({joint.upper - place.q[joint.q], place.q[joint.q] - joint.lower, 1e3});
      if (room <= most) continue;
      most = room;
      out = &place;
    }
    return out;
  }

  // With gravity, towards which a joint stops worst; where it carries nothing, to the side with more room.
  [[nodiscard]] double direction(int variable, const Eigen::VectorXd& q) const {
    Data data(arm_.model());
    const auto index = static_cast<Eigen::Index>(arm_.chain().variables[static_cast<std::size_t>(variable)]);
    const double load = arm_.gravity_load(data, q)[index];
    const ModelJoint& joint = arm_.joint(variable);
    constexpr double kIdle = 1e-6;  // N m or N
    if (std::abs(load) > kIdle) return load > 0 ? -1 : 1;
    return joint.upper - q[joint.q] < q[joint.q] - joint.lower ? -1 : 1;
  }

  void measure_joint(MachineRun& machine, const SavedState& start, int variable, bool payload) {
    const ModelJoint& joint = arm_.joint(variable);
    if (!std::isfinite(joint.velocity)) {
      if (!payload)
        out_.notes.push_back(joint.name + " has no speed limit, so that no share of it is stopped");
      return;
    }
    for (const int extension : kStopShares) {
      const ArmPlace* const place = place_for(variable, extension);
      if (place == nullptr) continue;
      for (const int share : kStopShares) {
        for (const StopCategory category : kCategories)
          measure_stop(machine, start, {variable, extension, share, payload, category}, *place);
      }
    }
  }

  struct StopCase {
    int variable, extension, share;
    bool payload;
    StopCategory category;
  };

  void measure_stop(MachineRun& machine, const SavedState& start, const StopCase& one,
                    const ArmPlace& place) {
    static_cast<void>(machine.twin().robot().controller_manager().reset_stop());
    machine.restore(start);
    const ModelJoint& joint = arm_.joint(one.variable);
    const Status placed = machine.place(posed_joints(arm_.model(), place.q));
    if (!placed || !machine.run(kSettled)) return;
    const double speed = direction(one.variable, place.q) * joint.velocity * one.share / kPercent;
    const int link =
        machine.model().find_link(arm_.model().links[static_cast<std::size_t>(arm_.tool_link())].name);
    auto stop = stop_joint(machine, machine.model().find_joint(joint.name), link, speed, one.category);
    if (!stop) {
      out_.add({joint.name, Verdict::warned,
                fmt::format("the physics diverges during a stop of category {} at {} % of the speed",
                            number_of(one.category), one.share)});
      return;
    }
    StopCell& cell = cells_[{one.variable, number_of(one.category), one.share}];
    cell.time = std::max(cell.time, stop->figures.time);
    cell.tool_way = std::max(cell.tool_way, stop->tool_way);
    cell.stops = cell.stops && stop->figures.stopped;
    cell.ends_at_limit = cell.ends_at_limit || stop->ends_at_limit;
    if (stop->figures.largest_way <= cell.way) return;
    cell.way = stop->figures.largest_way;
    cell.extension = one.extension;
    cell.payload = one.payload;
    cell.q = place.q;
    cell.curve = {fmt::format("category {}", number_of(one.category)), stop->time, {}};
    for (const double position : stop->position)
      cell.curve.values.push_back(std::abs(position - stop->position.front()));
  }

  [[nodiscard]] std::string text_of(const StopCell& cell, bool slides) const {
    std::string out = slides ? fmt::format("{:.3f} s {:.1f} mm", cell.time, kMillimetres * cell.way)
                             : fmt::format("{:.3f} s {:.1f} deg", cell.time, cell.way / kDegree);
    if (!cell.stops) out = "at least " + out;
    out += fmt::format(", tool {:.0f} mm", kMillimetres * cell.tool_way);
    if (cell.ends_at_limit) out += " (onto its limit)";
    return out;
  }

  void add_joint(int variable) {
    const std::string& name = arm_.joint(variable).name;
    const bool slides = arm_.slides(variable);
    CheckItem item;
    item.subject = name;
    PlotPanel panel;
    panel.title = name + ": way after the stop, from the whole speed";
    panel.unit = slides ? "m" : "rad";
    for (const StopCategory category : kCategories) {
      const int number = number_of(category);
      std::string row;
      for (const int share : kStopShares) {
        const auto found = cells_.find({variable, number, share});
        if (found == cells_.end()) continue;
        row += fmt::format("{}{} %: {}", row.empty() ? "" : "; ", share, text_of(found->second, slides));
        if (share == kStopShares.back()) add_whole_speed(item, panel, number, found->second, slides);
      }
      if (!row.empty())
        out_.notes.push_back(fmt::format("{}, category {}, by the speed: {}", name, number, row));
    }
    if (item.message.empty()) return;
    item.curves.push_back(std::move(panel));
    out_.add(std::move(item));
  }

  void add_whole_speed(CheckItem& item, PlotPanel& panel, int category, StopCell& cell, bool slides) {
    const std::string subject = fmt::format("{}, category {}", item.subject, category);
    out_.metrics.push_back({"stopping time", subject, cell.time, "s"});
    if (slides) {
      out_.metrics.push_back({"stopping way", subject, kMillimetres * cell.way, "mm"});
    } else {
      out_.metrics.push_back({"stopping angle", subject, cell.way / kDegree, "deg"});
    }
    out_.metrics.push_back({"stopping way of the tool", subject, kMillimetres * cell.tool_way, "mm"});
    item.message +=
        fmt::format("{}category {}: {}", item.message.empty() ? "" : "; ", category, text_of(cell, slides));
    if (cell.q.size() > 0)
      item.poses.push_back({fmt::format("widest stop of category {}, {} % extended{}", category,
                                        cell.extension, cell.payload ? ", with payload" : ""),
                            posed_joints(arm_.model(), cell.q)});
    if (category == number_of(StopCategory::brake_and_hold)) {
      longest_ = std::max(longest_, cell.time);
      widest_ = std::max(widest_, cell.tool_way);
    }
    panel.curves.push_back(std::move(cell.curve));
  }

  struct CellKey {
    int variable, category, share;
    auto operator<=>(const CellKey&) const = default;
  };
  const CheckContext& context_;
  const ExtraArm& arm_;
  CheckResult& out_;
  std::vector<ArmPlace> places_;
  ArmPlace farthest_;
  std::map<CellKey, StopCell> cells_;
  double longest_ = 0, widest_ = 0;  // of category 2: s, m
};

}  // namespace

CheckResult check_stopping(const CheckContext& context) {
  const std::vector<ExtraArm> arms = extra_arms(context);
  if (arms.empty()) return not_applicable("X9", no_arm_reason(context));
  CheckResult out = begin_result("X9");
  double longest = 0, widest = 0;
  for (std::size_t i = 0; i < arms.size(); ++i) {
    StoppingJudge judge(context, arms[i], out);
    const auto count = static_cast<double>(arms.size()), done = static_cast<double>(i);
    judge.run(done / count, (done + 1) / count);
    longest = std::max(longest, judge.longest());
    widest = std::max(widest, judge.widest());
  }
  if (out.items.empty())
    return not_applicable("X9", out.notes.empty() ? "no joint can be stopped" : out.notes.front());
  out.summary =
      fmt::format("category 2: at most {:.3f} s, {:.0f} mm at the tool", longest, kMillimetres * widest);
  out.notes.emplace_back(
      "worst of 33, 66 and 100 % of the reach, without and with the suite's payload; the joint moves with "
      "gravity and its drives brake as in the twin's emergency stop, with up to their whole effort");
  out.notes.emplace_back(
      "categories 0 and 1 end without power and without brakes, which a description does not have: the arm "
      "falls");
  out.notes.emplace_back("a layout aid: it replaces no measurement and no risk assessment");
  return out;
}

}  // namespace doppel
