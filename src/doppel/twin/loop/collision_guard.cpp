#include "doppel/twin/loop/collision_guard.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <chrono>
#include <cmath>

#include "doppel/twin/loop/detail/guard_scene.h"
#include "doppel/twin/loop/detail/rehearser.h"

namespace doppel {
namespace {

constexpr double kMotion = 0.02;              // rad or m of the fastest joint between two checked states
constexpr Duration kSampling{5'000'000};      // between two samples of a path, at least
constexpr std::int64_t kMaxSamples = 20'000;  // of a path
constexpr double kPenetration = -1e-3;        // m: what permits() refuses, deeper than what check() does
constexpr double kShareOfPeriod = 0.2;        // that permits() may take
constexpr int kCostRuns = 50;

}  // namespace

CollisionGuard::CollisionGuard(const Instance& robot, std::vector<KeepOutBox> boxes, const Log& log)
    : boxes_(std::move(boxes)), log_(log), robot_(robot), q_(robot.made_of().q0) {
  take_over(robot);
}

CollisionGuard::~CollisionGuard() = default;

void CollisionGuard::take_over(const Instance& robot) {
  robot_ = robot;
  model_ = robot.made_of().model;
  scene_ = std::make_shared<const GuardScene>(robot, boxes_);
  context_ = std::make_unique<CollisionContext>(scene_->scene());
  refused_.reset();
  context_->set_configuration(0, q_);
  leave_out_touching();
}

void CollisionGuard::use_rehearsals(std::function<std::span<const double>()> present_q, bool beside_loop) {
  rehearser_ = std::make_unique<Rehearser>(std::move(present_q), beside_loop);
}

std::unique_ptr<Rehearsal> CollisionGuard::rehearse(const GuardedPath& path, Duration period) {
  return rehearser_ ? rehearser_->begin(robot_, scene_, path, period) : nullptr;
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

Status CollisionGuard::check(const GuardedPath& path) {
  if (!refuses_) return {};
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
      out =
          Status::refused(fmt::format("{} at {:.2f} s", scene_->sentence(*pair, "would"), to_seconds(since)));
  }
  q_ = present;
  return out;
}

void CollisionGuard::leave_out_touching() {
  pairs_ = scene_->pairs();
  std::erase_if(pairs_, [&](std::size_t pair) { return context_->tested_closer(pair, kTouching); });
}

void CollisionGuard::begin(std::span<const double> positions, Duration period) {
  take(positions);
  refused_.reset();
  leave_out_touching();
  std::vector<std::string> touch;
  for (const std::size_t pair : scene_->pairs()) {
    if (std::ranges::find(pairs_, pair) == pairs_.end()) touch.push_back(scene_->sentence(pair, "may"));
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
  if (too_slow_ || !refuses_) return true;
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
                                    scene_->sentence(*refused_, "would"), episodes_));
}

}  // namespace doppel
