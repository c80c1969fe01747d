#include "doppel/validation/statics/self_collision_sweep.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <mutex>
#include <numbers>

#include "doppel/base/core/parallel_work.h"
#include "doppel/base/math/units.h"
#include "doppel/robot/collision/collision_scene.h"
#include "doppel/robot/reach/arm_reach.h"
#include "doppel/robot/semantics/self_collision.h"
#include "doppel/scenario/resolve/srdf_search.h"
#include "doppel/validation/statics/detail/audit_split.h"
#include "doppel/validation/statics/detail/visual_overlap.h"
#include "doppel/validation/statics/start_pose.h"

namespace doppel {
namespace {

constexpr int kMaxCorners = 1024;
constexpr double kGridStep = 15 * kDegree, kQuickGridStep = 45 * kDegree;
constexpr double kSlideSteps = 12;  // of a slide's range on the grid

struct Range {
  int q = -1;
  double low = 0, high = 0;
  bool slides = false;

  [[nodiscard]] double value(double share) const { return low + share * (high - low); }
};

// The joints that move by themselves; those without limits cover one turn, or 1 m to each side.
std::vector<Range> ranges_of(const Model& model) {
  std::vector<Range> out;
  for (const ModelJoint& joint : model.joints) {
    if (!joint.scalar() || joint.mimics()) continue;
    const bool slides = joint.type == JointType::prismatic;
    const double far = slides ? 1.0 : std::numbers::pi;
    out.push_back({joint.q, std::isfinite(joint.lower) ? joint.lower : -far,
                   std::isfinite(joint.upper) ? joint.upper : far, slides});
  }
  return out;
}

// The configurations of a sweep by their numbers: a sequence that fills the joint space evenly, the corners
// of the limits, and each pair of joints on a grid while the others are at the start.
class Configurations {
 public:
  // `max_grid`: the grid is coarser where it would have more configurations.
  Configurations(const Model& model, int samples, double grid_step, std::size_t max_grid, std::uint64_t seed)
      : model_(model), ranges_(ranges_of(model)), samples_(static_cast<std::size_t>(samples)), seed_(seed) {
    // Roberts 2018: the powers of the inverse of the root of x^(d + 1) = x + 1.
    double root = 1.5;
    const double d = static_cast<double>(std::max<std::size_t>(1, ranges_.size()));
    constexpr int kIterations = 60;
    for (int i = 0; i < kIterations; ++i) root = std::pow(1 + root, 1 / (d + 1));
    for (std::size_t i = 0; i < ranges_.size(); ++i)
      increments_.push_back(std::pow(1 / root, static_cast<double>(i + 1)));
    corners_ = ranges_.size() <= 10 ? std::size_t{1} << ranges_.size() : std::size_t{kMaxCorners};
    for (const Range& range : ranges_) {
      const double count = range.slides ? kSlideSteps : (range.high - range.low) / grid_step;
      steps_.push_back(static_cast<std::size_t>(std::clamp(std::ceil(count), 1.0, 48.0)) + 1);
    }
    while (count_pairs() > max_grid && coarsen()) is_coarse_ = true;
  }

  [[nodiscard]] std::size_t size() const { return samples_ + corners_ + grid_; }
  [[nodiscard]] std::size_t samples() const { return samples_; }
  // The grid is coarser than wanted, because the machine has many pairs of joints.
  [[nodiscard]] bool is_coarse() const { return is_coarse_; }

  [[nodiscard]] Eigen::VectorXd operator[](std::size_t i) const {
    Eigen::VectorXd q = model_.neutral();
    if (i < samples_) {
      for (std::size_t k = 0; k < ranges_.size(); ++k) {
        const double start = 0.5 + std::fmod(0.6180339887498949 * static_cast<double>(seed_ - 1), 1.0);
        set(q, k, std::fmod(start + static_cast<double>(i + 1) * increments_[k], 1.0));
      }
    } else if (i < samples_ + corners_) {
      set_corner(q, i - samples_);
    } else {
      set_grid(q, i - samples_ - corners_);
    }
    model_.apply_mimics(q);
    return q;
  }

