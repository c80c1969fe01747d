#pragma once
// The servo of one joint along a recorded command.

#include <vector>

#include "doppel/review/identification/servo_fit.h"

namespace doppel::identification_detail {

// Throws InputError: too few samples, times that do not rise, or no motion.
void check_record(const JointRecord& record);
// From the torque's end until commands are followed again.
bool is_in_release(const JointRecord& record, double time);

class ServoSimulation {
 public:
  // The record outlives the simulation.
  explicit ServoSimulation(const JointRecord& record);

  // Predicted positions at the record's times. Does not allocate.
  void run(const ServoValues& values, std::vector<double>& out);
  // Shares of the time of the last run.
  [[nodiscard]] double velocity_share() const { return velocity_share_; }
  [[nodiscard]] double effort_share() const { return effort_share_; }
  [[nodiscard]] double largest_effort() const { return largest_effort_; }  // N m or N, of the last run

 private:
  struct State;
  void divide_time();
  void find_spreads();
  void aim(State& state) const;
  void advance_part(const ServoValues& values, State& state, double now, double time) const;
  void advance_reference(const ServoValues& values, State& state, double begin, double end);
  void catch_joint(State& state, const ReleasedSpan& span) const;
  void step(const ServoValues& values, State& state, std::size_t index) const;

  const JointRecord& record_;
  double step_ = 0;                     // s, the present one
  std::vector<double> ends_;            // of the steps
  std::vector<double> load_, inertia_;  // at the middle of each step
  std::vector<int> released_;           // of each step: the span in which it is off, or -1
  std::vector<double> spreads_;         // s, over which the way to the next sample of the command is spread
  std::size_t command_ = 0;             // the sample before the delayed time
  double velocity_share_ = 0, effort_share_ = 0, largest_effort_ = 0;
};

}  // namespace doppel::identification_detail
