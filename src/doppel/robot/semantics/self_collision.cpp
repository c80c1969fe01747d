#include "doppel/robot/semantics/self_collision.h"

#include <algorithm>
#include <memory>
#include <numbers>
#include <optional>

namespace doppel {
namespace {

constexpr int kAlwaysSamples = 200;
constexpr double kAlwaysFraction = 0.95;  // of them, as in MoveIt
constexpr int kProgressEvery = 100;       // samples

// splitmix64 (Steele, Lea, Flood 2014), as a number in [0, 1).
double next_number(std::uint64_t& state) {
  state += 0x9E3779B97F4A7C15ull;
  std::uint64_t z = state;
  z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9ull;
  z = (z ^ (z >> 27)) * 0x94D049BB133111EBull;
  return static_cast<double>((z ^ (z >> 31)) >> 11) * 0x1p-53;
}

// Shoemake 1992: evenly over all rotations.
Eigen::Quaterniond next_rotation(std::uint64_t& state) {
  const double u = next_number(state), v = 2 * std::numbers::pi * next_number(state),
               w = 2 * std::numbers::pi * next_number(state);
  const double a = std::sqrt(1 - u), b = std::sqrt(u);
  return {b * std::cos(w), a * std::sin(v), a * std::cos(v), b * std::sin(w)};
}

struct Pair {
  int a, b;               // links
  bool collided = false;  // in any sample
  int times = 0;          // in the first kAlwaysSamples
};

class Sampling {
 public:
  Sampling(std::shared_ptr<const CollisionScene> scene, const SelfCollisionOptions& options)
      : model_(*scene->instances().front().model), options_(options), context_(std::move(scene)) {}

  SelfCollisions run() {
    gather_pairs();
    out_.checked_pairs = static_cast<int>(pairs_.size());
    context_.set_configuration(0, model_.neutral());
    settle([this](const Pair& pair) { return adjacent(pair) || touch(pair); },
           [this](const Pair& pair) {
             return adjacent(pair) ? DisabledReason::adjacent : DisabledReason::by_default;
           });
    if (!sample()) return {{}, out_.checked_pairs, true};
    const int counted = std::min(options_.samples, kAlwaysSamples);
    settle([&](const Pair& pair) { return counted > 0 && pair.times >= kAlwaysFraction * counted; },
           [](const Pair&) { return DisabledReason::always; });
    settle([this](const Pair& pair) { return options_.find_never && options_.samples > 0 && !pair.collided; },
           [](const Pair&) { return DisabledReason::never; });
    std::sort(out_.disabled.begin(), out_.disabled.end(), [](const DisabledPair& x, const DisabledPair& y) {
      return std::pair(x.link_a, x.link_b) < std::pair(y.link_a, y.link_b);
    });
    return std::move(out_);
  }

 private:
  [[nodiscard]] bool solid(int link) const { return context_.scene().has_shape({0, link}); }

  void gather_pairs() {
    const int count = static_cast<int>(model_.links.size());
    for (int a = 0; a < count; ++a) {
      for (int b = a + 1; solid(a) && b < count; ++b) {
        if (solid(b)) pairs_.push_back({a, b});
      }
    }
  }

  // Connected by a joint, or only by links without shapes.
  [[nodiscard]] bool adjacent(const Pair& pair) const {
    for (int at = pair.b; model_.links[at].joint >= 0;) {
      at = model_.joints[model_.links[at].joint].parent_link;
      if (at == pair.a) return true;
      if (solid(at)) return false;
    }
    return false;
  }

  [[nodiscard]] bool touch(const Pair& pair) { return context_.closer({0, pair.a}, {0, pair.b}, -kTouching); }

  template <class Is, class Why>
  void settle(Is&& is, Why&& why) {
    std::erase_if(pairs_, [&](const Pair& pair) {
      if (!is(pair)) return false;
      out_.disabled.push_back({pair.a, pair.b, why(pair)});
      return true;
    });
  }