 private:
  struct Pair {
    std::size_t a, b, begin;
  };
  // The configurations of the grid.
  std::size_t count_pairs() {
    pairs_.clear();
    grid_ = 0;
    for (std::size_t i = 0; i < ranges_.size(); ++i) {
      for (std::size_t k = i + 1; k < ranges_.size(); ++k) {
        pairs_.push_back({i, k, grid_});
        grid_ += steps_[i] * steps_[k];
      }
    }
    return grid_;
  }
  // False: each joint has its ends and its middle alone.
  bool coarsen() {
    constexpr std::size_t kMinSteps = 3;
    bool out = false;
    for (std::size_t& steps : steps_) {
      out = out || steps > kMinSteps;
      if (steps > kMinSteps) steps = std::max(kMinSteps, steps * 4 / 5);
    }
    return out;
  }
  void set(Eigen::VectorXd& q, std::size_t joint, double share) const {
    q[ranges_[joint].q] = ranges_[joint].value(share);
  }
  // With many joints the bits of a corner are mixed, so that corners that follow each other differ in all
  // joints.
  void set_corner(Eigen::VectorXd& q, std::size_t corner) const {
    std::uint64_t bits = ranges_.size() <= 10 ? corner : (corner + 1) * 0x9E3779B97F4A7C15ULL;
    for (std::size_t k = 0; k < ranges_.size(); ++k) {
      set(q, k, (bits >> (k % 64)) & 1U ? 1.0 : 0.0);
    }
  }
  void set_grid(Eigen::VectorXd& q, std::size_t index) const {
    const auto after = std::ranges::upper_bound(pairs_, index, {}, &Pair::begin);
    const Pair& pair = *(after - 1);
    const std::size_t place = index - pair.begin;
    const auto share = [&](std::size_t joint, std::size_t step) {
      return static_cast<double>(step) / static_cast<double>(steps_[joint] - 1);
    };
    set(q, pair.a, share(pair.a, place / steps_[pair.b]));
    set(q, pair.b, share(pair.b, place % steps_[pair.b]));
  }

  const Model& model_;
  std::vector<Range> ranges_;
  std::vector<double> increments_;
  std::vector<std::size_t> steps_;
  std::vector<Pair> pairs_;
  std::size_t samples_, corners_ = 0, grid_ = 0;
  std::uint64_t seed_;
  bool is_coarse_ = false;
};

// A pair of links that touch.
struct Touch {
  std::size_t in_samples = 0, all = 0;
  double deepest = 0;             // m
  std::size_t deepest_index = 0;  // of the configuration

  void merge(const Touch& other) {
    in_samples += other.in_samples;
    all += other.all;
    if (other.deepest > deepest || (other.deepest == deepest && other.deepest_index < deepest_index)) {
      deepest = other.deepest;
      deepest_index = other.deepest_index;
    }
  }
};
using Touches = std::map<std::pair<int, int>, Touch>;

class SweepWorker {
 public:
  SweepWorker(const std::shared_ptr<const CollisionScene>& scene, const Configurations& configurations)
      : context_(scene), configurations_(configurations) {}

  void look(std::size_t index) {
    context_.set_configuration(0, configurations_[index]);
    const auto& pairs = context_.scene().tested_pairs();
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      if (!context_.tested_closer(i, -kTouching)) continue;
      Touch& touch = touches_[{pairs[i].first.link, pairs[i].second.link}];
      Touch one;
      one.in_samples = index < configurations_.samples() ? 1 : 0;
      one.all = 1;
      one.deepest = std::max(0.0, -context_.distance(pairs[i].first, pairs[i].second).distance);
      one.deepest_index = index;
      if (touch.all == 0) touch.deepest_index = index;
      touch.merge(one);
    }
  }
  [[nodiscard]] const Touches& touches() const { return touches_; }

