#pragma once
// What stands between controllers and hardware: positions held inside [lower, upper] and to the velocity
// limit, velocities and efforts to theirs, and nothing that is not a finite number gets through. Each kind of
// intervention is reported once per episode, between steps.

#include <array>
#include <string>
#include <vector>

#include "doppel/control/detail/resource_table.h"
#include "doppel/core/log.h"
#include "doppel/kinematics/model.h"

namespace doppel {

class JointLimiter {
 public:
  explicit JointLimiter(const Model& model) : model_(&model) {}
  // false: only the rule about finite numbers remains.
  void enforce(bool yes) { enforce_ = yes; }

  // Between steps. `command` is the next index of the table's commands.
  void add(ResourceTable& table, std::size_t command);
  // A controller that updates every `ticks` ticks takes a command; the first one is held against the state.
  void claim(std::size_t command, const std::string& controller, int ticks);
  // Another model with the same joints: their limits are looked up again.
  void model_changed(const Model& model);
  // Lets a last command through (a velocity's zero, say) and forgets the controller.
  void release(std::size_t command, Time now, Duration tick);
  // Logs what happened since; about every 50 ms of simulated time.
  void report(Time now, const Log& log);

  // In the loop: from what controllers asked to what is applied. No allocation, no lock, no throw.
  void apply(Time now, Duration tick);

 private:
  enum class Quantity { position, velocity, effort, other };
  enum Kind : std::size_t { kRange, kRate, kMagnitude, kPastLimit, kNotFinite, kKinds };
  struct Episode {
    bool open = false, reported = false;
    Time began{}, last{};
    double asked = 0;  // the most so far
  };
  struct Entry {
    std::string full_name, joint_name, controller;
    const ModelJoint* joint = nullptr;  // null: no joint's command, unlimited
    Quantity quantity = Quantity::other;
    const double* asked = nullptr;
    double* applied = nullptr;
    const double* position = nullptr;  // state; null: not offered
    bool claimed = false;
    int ticks = 1;
    double last_asked = 0, last_applied = 0;  // NaN: none yet
    std::array<Episode, kKinds> episodes;
  };

  [[nodiscard]] const ModelJoint* find_joint(const std::string& name) const;
  void apply(Entry& entry, Time now, double dt) const;
  static double limit_position(Entry& entry, double asked, Time now, double dt);
  static double limit_velocity(Entry& entry, double asked, Time now, double dt);
  static double limit_magnitude(Entry& entry, double asked, double limit, Time now);
  static void note(Episode& episode, double asked, Time now);
  [[nodiscard]] static std::string sentence(const Entry& entry, Kind kind);

  const Model* model_;
  bool enforce_ = true;
  std::vector<Entry> entries_;
};

}  // namespace doppel
