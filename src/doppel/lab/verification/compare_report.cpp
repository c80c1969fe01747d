// A comparison of engines as text, JSON and SVG.

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <numeric>

#include "doppel/lab/verification/compare.h"
#include "doppel/lab/verification/detail/plot.h"
#include "doppel/lab/verification/detail/report.h"

namespace doppel {
namespace {

using Json = nlohmann::ordered_json;

std::string value_of(double value, const char* unit) {
  const std::string_view of = unit;
  if (of == "rad" || of == "m") return size_of(value, unit);
  return value == 0 ? "0" : fmt::format("{:.1e}", value);
}

// "mujoco 2.2.2" is "mujoco" in the head of a column.
std::string short_name(const std::string& label) {
  return label.substr(0, label.find(' '));
}

class Table {
 public:
  explicit Table(std::vector<std::string> head) { add(std::move(head)); }
  void add(std::vector<std::string> cells) {
    widths_.resize(cells.size(), 0);
    for (std::size_t i = 0; i < cells.size(); ++i) widths_[i] = std::max(widths_[i], cells[i].size());
    rows_.push_back(std::move(cells));
  }
  // The first and the last column are left-aligned, numbers right-aligned.
  [[nodiscard]] std::string str() const {
    std::string out;
    for (const std::vector<std::string>& row : rows_) {
      std::string line = "  ";
      for (std::size_t i = 0; i < row.size(); ++i) {
        const bool left = i == 0 || i + 1 == row.size();
        line += left ? fmt::format("{:<{}}", row[i], widths_[i]) : fmt::format("{:>{}}", row[i], widths_[i]);
        line += "   ";
      }
      out += line.substr(0, line.find_last_not_of(' ') + 1) + "\n";
    }
    return out;
  }