 private:
  CollisionContext context_;
  const Configurations& configurations_;
  Touches touches_;
};

Touches sweep(const CheckContext& context, const std::shared_ptr<const CollisionScene>& scene,
              const Configurations& configurations) {
  Touches out;
  std::mutex merging;
  constexpr std::size_t kBlock = 64;  // configurations that a thread takes at once
  const std::size_t blocks = (configurations.size() + kBlock - 1) / kBlock;
  parallel_work(blocks, context.threads, [&] {
    auto worker =
        std::shared_ptr<SweepWorker>(new SweepWorker(scene, configurations), [&](SweepWorker* ended) {
          const std::lock_guard lock(merging);
          for (const auto& [pair, touch] : ended->touches()) {
            const auto [place, is_new] = out.try_emplace(pair, touch);
            if (!is_new) place->second.merge(touch);
          }
          delete ended;
        });
    return [&, worker = std::move(worker)](std::size_t block) {
      const std::size_t end = std::min(configurations.size(), (block + 1) * kBlock);
      for (std::size_t i = block * kBlock; i < end; ++i) worker->look(i);
      context.report(static_cast<double>(block) / static_cast<double>(blocks));
    };
  });
  return out;
}

std::string pair_name(const Model& model, const std::pair<int, int>& pair) {
  return model.links[static_cast<std::size_t>(pair.first)].name + " and " +
         model.links[static_cast<std::size_t>(pair.second)].name;
}

PosedEvidence witness(const Model& model, const std::pair<int, int>& pair, const Eigen::VectorXd& q,
                      std::string caption) {
  return {std::move(caption),
          posed_joints(model, q),
          {model.links[static_cast<std::size_t>(pair.first)].name,
           model.links[static_cast<std::size_t>(pair.second)].name}};
}

// The configurations that the robot takes by itself: its start, and the named ones of the suite.
std::vector<NamedConfiguration> named_configurations(const CheckContext& context) {
  const Model& model = *context.subject.model;
  std::vector<NamedConfiguration> out{{"the start pose", start_configuration(context.subject)}};
  for (const auto& [name, joints] : context.suite.poses) {
    Eigen::VectorXd q = model.neutral();
    for (const auto& [joint, position] : joints) {
      if (const int index = model.find_joint(joint); index >= 0)
        q[model.joints[static_cast<std::size_t>(index)].q] = position;
    }
    model.apply_mimics(q);
    out.push_back({"pose '" + name + "'", q});
  }
  return out;
}

void judge_named(const CheckContext& context, const std::shared_ptr<const CollisionScene>& scene,
                 CheckResult& out) {
  const Model& model = *context.subject.model;
  CollisionContext bodies(scene);
  for (const auto& [name, q] : named_configurations(context)) {
    bodies.set_configuration(0, q);
    const auto& pairs = scene->tested_pairs();
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      if (!bodies.tested_closer(i, -kTouching)) continue;
      const std::pair links(pairs[i].first.link, pairs[i].second.link);
      CheckItem& item = out.add(
          {pair_name(model, links), Verdict::failed,
           fmt::format("touch at {}, {:.1f} mm deep", name,
                       1e3 * std::max(0.0, -bodies.distance(pairs[i].first, pairs[i].second).distance)),
           "another pose, or collision shapes that fit the parts better"});
      item.poses.push_back(witness(model, links, q, name));
    }
  }
}

// The link of an overlap that has no collision shape; empty: both have.
std::string bare_link(const Model& model, const CollisionScene& scene, const VisualOverlap& overlap) {
  for (const int link : {overlap.links.first, overlap.links.second})
    if (!scene.has_shape({0, link})) return model.links[static_cast<std::size_t>(link)].name;
  return "";
}

// What is seen to overlap, and is not in the collision shapes: neither a planner nor the simulation knows it.
// Where a machine gets only by a few of its configurations, it warns.
void judge_visuals(const CheckContext& context, const CollisionScene& scene,
                   const Configurations& configurations, CheckResult& out) {
  const Model& model = *context.subject.model;
  std::vector<Eigen::VectorXd> samples;
  const auto count = static_cast<std::size_t>(context.amount(100, 500, 2000));
  for (std::size_t i = 0; i < std::min(count, configurations.samples()); ++i)
    samples.push_back(configurations[i]);
  for (const VisualOverlap& overlap :
       find_visual_overlaps(context, scene, named_configurations(context), samples, out.notes)) {
    const std::string bare = bare_link(model, scene, overlap);
    const double share = static_cast<double>(overlap.samples) / static_cast<double>(samples.size());
    const std::string place = overlap.name.empty()
                                  ? fmt::format("in {:.2g} % of the configurations", 100 * share)
                                  : "at " + overlap.name;
    CheckItem item{
        pair_name(model, overlap.links),
        !overlap.name.empty() || overlap.is_frequent ? Verdict::failed : Verdict::warned,
        fmt::format("visual shapes overlap by more than {:.0f} mm {}, and {}", 1e3 * kVisualOverlap, place,
                    bare.empty() ? "collision shapes do not" : "'" + bare + "' has no collision shape"),
        bare.empty() ? "collision shapes that cover the visual ones"
                     : "a <collision> of '" + bare + "' that covers its visual shapes"};
    const std::string& second = model.links[static_cast<std::size_t>(overlap.links.second)].name;
    if (const Link* const source = context.subject.description().find_link(bare.empty() ? second : bare))
      item.where = source->source;
    item.poses.push_back(witness(model, overlap.links, overlap.q, "the visual shapes overlap"));
    out.add(std::move(item));
  }
}

