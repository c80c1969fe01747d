#pragma once
// Limits between controllers and hardware: positions are kept inside [lower, upper] and within the velocity
// limit, velocities and efforts within theirs, soft limits (soft_limits.h) are approached as they prescribe,
// and a value that is not finite is rejected. Each kind of intervention is reported once per episode, between
// steps.

#include <array>
#include <string>
#include <vector>

#include "doppel/base/core/log.h"
#include "doppel/control/manager/detail/resource_table.h"
#include "doppel/control/manager/soft_limits.h"
#include "doppel/robot/kinematics/model.h"

namespace doppel {

class JointLimiter {
 public:
  explicit JointLimiter(const Model& model) : model_(&model) {}
  // false: only values that are not finite are rejected.
  void enforce(bool yes) { enforce_ = yes; }

  // Between steps. `command` is the next index of the table's commands.
  void add(ResourceTable& table, std::size_t command);
  // A controller that updates every `ticks` ticks claims a command; its first value is limited relative to
  // the measured state.
  void claim(std::size_t command, const std::string& controller, int ticks);
  // The next value of a command that is not claimed is limited relative to the measured state.
  void forget(std::size_t command);
  // Another model with the same joints: their limits are looked up again.
  void model_changed(const Model& model);
  // Replaces all soft limits.
  void set_soft_limits(std::vector<SoftLimits> limits);
  // Applies a last command (for example a velocity of zero) and removes the controller.
  void release(std::size_t command, Time now, Duration tick);
  // Logs the interventions since the last call; about every 50 ms of simulated time.
  void report(Time now, const Log& log);

  // In the loop: from the controllers' commands to the applied ones. No allocation, no lock, no throw.
  void apply(Time now, Duration tick);

 private:
  enum class Quantity { position, velocity, effort, other };
  enum Kind : std::size_t { kRange, kRate, kMagnitude, kPastLimit, kSoftRange, kNotFinite, kKinds };
  struct Episode {
    bool open = false, reported = false;
    Time began{}, last{};
    double asked = 0;  // the largest so far
  };
  // The state that changes from tick to tick.
  struct Run {
    double last_asked = 0, last_applied = 0;  // NaN: none yet
    std::array<Episode, kKinds> episodes;
  };

 public:
  using Saved = std::vector<Run>;  // [commands]
  // Between steps.
  void save(Saved& out) const;
  void restore(const Saved& saved);

 private:
  struct Entry : Run {
    std::string full_name, joint_name, controller;
    const ModelJoint* joint = nullptr;  // nullptr: not a command of a joint, unlimited
    Quantity quantity = Quantity::other;
    const double* asked = nullptr;
    double* applied = nullptr;
    const SoftLimits* soft = nullptr;  // nullptr: none
    // State interfaces; nullptr: there is none.
    const double* position = nullptr;
    const double* velocity = nullptr;
    bool claimed = false;
    int ticks = 1;
  };

  [[nodiscard]] const ModelJoint* find_joint(const std::string& name) const;
  void apply(Entry& entry, Time now, double dt) const;
  [[nodiscard]] const SoftLimits* find_soft(const std::string& name) const;
  static double limit_position(Entry& entry, double asked, Time now, double dt);
  static double limit_velocity(Entry& entry, double asked, Time now, double dt);
  static double limit_effort(Entry& entry, double asked, Time now);
  static double limit_magnitude(Entry& entry, double asked, double limit, Time now);
  static void note(Episode& episode, double asked, Time now);
  [[nodiscard]] static std::string sentence(const Entry& entry, Kind kind);

  const Model* model_;
  std::vector<SoftLimits> soft_;
  bool enforce_ = true;
  std::vector<Entry> entries_;
};

}  // namespace doppel
