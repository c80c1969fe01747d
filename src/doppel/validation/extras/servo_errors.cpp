#include "doppel/validation/extras/detail/servo_errors.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "doppel/base/math/units.h"

namespace doppel {
namespace {

constexpr std::uint32_t kPhaseChannel = 0, kNoiseChannel = 1;

std::vector<DrivePrecision> drives_of(const CheckContext& context, const ExtraArm& arm) {
  std::vector<DrivePrecision> out;
  for (int k = 0; k < arm.chain().size(); ++k) {
    const auto found = context.subject.precision.find(arm.joint(k).name);
    out.push_back(found == context.subject.precision.end() ? DrivePrecision{} : found->second);
  }
  return out;
}

}  // namespace

ServoErrors::ServoErrors(std::vector<DrivePrecision> drives, std::uint64_t seed)
    : drives_(std::move(drives)),
      any_(std::ranges::any_of(drives_, &DrivePrecision::any)),
      random_(seed, "servo errors") {
  const auto count = static_cast<Eigen::Index>(drives_.size());
  phase_ = noise_ = play_ = Eigen::VectorXd::Zero(count);
  begin(0);
}

ServoErrors::ServoErrors(const CheckContext& context, const ExtraArm& arm)
    : ServoErrors(drives_of(context, arm), context.seed) {}

std::string ServoErrors::text() const {
  std::set<std::string> sheets;
  for (const DrivePrecision& drive : drives_) {
    if (!drive.any()) continue;
    std::string parts;
    const auto add = [&](const char* name, double value) {
      if (value > 0)
        parts += fmt::format("{}{} {:.3g} deg", parts.empty() ? "" : ", ", name, value / kDegree);
    };
    add("resolution", drive.resolution);
    add("backlash", drive.backlash);
    add("noise", drive.noise);
    sheets.insert(fmt::format("{} ({})", drive.actuator, parts));
  }
  std::string out;
  for (const std::string& sheet : sheets) out += (out.empty() ? "" : "; ") + sheet;
  return out;
}

void ServoErrors::begin(std::uint64_t run) {
  for (std::size_t k = 0; k < drives_.size(); ++k) {
    const auto i = static_cast<Eigen::Index>(k);
    const auto index = static_cast<std::uint32_t>(k);
    phase_[i] = drives_[k].resolution * random_.uniform(run, kPhaseChannel, index);
    noise_[i] = drives_[k].noise * random_.normal(run, kNoiseChannel, index);
  }
}

void ServoErrors::follow(const Eigen::VectorXd& u, const Eigen::VectorXd& loads,
                         const Eigen::VectorXd& friction) {
  if (before_.size() == 0) before_ = u;
  for (std::size_t k = 0; k < drives_.size(); ++k) {
    const auto i = static_cast<Eigen::Index>(k);
    const double half = 0.5 * drives_[k].backlash;
    play_[i] = std::abs(loads[i]) > friction[i] ? std::copysign(half, -loads[i])
                                                : std::clamp(play_[i] - (u[i] - before_[i]), -half, half);
  }
  before_ = u;
}

Eigen::VectorXd ServoErrors::apply(const Eigen::VectorXd& u) const {
  Eigen::VectorXd out = u + noise_ + play_;
  for (std::size_t k = 0; k < drives_.size(); ++k) {
    const double step = drives_[k].resolution;
    if (step <= 0) continue;
    const auto i = static_cast<Eigen::Index>(k);
    const double steps = (u[i] + phase_[i]) / step;
    out[i] += step * (steps - std::floor(steps) - 0.5);
  }
  return out;
}

}  // namespace doppel
