#pragma once
// The difference between a joint of real hardware and the same joint of a twin that gets the same commands.
//
//   e(t) = q_measured(t) - q_twin(t - d)
//
// Delay d: where the variance of e is least over the last 10 s, which is where the cross-covariance of both,
// corrected for their own variances, is largest; a mean over a minute, in which fast motion counts more,
// because 1 ms is 2 mrad at 2 rad/s. Until the joint has moved enough for that, e is the distance to the
// nearest position that the twin has had within the longest delay.
//
// Noise: the standard deviation sigma of e is learned while nothing is wrong, with a part that grows with the
// twin's speed and acceleration (detail/noise_model.h). An identification's sigma is the least of it.
//
// Load: r is how far the measured load, by the learned ratio, is from all loads that the twin has had while
// it may have been measured; its sigma is learned too.
//
// Alarm: a one-sided CUSUM of a score z (Page 1954), S = max(0, S + min(z, kMaxScore) - allowance), is above
// kDecision. The allowance is what friction and small unknown loads may keep up for long:
//
//   z = |e| / sigma_e                             5
//   z = |r / sigma_r - e / sigma_e| / sqrt(2)     4: a load beyond the twin's, to which the joint gives way
//
// or the reading jumps. A reading that stands still for less than 70 ms while the twin moves is a lost
// answer: no evidence, and nothing to learn from. An alarm lasts until there has been no evidence for a
// second; its cause is the likeliest one by the motions and loads of the last second.

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>
#include <vector>

#include "doppel/base/core/time.h"
#include "doppel/control/residuals/detail/noise_model.h"
#include "doppel/export.h"

namespace doppel {

enum class ResidualCause {
  none,             // no alarm
  unknown,          // an alarm without a sign of one of the others
  stall,            // the joint stands still while the twin moves
  payload,          // more load than the twin's, in the same direction, and the joint gives way
  slipped_horn,     // a constant offset, or a jump that no motion explains
  lost_power,       // no load where the twin has one
  wrong_direction,  // the joint moves against the twin
};
DOPPEL_API std::string_view to_string(ResidualCause cause);

struct ResidualOptions {
  double sigma = 0;         // rad or m, of e where nothing is wrong: the least; 0: not known
  double threshold = 0.05;  // rad or m, of |e| before anything is learned
};

// NaN: not known.
struct ResidualSample {
  double measured = 0, twin = 0;    // rad or m
  double load = 0, model_load = 0;  // share of the stall torque
  bool held_back = false;           // the hardware moves slower than commanded because its driver wants it so
};

class DOPPEL_API JointResidual {
 public:
  static constexpr Duration kPeriod{10'000'000};  // of the samples
  static constexpr double kMaxDelay = 0.3;        // s

  explicit JointResidual(const ResidualOptions& options = {});

  // A new run of the hardware: nothing of before counts, and for a second and a half nothing is an alarm.
  void restart();
  // In the loop, each period: no allocation, no lock, no throw.
  void add(const ResidualSample& sample);

  [[nodiscard]] double error() const { return error_; }  // NaN before the first sample
  [[nodiscard]] double rms() const;                      // of e over 2 s
  [[nodiscard]] double delay() const { return delay_; }  // s; NaN: the joint has not moved enough
  [[nodiscard]] double sigma() const;                    // of e in slow motion, as learned
  [[nodiscard]] ResidualCause alarm() const { return cause_; }
  [[nodiscard]] std::uint64_t alarms() const { return alarms_; }  // episodes since the construction

 private:
  static constexpr double kAllowance = 5, kLoadAllowance = 4, kDecision = 30, kMaxScore = 10;
  static constexpr double kStep = 0.01;         // s, kPeriod
  static constexpr double kMinJump = 0.04;      // rad or m in 20 ms, beyond the motion before and after it
  static constexpr int kLags = 31;              // 0 .. kMaxDelay
  static constexpr std::size_t kWindow = 1000;  // samples of the delay
  static constexpr std::size_t kRing = kWindow + 2 * kLags;
  struct Row {
    double measured = 0, twin = 0, error = 0, load = 0, model_load = 0;
    bool quiet = false;  // nothing is wrong, so that it may be learned from
  };
  struct Motion;

  [[nodiscard]] const Row& back(std::size_t samples) const {
    return ring_[(end_ + kRing - 1 - samples % kRing) % kRing];
  }
  [[nodiscard]] double twin_before(double samples) const;
  [[nodiscard]] double difference() const;
  void advance_sweep();
  void finish_sweep();
  [[nodiscard]] bool is_quiet() const;
  [[nodiscard]] bool is_wrong(double error);
  void find_evidence(double error);
  void follow_episode();
  [[nodiscard]] bool is_repeated();
  [[nodiscard]] bool has_loads() const;
  [[nodiscard]] double load_difference() const;
  [[nodiscard]] double speed(std::size_t samples) const;
  void learn(const ResidualSample& sample);
  void learn_loads(const ResidualSample& sample);
  void learn_window();
  [[nodiscard]] double largest_jump(std::size_t samples) const;
  [[nodiscard]] Motion motion() const;
  [[nodiscard]] ResidualCause likeliest_cause() const;

  std::vector<Row> ring_;
  std::size_t end_ = 0, filled_ = 0;
  std::uint64_t samples_ = 0;  // since the restart
  int lag_ = 0;                // of the sweep, which computes one lag with each sample
  std::size_t age_ = 0;        // samples since the sweep's window ended
  std::array<double, kLags> variances_{};
  double twin_variance_ = 0;
  double error_, delay_;
  double delay_weight_ = 0;
  NoiseModel noise_, load_noise_;
  double load_products_ = 0, load_squares_ = 0, load_ratio_ = 1;
  int loads_ = 0;                              // that the ratio was learned from
  double score_ = 0, load_score_ = 0;          // the CUSUMs
  int repeats_ = 0, right_ = 0, episode_ = 0;  // samples in a row; since the alarm
  ResidualCause cause_ = ResidualCause::none;
  std::uint64_t alarms_ = 0;
};

}  // namespace doppel