bool has_hull(const CollisionScene& scene, BodyId body) {
  const auto& shapes = scene.instances()[static_cast<std::size_t>(body.instance)].shapes;
  return std::ranges::any_of(shapes[static_cast<std::size_t>(body.link)], [](const CollisionShape& shape) {
    return std::holds_alternative<SharedHull>(shape.geometry);
  });
}

// False: only joints that belong to no arm, as those of a gripper, move the links against each other.
bool is_moved_by_arm(const Subject& subject, const std::pair<int, int>& links) {
  if (subject.arms.empty()) return true;
  return std::ranges::any_of(subject.arms, [&](const ArmGroup& arm) {
    const std::vector<std::uint32_t> moved = moving_variables(*subject.model, arm.chain);
    return moved[static_cast<std::size_t>(links.first)] != moved[static_cast<std::size_t>(links.second)];
  });
}

// Pairs that are not tested, because they touch where all joints are neutral. If they touch in all other
// configurations, too, their shapes overlap by design; else the machine starts in a collision.
void judge_touching_start(const CheckContext& context, const CollisionScene& scene,
                          const Configurations& configurations, CheckResult& out) {
  constexpr std::size_t kSamples = 200;
  constexpr double kAlways = 0.95, kFaceToFace = 1e-3;  // kFaceToFace: m
  const Model& model = *context.subject.model;
  CollisionContext bodies(scene.allowing({}));
  for (const AllowedPair& pair : scene.allowed_pairs()) {
    if (pair.reason != kTouchAtStart) continue;
    std::size_t touching = 0;
    for (std::size_t i = 0; i < kSamples; ++i) {
      bodies.set_configuration(0, configurations[i]);
      touching += bodies.closer(pair.a, pair.b, -kTouching) ? 1 : 0;
    }
    if (static_cast<double>(touching) >= kAlways * kSamples) continue;
    bodies.set_configuration(0, model.neutral());
    const std::pair links(pair.a.link, pair.b.link);
    const double depth = std::max(0.0, -bodies.distance(pair.a, pair.b).distance);
    // The fingers of a closed gripper touch. The depth of meshes is that of their hulls, which hollow fingers
    // do not fill.
    const bool is_hollow = has_hull(scene, pair.a) || has_hull(scene, pair.b);
    if (depth < kFaceToFace || (is_hollow && !is_moved_by_arm(context.subject, links))) {
      out.notes.push_back(pair_name(model, links) +
                          " touch where all joints are at zero, as closed fingers do");
      continue;
    }
    CheckItem& item =
        out.add({pair_name(model, links), Verdict::failed,
                 fmt::format("touch where all joints are at zero, {:.1f} mm deep, and not in {:.0f} % of "
                             "all other configurations",
                             1e3 * depth, 100.0 * static_cast<double>(kSamples - touching) / kSamples),
                 "another zero of a joint, or collision shapes that fit the parts better"});
    item.poses.push_back(witness(model, links, model.neutral(), "all joints at zero"));
  }
}

// Pairs that a planner does not check and that touch.
void judge_srdf(const CheckContext& context, const Touches& touches, const Configurations& configurations,
                CheckResult& out) {
  const Model& model = *context.subject.model;
  PackageResolver resolver = context.subject.compiled->resolver;
  Diagnostics skipped;
  for (const FoundSrdf& found :
       find_srdf(context.subject.description(), context.subject.target, resolver, skipped)) {
    for (const SrdfLinkPair& disabled : found.srdf.disabled) {
      const int a = model.find_link(disabled.link1), b = model.find_link(disabled.link2);
      const auto touch = touches.find({std::min(a, b), std::max(a, b)});
      if (a < 0 || b < 0 || touch == touches.end()) continue;
      CheckItem& item =
          out.add({pair_name(model, touch->first), Verdict::failed,
                   fmt::format("the SRDF says that they need no checking, and they touch, {:.1f} mm deep",
                               1e3 * touch->second.deepest),
                   "remove the <disable_collisions>; doppel convert --to srdf writes the pairs that are safe",
                   disabled.source});
      item.poses.push_back(
          witness(model, touch->first, configurations[touch->second.deepest_index], "the deepest overlap"));
    }
  }
}

