#include "doppel/devices/drivers/motion_guard.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <utility>

#include "doppel/base/core/text.h"

namespace doppel {
namespace {

constexpr double kStepMargin = 1.2, kSampleMargin = 1.5;  // of the speed limit
constexpr double kSampleSlack = 0.02;                     // rad or m: noise and rounding of two samples
constexpr double kGentle = 0.25, kHotShare = 0.5;         // of the speed
constexpr double kMinAhead = 0.05;                        // rad or m: what a servo needs to hold a load
constexpr double kStallLoad = 0.8, kStallSpeed = 0.01, kStallError = 0.1;
constexpr double kYield = 0.02;  // rad or m
constexpr Duration kStallTime{500'000'000};
constexpr double kHot = 60, kCool = 55;  // degrees Celsius

}  // namespace

bool looks_like_gripper(std::string_view joint) {
  const std::string lower = lowered(joint);
  return std::ranges::any_of(std::array{"grip", "finger", "jaw"},
                             [&](const char* part) { return lower.find(part) != std::string::npos; });
}

void JointGuard::begin(double q, Time when) {
  position_ = goal_ = wish_ = q;
  velocity_ = load_ = 0;
  seen_ = when;
  doubted_.reset();
  blocked_since_.reset();
  stalled_ = false;
  events_ = active_ = 0;
}

void JointGuard::take(double q, double v, double load, Time when) {
  if (!std::isfinite(q)) return;
  const auto reachable = [&](double start, Time since) {
    const double most =
        kSampleMargin * limits_.velocity * std::max(to_seconds(when - since), 0.0) + kSampleSlack;
    return std::abs(q - start) <= most;
  };
  const bool believed = reachable(position_, seen_) || (doubted_ && reachable(*doubted_, doubted_when_));
  if (!believed) {
    doubted_ = q;
    doubted_when_ = when;
    raise(kDroppedSample);
    return;
  }
  end(kDroppedSample);
  doubted_.reset();
  position_ = q;
  if (std::isfinite(v)) velocity_ = v;
  if (std::isfinite(load)) load_ = load;
  seen_ = when;
  if (!limits_.stalls_by_intent) watch_stall(when);
}

void JointGuard::watch_stall(Time when) {
  // While the goal yields, the load and the rest of the way are what a block looks like no longer.
  const bool blocked = std::abs(load_) > kStallLoad && std::abs(velocity_) < kStallSpeed * limits_.velocity &&
                       std::abs(wish_ - position_) > kStallError;
  if (stalled_) {
    const bool moves = std::abs(velocity_) >= kStallSpeed * limits_.velocity && std::abs(load_) < kStallLoad;
    if (!moves && std::abs(wish_ - position_) > kStallError) return;
    stalled_ = false;
    end(kReleased);
    raise(kReleased);
    end(kStalled);
    return;
  }
  if (!blocked) {
    blocked_since_.reset();
    return;
  }
  if (!blocked_since_) blocked_since_ = when;
  if (when - *blocked_since_ < kStallTime) return;
  stalled_ = true;
  blocked_since_.reset();
  raise(kStalled);
}

void JointGuard::take_temperature(double temperature) {
  if (!std::isfinite(temperature)) return;
  if (!hot_ && temperature >= kHot) raise(kHalvedSpeed);
  if (hot_ && temperature < kCool) end(kHalvedSpeed);
  hot_ = temperature >= (hot_ ? kCool : kHot);
}

double JointGuard::fastest() const {
  double out = limits_.velocity * (gentle_ ? kGentle : kStepMargin);
  if (hot_) out = std::min(out, kHotShare * limits_.velocity);
  return out;
}

double JointGuard::goal(double command, Duration period) {
  if (std::isfinite(command)) {
    wish_ = std::clamp(command, limits_.lower, limits_.upper);
    if (wish_ != command) {
      raise(kClampedLimit);
    } else {
      end(kClampedLimit);
    }
  }
  const double most = fastest() * to_seconds(period);
  const double way = std::clamp(wish_ - goal_, -most, most);
  // A gentle or hot joint is slow by intent, which is no fault of the command.
  if (!gentle_ && !hot_) {
    if (way != wish_ - goal_) {
      raise(kClampedStep);
    } else {
      end(kClampedStep);
    }
  }
  goal_ += way;
  if (stalled_) {
    goal_ = position_ + std::copysign(std::min(kYield, std::abs(wish_ - position_)), wish_ - position_);
    return goal_;
  }
  const double ahead = std::max(limits_.ahead * limits_.velocity, kMinAhead);
  goal_ = std::clamp(goal_, position_ - ahead, position_ + ahead);
  return goal_;
}

void JointGuard::hold() {
  goal_ = wish_ = position_;
  stalled_ = false;
  blocked_since_.reset();
}

void JointGuard::raise(GuardEvent event) {
  if ((active_ & event) == 0) events_ |= event;
  active_ |= event;
}

unsigned JointGuard::take_events() {
  return std::exchange(events_, 0);
}

}  // namespace doppel
