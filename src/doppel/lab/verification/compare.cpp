#include "doppel/lab/verification/compare.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <optional>

#include "doppel/base/core/names.h"
#include "doppel/lab/verification/detail/compare.h"
#include "doppel/lab/verification/verify.h"

namespace doppel {
namespace {

// A feature that engines model in different ways, and the function that removes it from a robot.
struct Feature {
  const char* name;
  bool (*has)(const MotionSubject& subject);
  void (*remove)(MotionSubject& subject);
};

bool any_joint(const MotionSubject& subject, bool (*has)(const ModelJoint& joint)) {
  return std::ranges::any_of(subject.robot.model->joints, has);
}

void change_joints(MotionSubject& subject, void (*change)(ModelJoint& joint)) {
  Model model = *subject.robot.model;
  std::ranges::for_each(model.joints, change);
  subject.robot.model = std::make_shared<const Model>(std::move(model));
}

constexpr Feature kFeatures[] = {
    {"contacts",
     [](const MotionSubject& subject) {
       return std::ranges::any_of(subject.robot.shapes, [](const auto& of) { return !of.empty(); });
     },
     [](MotionSubject& subject) {
       for (auto& shapes : subject.robot.shapes) shapes.clear();
     }},
    {"joint friction",
     [](const MotionSubject& subject) {
       return any_joint(subject, [](const ModelJoint& joint) { return joint.friction > 0; });
     },
     [](MotionSubject& subject) { change_joints(subject, [](ModelJoint& joint) { joint.friction = 0; }); }},
    {"joint limits",
     [](const MotionSubject& subject) {
       return any_joint(subject, [](const ModelJoint& joint) {
         return joint.scalar() && (std::isfinite(joint.lower) || std::isfinite(joint.upper));
       });
     },
     [](MotionSubject& subject) {
       change_joints(subject, [](ModelJoint& joint) {
         joint.lower = -kInfinity;
         joint.upper = kInfinity;
       });
     }},
    {"mimics",
     [](const MotionSubject& subject) {
       return any_joint(subject, [](const ModelJoint& joint) { return joint.mimics(); });
     },
     [](MotionSubject& subject) {
       change_joints(subject, [](ModelJoint& joint) { joint.mimic_leader = -1; });
     }},
};

struct EngineRuns {
  MotionRecord coarse, fine;  // h, h/2
};

std::size_t common_samples(const std::vector<EngineRuns>& runs) {
  std::size_t out = runs.front().coarse.x.size();
  for (const EngineRuns& of : runs) out = std::min({out, of.coarse.x.size(), of.fine.x.size()});
  return out;
}

std::vector<EngineRuns> run_all(const std::vector<ComparedEngine>& engines, MotionKind kind,
                                const std::string& tool, const CompareOptions& options) {
  std::vector<EngineRuns> out;
  // One start and one goal for all engines: those that the first engine finds free of contacts.
  const Motion plan(engines.front().subject, kind, tool);
  for (const ComparedEngine& engine : engines) {
    if (options.on_run) options.on_run(name_of(kind), engine.label);
    const Motion motion(engine.subject, plan, tool);
    out.push_back({motion.run(options.duration, 1), motion.run(options.duration, 2)});
  }
  return out;
}

// Fills differences and curves over the first `samples`.
void measure(const std::vector<EngineRuns>& runs, const std::vector<Coordinate>& coordinates,
             std::size_t samples, MotionComparison& out) {
  const std::size_t count = runs.size();
  for (const Coordinate& coordinate : coordinates)
    out.joints.push_back(
        {coordinate.name, coordinate.slides ? "m" : "rad", 0, 0, std::vector<double>(count, 0.0), {}});
  out.own.assign(count, {});
  for (std::size_t i = 0; i < samples; ++i) {
    double farthest = 0;
    std::vector<double> own(count, 0.0);
    for (std::size_t j = 0; j < coordinates.size(); ++j) {
      Difference& joint = out.joints[j];
      const auto at = static_cast<Eigen::Index>(j);
      for (std::size_t a = 0; a < count; ++a) {
        const double error = std::abs(runs[a].coarse.x[i][at] - runs[a].fine.x[i][at]);
        joint.own[a] = std::max(joint.own[a], error);
        own[a] = std::max(own[a], error);
        for (std::size_t b = 0; b < a; ++b) {
          const double difference = std::abs(runs[a].fine.x[i][at] - runs[b].fine.x[i][at]);
          farthest = std::max(farthest, difference);
          if (difference <= joint.largest) continue;
          joint.largest = difference;
          joint.at = runs[a].fine.time[i];
        }
      }
    }
    for (std::size_t a = 1; a < count; ++a)
      out.tool_largest = std::max(out.tool_largest, (runs[a].fine.tool[i] - runs[0].fine.tool[i]).norm());
    out.time.push_back(runs[0].fine.time[i]);
    out.difference.push_back(farthest);
    for (std::size_t a = 0; a < count; ++a) out.own[a].push_back(own[a]);
  }
  for (Difference& joint : out.joints) joint.explanation = explanation_of(joint, kSame);
  out.span = out.time.empty() ? 0.0 : out.time.back();
}

bool unexplained(const std::vector<Difference>& of) {
  return std::ranges::any_of(of,
                             [](const Difference& d) { return d.explanation == Explanation::unexplained; });
}

// The number of samples before the motion from a start changed by kPerturbation diverges from this one.
std::size_t predictable(const std::vector<ComparedEngine>& engines, MotionKind kind, const std::string& tool,
                        const CompareOptions& options, const EngineRuns& first, std::size_t samples) {
  const Motion motion(engines.front().subject, kind, tool);
  const MotionRecord beside = motion.run(options.duration, 1, kPerturbation);
  for (std::size_t i = 0; i < std::min(samples, beside.x.size()); ++i) {
    if (beside.x[i].size() > 0 &&
        (beside.x[i] - first.coarse.x[i]).lpNorm<Eigen::Infinity>() > kChaoticGrowth * kPerturbation)
      return i;
  }
  return samples;
}

// True if the engines agree when all of them run without the feature.
bool agree_without(const Feature& feature, const std::vector<ComparedEngine>& engines, MotionKind kind,
                   const std::string& tool, const CompareOptions& options, std::size_t samples) {
  std::vector<ComparedEngine> changed = engines;
  for (ComparedEngine& engine : changed) feature.remove(engine.subject);
  const std::vector<EngineRuns> runs = run_all(changed, kind, tool, options);
  MotionComparison found;
  const Motion motion(changed.front().subject, kind, tool);
  measure(runs, motion.coordinates(), std::min(samples, common_samples(runs)), found);
  return !unexplained(found.joints);
}

MotionComparison compare_motion(const std::vector<ComparedEngine>& engines, MotionKind kind,
                                const std::string& tool, const CompareOptions& options) {
  MotionComparison out;
  out.kind = kind;
  const Motion motion(engines.front().subject, kind, tool);
  const std::vector<EngineRuns> runs = run_all(engines, kind, tool, options);
  for (std::size_t e = 0; e < engines.size(); ++e) {
    if (runs[e].coarse.diverged || runs[e].fine.diverged) out.ran_away.push_back(engines[e].label);
  }
  const std::size_t common = common_samples(runs);
  const std::size_t samples = predictable(engines, kind, tool, options, runs.front(), common);
  if (samples < common) out.chaotic_after = runs.front().coarse.time[samples];
  measure(runs, motion.coordinates(), samples, out);
  if (kind != MotionKind::smooth && unexplained(out.joints)) {
    for (const Feature& feature : kFeatures) {
      if (!feature.has(engines.front().subject)) continue;
      if (!agree_without(feature, engines, kind, tool, options, samples)) continue;
      out.feature = feature.name;
      for (Difference& joint : out.joints) {
        if (joint.explanation == Explanation::unexplained) joint.explanation = Explanation::modelling;
      }
      break;
    }
  }
  lead_with_cause(motion.model(), out.joints);
  return out;
}

std::string tool_of(const ComparedEngine& engine, const std::string& asked) {
  const Model& model = *engine.subject.robot.model;
  const std::string tool = asked.empty() ? choose_tool(model) : asked;
  if (model.find_link(tool) >= 0) return tool;
  std::vector<std::string> links;
  for (const ModelLink& link : model.links) links.push_back(link.name);
  throw InputError("compare.tool", {}, "the robot has no link '" + tool + "'" + did_you_mean(tool, links),
                   "give a link of the robot with --tool; `doppel tree` prints them");
}

}  // namespace

const char* name_of(Explanation explanation) {
  constexpr std::array kNames{"same", "step", "modelling", "unexplained"};
  return kNames[static_cast<std::size_t>(explanation)];
}

Explanation explanation_of(const Difference& difference, double floor) {
  if (difference.largest <= floor) return Explanation::same;
  const double own = std::accumulate(difference.own.begin(), difference.own.end(), 0.0);
  return difference.largest <= kOwnErrors * own ? Explanation::step : Explanation::unexplained;
}

void lead_with_cause(const Model& model, std::vector<Difference>& joints) {
  const auto is_unexplained = [&](const std::string& name) {
    return std::ranges::any_of(joints, [&](const Difference& of) {
      return of.name == name && of.explanation == Explanation::unexplained;
    });
  };
  // The number of unexplained joints below each joint; the model has parents first.
  std::vector<int> below(model.joints.size(), 0);
  for (std::size_t j = model.joints.size(); j-- > 0;) {
    const int parent = model.links[static_cast<std::size_t>(model.joints[j].parent_link)].joint;
    if (parent >= 0)
      below[static_cast<std::size_t>(parent)] += below[j] + (is_unexplained(model.joints[j].name) ? 1 : 0);
  }
  const auto rank = [&](const Difference& of) {
    if (of.explanation != Explanation::unexplained) return 1 << 20;
    const int joint = model.find_joint(of.name);
    return joint < 0 ? 0 : below[static_cast<std::size_t>(joint)];
  };
  std::ranges::stable_sort(joints,
                           [&](const Difference& a, const Difference& b) { return rank(a) < rank(b); });
}

bool Comparison::explained() const {
  if (statics && (unexplained(statics->links) || unexplained(statics->joints))) return false;
  return std::ranges::none_of(
      motions, [](const MotionComparison& of) { return !of.ran_away.empty() || unexplained(of.joints); });
}

Comparison compare_engines(const std::vector<ComparedEngine>& asked, const CompareOptions& options) {
  std::vector<ComparedEngine> engines = asked;
  for (ComparedEngine& engine : engines)
    engine.subject.world.step -= engine.subject.world.step % 2;  // times are whole nanoseconds
  Comparison out;
  const MotionSubject& first = engines.front().subject;
  out.robot = first.robot.model->name;
  out.world = first.world.name;
  out.step = to_seconds(first.world.step);
  out.duration = options.duration;
  out.tool = tool_of(engines.front(), options.tool);
  for (const ComparedEngine& engine : engines) out.engines.push_back(engine.label);
  if (options.statics) {
    if (options.on_run) options.on_run("statics", "all engines");
    out.statics = compare_statics(engines);
  }
  for (const MotionKind kind : options.motions)
    out.motions.push_back(compare_motion(engines, kind, out.tool, options));
  return out;
}

}  // namespace doppel