// Pairs that the audit saw touch in its own configurations, and this sweep did not.
void add_hidden_of_audit(const CheckContext& context, CheckResult& out) {
  CheckResult found;
  add_findings(context.subject.audit, AuditPart::collisions, found);
  for (CheckItem& item : found.items) {
    const bool is_known = std::ranges::any_of(out.items, [&](const CheckItem& other) {
      const std::size_t middle = other.subject.find(" and ");
      return other.verdict == Verdict::failed && middle != std::string::npos &&
             item.subject.find("'" + other.subject.substr(0, middle) + "'") != std::string::npos &&
             item.subject.find("'" + other.subject.substr(middle + 5) + "'") != std::string::npos;
    });
    if (!is_known) out.add(std::move(item));
  }
}

void report_pairs(const CheckContext& context, const Touches& touches, const Configurations& configurations,
                  CheckResult& out) {
  const Model& model = *context.subject.model;
  const auto all = static_cast<double>(configurations.samples());
  for (const auto& [pair, touch] : touches) {
    const double share = static_cast<double>(touch.in_samples) / all;
    CheckItem item;
    item.subject = pair_name(model, pair);
    item.message = touch.in_samples > 0
                       ? fmt::format("touch in {:.2g} % of the configurations, {:.1f} mm deep at most",
                                     100 * share, 1e3 * touch.deepest)
                       : fmt::format("touch only in corners or on the grid, {:.1f} mm deep at most",
                                     1e3 * touch.deepest);
    if (context.suite.max_share && share > *context.suite.max_share) {
      item.verdict = Verdict::failed;
      item.message += fmt::format(" (limit {:.3g} %)", 100 * *context.suite.max_share);
      item.fix = "tighter joint limits, or another shape";
    }
    item.poses.push_back(witness(model, pair, configurations[touch.deepest_index], "the deepest overlap"));
    out.add(std::move(item));
    out.metrics.push_back(
        {"share", pair_name(model, pair), 100 * share, "%",
         context.suite.max_share ? std::optional(100 * *context.suite.max_share) : std::nullopt});
  }
}

void report_unchecked(const CollisionScene& scene, CheckResult& out) {
  std::map<std::string, std::size_t> reasons;
  for (const AllowedPair& pair : scene.allowed_pairs()) {
    const bool is_joined = pair.reason.starts_with("joined") || pair.reason.starts_with("both");
    ++reasons[is_joined ? "of one body, or joined by a joint" : pair.reason];
  }
  std::string text;
  for (const auto& [reason, count] : reasons)
    text += fmt::format("{}{} {}", text.empty() ? "" : ", ", count, reason);
  if (!text.empty()) out.notes.push_back("pairs that nobody checks: " + text);
}

}  // namespace

CheckResult check_self_collision(const CheckContext& context) {
  const Subject& subject = context.subject;
  CheckResult out = begin_result("T3");
  Diagnostics notes;
  const std::shared_ptr<const CollisionScene> scene =
      reach_scene(subject.description(), subject.model, nullptr, {}, notes);
  for (const Diagnostic& note : notes.all()) out.notes.push_back(note.message);
  report_unchecked(*scene, out);
  if (scene->tested_pairs().empty())
    return not_applicable("T3", "no two links with collision shapes can move against each other");
  const Configurations configurations(*subject.model, context.amount(2000, 10'000, 100'000),
                                      context.effort == Effort::quick ? kQuickGridStep : kGridStep,
                                      static_cast<std::size_t>(context.amount(10'000, 100'000, 1'000'000)),
                                      context.seed);
  if (configurations.is_coarse()) {
    out.notes.push_back(
        "the grid of pairs of joints is coarser than meant, because the machine has many pairs");
  }
  judge_named(context, scene, out);
  judge_touching_start(context, *scene, configurations, out);
  judge_visuals(context, *scene, configurations, out);
  const Touches touches = sweep(context, scene, configurations);
  judge_srdf(context, touches, configurations, out);
  add_hidden_of_audit(context, out);
  report_pairs(context, touches, configurations, out);
  const std::size_t never = scene->tested_pairs().size() - touches.size();
  out.notes.push_back(fmt::format(
      "{} of {} pairs never touched: each in at most {:.2g} % of the configurations, at 95 %", never,
      scene->tested_pairs().size(), 300.0 / static_cast<double>(configurations.samples())));
  out.summary =
      fmt::format("{} configurations, {} of {} pairs can touch{}", configurations.size(), touches.size(),
                  scene->tested_pairs().size(), out.verdict == Verdict::failed ? "" : "; the start is free");
  return out;
}

}  // namespace doppel