 private:
  std::vector<std::vector<std::string>> rows_;
  std::vector<std::size_t> widths_;
};

std::string explained_by(const Difference& of, const std::string& feature) {
  switch (of.explanation) {
    case Explanation::same:
      return "the same";
    case Explanation::step:
      return "the step";
    case Explanation::modelling:
      return feature;
    case Explanation::unexplained:
      break;
  }
  return "UNEXPLAINED";
}

std::string table_of(const std::vector<Difference>& differences, const std::vector<std::string>& engines,
                     const std::string& feature, bool timed) {
  std::vector<std::string> head{"joint", "difference"};
  if (timed) head.emplace_back("at");
  for (const std::string& engine : engines) head.push_back(short_name(engine) + "'s own");
  head.emplace_back("explained by");
  Table table(head);
  for (const Difference& of : differences) {
    std::vector<std::string> row{of.name, value_of(of.largest, of.unit)};
    if (timed) row.push_back(fmt::format("{:.2f} s", of.at));
    for (const double own : of.own) row.push_back(value_of(own, of.unit));
    row.push_back(explained_by(of, feature));
    table.add(std::move(row));
  }
  return table.str();
}

const Difference* first_unexplained(const std::vector<Difference>& of) {
  const auto at = std::ranges::find(of, Explanation::unexplained, &Difference::explanation);
  return at == of.end() ? nullptr : &*at;
}

std::string largest_of(const std::vector<Difference>& joints) {
  std::string out;
  for (const char* const unit : {"rad", "m"}) {
    double largest = -1;
    for (const Difference& of : joints) {
      if (std::string_view(of.unit) == unit) largest = std::max(largest, of.largest);
    }
    if (largest >= 0) out += (out.empty() ? "" : " and ") + size_of(largest, unit);
  }
  return out;
}

Json json_of(const Difference& of, const std::vector<std::string>& engines) {
  Json own = Json::object();
  for (std::size_t i = 0; i < of.own.size(); ++i) own[engines[i]] = of.own[i];
  return {{"name", of.name}, {"unit", of.unit}, {"difference", of.largest},
          {"at", of.at},     {"own", own},      {"explanation", name_of(of.explanation)}};
}

Json json_of(const std::vector<Difference>& of, const std::vector<std::string>& engines) {
  Json out = Json::array();
  for (const Difference& difference : of) out.push_back(json_of(difference, engines));
  return out;
}

}  // namespace

std::string verdict_line(const StaticsComparison& statics) {
  const std::string head = fmt::format("{:<10}", "statics");
  if (const Difference* const link = first_unexplained(statics.links))
    return head +
           fmt::format("UNEXPLAINED: link '{}' differs by {}", link->name, size_of(link->largest, "m"));
  if (const Difference* const joint = first_unexplained(statics.joints))
    return head +
           fmt::format("UNEXPLAINED: joint '{}' differs by {:.1e} {}, the engines' own errors are {:.1e}",
                       joint->name, joint->largest, joint->unit,
                       std::accumulate(joint->own.begin(), joint->own.end(), 0.0));
  double pose = 0;
  for (const Difference& link : statics.links) pose = std::max(pose, link.largest);
  return head +
         fmt::format("the same: link poses to {:.0e}, efforts within rounding and step, in {} configurations",
                     pose, statics.configurations);
}

std::string verdict_line(const MotionComparison& motion) {
  const std::string head = fmt::format("{:<10}", name_of(motion.kind));
  if (!motion.ran_away.empty()) return head + "UNEXPLAINED: " + motion.ran_away.front() + " diverged";
  if (motion.joints.empty()) return head + "nothing moves";
  std::string tail = fmt::format("at most {} (tool {}) over {:g} s", largest_of(motion.joints),
                                 size_of(motion.tool_largest, "m"), motion.span);
  if (motion.chaotic_after) tail += fmt::format("; chaotic after {:g} s", *motion.chaotic_after);
  if (const Difference* const joint = first_unexplained(motion.joints))
    return head + fmt::format("UNEXPLAINED: joint '{}' by {}; {}", joint->name,
                              size_of(joint->largest, joint->unit), tail);
  if (!motion.feature.empty())
    return head + fmt::format("explained by {}, which the engines model in different ways: {}",
                              motion.feature, tail);
  const bool same = std::ranges::all_of(
      motion.joints, [](const Difference& of) { return of.explanation == Explanation::same; });
  return head + (same ? "the same: " : "explained by the step: ") + tail;
}

std::string comparison_text(const Comparison& of) {
  std::string engines;
  for (std::size_t i = 0; i < of.engines.size(); ++i)
    engines += (i == 0 ? "" : i + 1 == of.engines.size() ? " and " : ", ") + of.engines[i];
  std::string out = fmt::format("{} in world '{}': {}, steps of {:g} and {:g} ms over {:g} s\n\n", of.robot,
                                of.world, engines, of.step * 1e3, of.step * 500, of.duration);
  if (of.statics) {
    out += fmt::format("statics: efforts of {} configurations with random velocities\n",
                       of.statics->configurations);
    out += table_of(of.statics->joints, of.engines, "", false) + "\n";
  }
  for (const MotionComparison& motion : of.motions) {
    out += fmt::format("{}: {}\n", name_of(motion.kind), description_of(motion.kind));
    out += table_of(motion.joints, of.engines, motion.feature, true) + "\n";
  }
  if (of.statics) out += verdict_line(*of.statics) + "\n";
  for (const MotionComparison& motion : of.motions) out += verdict_line(motion) + "\n";
  return out;
}

std::string comparison_json(const Comparison& of) {
  Json out{{"version", 1},
           {"robot", of.robot},
           {"world", of.world},
           {"engines", of.engines},
           {"step", of.step},
           {"tool", of.tool},
           {"duration", of.duration},
           {"explained", of.explained()},
           {"motions", Json::array()}};
  if (of.statics) {
    out["statics"] = {{"verdict", verdict_line(*of.statics)},
                      {"configurations", of.statics->configurations},
                      {"links", json_of(of.statics->links, of.engines)},
                      {"joints", json_of(of.statics->joints, of.engines)}};
  }
  for (const MotionComparison& motion : of.motions) {
    Json entry{{"name", name_of(motion.kind)}, {"verdict", verdict_line(motion)}};
    entry["joints"] = json_of(motion.joints, of.engines);
    entry["tool"] = motion.tool_largest;
    entry["feature"] = motion.feature.empty() ? Json() : Json(motion.feature);
    entry["chaotic_after"] = motion.chaotic_after ? Json(*motion.chaotic_after) : Json();
    entry["ran_away"] = motion.ran_away;
    entry["span"] = motion.span;
    out["motions"].push_back(std::move(entry));
  }
  return out.dump(2) + "\n";
}

std::string comparison_svg(const Comparison& of, const MotionComparison& motion) {
  LogPlot plot(1, of.duration);
  plot.title(fmt::format("{}: {}", of.robot, description_of(motion.kind)),
             "difference of the worst joint, and the engines' own errors, rad");
  std::vector<PlottedCurve> curves{{"differ", motion.difference}};
  for (std::size_t i = 0; i < motion.own.size(); ++i)
    curves.push_back({short_name(of.engines[i]), motion.own[i]});
  plot.panel(0, verdict_line(motion), motion.time, curves, motion.chaotic_after.value_or(-1.0));
  return plot.finished();
}

}  // namespace doppel
