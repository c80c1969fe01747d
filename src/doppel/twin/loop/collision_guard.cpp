#include "doppel/twin/loop/collision_guard.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <set>

namespace doppel {
namespace {

constexpr double kMotion = 0.02;              // rad or m of the fastest joint between two checked states
constexpr Duration kSampling{5'000'000};      // between two samples of a path, at least
constexpr std::int64_t kMaxSamples = 20'000;  // of a path
constexpr double kPenetration = -1e-3;        // m: what permits() refuses, deeper than what check() does
constexpr double kShareOfPeriod = 0.2;        // that permits() may take
constexpr int kCostRuns = 50;

std::shared_ptr<const CollisionScene> make_scene(const Instance& robot,
                                                 const std::vector<KeepOutBox>& boxes) {
  const ModelInstance& made_of = robot.made_of();
  std::vector<SceneInstance> instances;
  SceneInstance arm;
  arm.name = made_of.name;
  arm.model = made_of.model;
  arm.shapes = made_of.shapes;
  arm.X_WR = made_of.X_WR;
  arm.self_collision = made_of.self_collision;
  instances.push_back(std::move(arm));
  for (const KeepOutBox& one : boxes) {
    SceneInstance box;
    box.name = one.name;
    CollisionShape shape;
    shape.geometry = Box{one.size};
    shape.id = {0, 0, 0};
    box.shapes = {{shape}};
    box.X_WR = one.X_WB;
    instances.push_back(std::move(box));
  }
  SceneOptions options;
  for (const ExcludedPair& pair : robot.engine().world().excluded_pairs()) {
    if (pair.a.instance == robot.index() && pair.b.instance == robot.index())
      options.allowed.push_back(
          {{0, std::min(pair.a.link, pair.b.link)}, {0, std::max(pair.a.link, pair.b.link)}, pair.reason});
  }
  return std::make_shared<const CollisionScene>(std::move(instances), options);
}

// The joints that move a link, as the leaders that drive them.
std::set<int> drivers_of(const Model& model, int link) {
  std::set<int> out;
  for (int joint = model.links[static_cast<std::size_t>(link)].joint; joint >= 0;) {
    const ModelJoint& one = model.joints[static_cast<std::size_t>(joint)];
    if (one.nq > 0) out.insert(one.mimics() ? one.mimic_leader : joint);
    joint = model.links[static_cast<std::size_t>(one.parent_link)].joint;
  }
  return out;
}

}  // namespace

CollisionGuard::CollisionGuard(const Instance& robot, std::vector<KeepOutBox> boxes, const Log& log)
    : boxes_(std::move(boxes)), log_(log), q_(robot.made_of().q0) {
  take_over(robot);
}

void CollisionGuard::take_over(const Instance& robot) {
  model_ = robot.made_of().model;
  scene_ = make_scene(robot, boxes_);
  context_ = std::make_unique<CollisionContext>(scene_);
  all_pairs_.clear();
  const auto& tested = scene_->tested_pairs();
  for (std::size_t i = 0; i < tested.size(); ++i) {
    const auto& [a, b] = tested[i];
    if (!a.is_ground() && !b.is_ground() && (a.instance == 0 || b.instance == 0)) all_pairs_.push_back(i);
  }
  leave_out_single_joints();
  refused_.reset();
  context_->set_configuration(0, q_);
  leave_out_touching();
}

// The fingers of a gripper close by intent, and one joint's limits say how far.
void CollisionGuard::leave_out_single_joints() {
  std::erase_if(all_pairs_, [&](std::size_t pair) {
    const auto& [a, b] = scene_->tested_pairs()[pair];
    if (a.instance != b.instance) return false;
    const std::set<int> of_a = drivers_of(*model_, a.link), of_b = drivers_of(*model_, b.link);
    std::vector<int> between;
    std::ranges::set_symmetric_difference(of_a, of_b, std::back_inserter(between));
    return between.size() <= 1;
  });
}

void CollisionGuard::take(std::span<const double> positions) {
  for (std::size_t j = 0; j < positions.size(); ++j) {
    const ModelJoint& joint = model_->joints[j];
    if (joint.scalar() && std::isfinite(positions[j])) q_[joint.q] = positions[j];
  }
  model_->apply_mimics(q_);
  context_->set_configuration(0, q_);
}

std::optional<std::size_t> CollisionGuard::touching(double clearance) {
  for (const std::size_t pair : pairs_) {
    if (context_->tested_closer(pair, clearance)) return pair;
  }
  return {};
}

std::string CollisionGuard::sentence(std::size_t pair, const char* verb) const {
  const auto& [a, b] = scene_->tested_pairs()[pair];
  // The link further from the base is the one that comes.
  const bool b_comes = b.instance == 0 && (a.instance != 0 || b.link > a.link);
  const BodyId link = b_comes ? b : a, other = b_comes ? a : b;
  const std::string& name = model_->links[static_cast<std::size_t>(link.link)].name;
  if (other.instance == 0)
    return fmt::format("'{}' {} touch '{}'", name, verb,
                       model_->links[static_cast<std::size_t>(other.link)].name);
  return fmt::format("'{}' {} enter the keep-out box '{}'", name, verb,
                     scene_->instances()[static_cast<std::size_t>(other.instance)].name);
}

Status CollisionGuard::check(const GuardedPath& path) {
  std::vector<std::size_t> joints;
  for (const std::string& name : path.joints) {
    const int joint = model_->find_joint(name);
    if (joint < 0 || !model_->joints[static_cast<std::size_t>(joint)].scalar()) return {};
    joints.push_back(static_cast<std::size_t>(model_->joints[static_cast<std::size_t>(joint)].q));
  }
  const Eigen::VectorXd present = q_;
  std::vector<double> positions(joints.size()), before;
  const std::int64_t samples = std::clamp<std::int64_t>(path.length / kSampling, 1, kMaxSamples);
  Status out;
  for (std::int64_t i = 0; i <= samples && out; ++i) {
    const Duration since = i == samples ? path.length : path.length / samples * i;
    if (!path.sample(since, positions)) continue;
    const auto moved = [&](std::size_t j) { return std::abs(positions[j] - before[j]) >= kMotion; };
    bool far = before.empty() || i == samples;
    for (std::size_t j = 0; j < joints.size() && !far; ++j) far = moved(j);
    if (!far) continue;
    for (std::size_t j = 0; j < joints.size(); ++j) q_[static_cast<Eigen::Index>(joints[j])] = positions[j];
    before = positions;
    model_->apply_mimics(q_);
    context_->set_configuration(0, q_);
    if (const auto pair = touching(kTouching))
      out = Status::refused(fmt::format("{} at {:.2f} s", sentence(*pair, "would"), to_seconds(since)));
  }
  q_ = present;
  return out;
}

void CollisionGuard::leave_out_touching() {
  pairs_ = all_pairs_;
  std::erase_if(pairs_, [&](std::size_t pair) { return context_->tested_closer(pair, kTouching); });
}

void CollisionGuard::begin(std::span<const double> positions, Duration period) {
  take(positions);
  refused_.reset();
  leave_out_touching();
  std::vector<std::string> touch;
  for (const std::size_t pair : all_pairs_) {
    if (std::ranges::find(pairs_, pair) == pairs_.end()) touch.push_back(sentence(pair, "may"));
  }
  if (!touch.empty())
    log_.warning("guard",
                 fmt::format("{}: they are in contact where the arm is now, so that the guard leaves "
                             "them out until the next activation",
                             fmt::join(touch, ", ")));
  cost_ = measured_cost();
  too_slow_ = cost_ > kShareOfPeriod * to_seconds(period);
  if (too_slow_)
    log_.warning("guard",
                 fmt::format("a check takes {:.0f} us, more than a fifth of the period of {:.0f} us: "
                             "only trajectories are checked, before they begin",
                             cost_ * 1e6, to_seconds(period) * 1e6));
}

double CollisionGuard::measured_cost() {
  const auto start = std::chrono::steady_clock::now();
  for (int i = 0; i < kCostRuns; ++i) {
    context_->set_configuration(0, q_);
    static_cast<void>(touching(kPenetration));
  }
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count() / kCostRuns;
}

bool CollisionGuard::permits(std::span<const double> positions) noexcept {
  take(positions);
  if (too_slow_) return true;
  const std::optional<std::size_t> pair = touching(kPenetration);
  if (pair && !refused_) {
    ++episodes_;
    reported_ = false;
  }
  refused_ = pair;
  return !pair;
}

void CollisionGuard::attend() {
  if (!refused_ || reported_) return;
  reported_ = true;
  log_.warning("guard", fmt::format("{}: the joints hold until a command begins where they are ({} so far)",
                                    sentence(*refused_, "would"), episodes_));
}

}  // namespace doppel