  // Every pair in the first samples, afterwards only those that have never touched. False: cancelled.
  bool sample() {
    std::uint64_t state = options_.seed;
    for (int i = 0; i < options_.samples; ++i) {
      if (i % kProgressEvery == 0 && options_.progress &&
          !options_.progress(static_cast<double>(i) / options_.samples)) {
        return false;
      }
      context_.set_configuration(0, random_configuration(model_, state));
      for (Pair& pair : pairs_) {
        if (i >= kAlwaysSamples && pair.collided) continue;
        // A pair that has missed so often cannot touch always any more.
        if (!options_.find_never && i - pair.times > (1 - kAlwaysFraction) * kAlwaysSamples) continue;
        if (!touch(pair)) continue;
        pair.collided = true;
        pair.times += i < kAlwaysSamples ? 1 : 0;
      }
    }
    return !options_.progress || options_.progress(1.0);
  }

  const Model& model_;
  const SelfCollisionOptions& options_;
  CollisionContext context_;
  std::vector<Pair> pairs_;
  SelfCollisions out_;
};

// The robot without the shapes of links that are in no pair.
SceneInstance only_links_of(const std::vector<std::pair<int, int>>& pairs, const RobotDescription& robot,
                            const Model& model) {
  SceneInstance out = described_robot(robot, model);
  std::vector<bool> used(model.links.size(), false);
  for (const auto& [a, b] : pairs)
    used[static_cast<std::size_t>(a)] = used[static_cast<std::size_t>(b)] = true;
  for (std::size_t link = 0; link < used.size(); ++link) {
    if (!used[link]) out.shapes[link].clear();
  }
  return out;
}

}  // namespace

std::string_view to_string(DisabledReason reason) {
  switch (reason) {
    case DisabledReason::adjacent:
      return "Adjacent";
    case DisabledReason::by_default:
      return "Default";
    case DisabledReason::always:
      return "Always";
    case DisabledReason::never:
      break;
  }
  return "Never";
}

Eigen::VectorXd random_configuration(const Model& model, std::uint64_t& state) {
  Eigen::VectorXd q = model.neutral();
  for (const ModelJoint& joint : model.joints) {
    const auto within = [&state](double low, double high) { return low + (high - low) * next_number(state); };
    const bool limited = std::isfinite(joint.lower) && std::isfinite(joint.upper);
    const double reach = joint.type == JointType::prismatic ? 1.0 : std::numbers::pi;
    if (joint.scalar()) {
      if (!joint.mimics()) q[joint.q] = limited ? within(joint.lower, joint.upper) : within(-reach, reach);
    } else if (joint.type == JointType::planar) {
      q.segment<3>(joint.q) << within(-1, 1), within(-1, 1), within(-reach, reach);
    } else if (joint.type == JointType::floating) {
      q.segment<3>(joint.q) << within(-1, 1), within(-1, 1), within(-1, 1);
      q.segment<4>(joint.q + 3) = next_rotation(state).coeffs();
    }
  }
  model.apply_mimics(q);
  return q;
}

SelfCollisions find_self_collisions(const RobotDescription& robot, const Model& model,
                                    const SelfCollisionOptions& options) {
  return find_self_collisions(
      std::make_shared<const CollisionScene>(std::vector{described_robot(robot, model)},
                                             SceneOptions{.detail = options.detail}),
      options);
}

SelfCollisions find_self_collisions(std::shared_ptr<const CollisionScene> scene,
                                    const SelfCollisionOptions& options) {
  return Sampling(std::move(scene), options).run();
}

std::vector<TouchingPair> find_touching(const RobotDescription& robot, const Model& model,
                                        const std::vector<std::pair<int, int>>& pairs,
                                        const SelfCollisionOptions& options) {
  CollisionContext context(std::make_shared<const CollisionScene>(
      std::vector{only_links_of(pairs, robot, model)}, SceneOptions{.detail = options.detail}));
  std::vector<std::optional<Eigen::VectorXd>> found(pairs.size());
  Eigen::VectorXd q = model.neutral();
  std::uint64_t state = options.seed;
  std::size_t open = pairs.size();
  for (int sample = 0; sample <= options.samples && open > 0; ++sample) {
    context.set_configuration(0, q);
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      if (found[i] || !context.closer({0, pairs[i].first}, {0, pairs[i].second}, -kTouching)) continue;
      found[i] = q;
      --open;
    }
    q = random_configuration(model, state);
  }
  std::vector<TouchingPair> out;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    if (found[i]) out.push_back({pairs[i].first, pairs[i].second, *found[i]});
  }
  return out;
}

}  // namespace doppel
