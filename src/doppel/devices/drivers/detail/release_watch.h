#pragma once
// The numbers of a short release of a joint's torque: whether the arm is at rest before, and when the torque
// has to be on again. It knows nothing of buses, and allocates nothing.

#include <optional>
#include <vector>

#include "doppel/base/core/time.h"
#include "doppel/control/hardware/hardware.h"

namespace doppel {

enum class CatchReason { none, time, interval, speed, silence, stop };

// A number that stays within a band.
class RestWatch {
 public:
  explicit RestWatch(double band) : band_(band) {}
  void take(double value, Time now);
  // For as long as a rest has to be before a release.
  [[nodiscard]] bool is_at_rest(Time now) const;

 private:
  double band_, middle_ = 0;
  std::optional<Time> since_;
};

class ReleaseWatch {
 public:
  void begin(const JointRelease& release, double q, Time now);
  // In each cycle; fresh: q and v (rad or m, per s) are new. The first reason stays.
  CatchReason take(bool fresh, double q, double v, Time now);
  void stop();
  [[nodiscard]] CatchReason reason() const { return reason_; }

 private:
  JointRelease release_;
  Time begin_{}, seen_{};
  double q_ = 0;
  int silent_ = 0;  // cycles in a row without an answer
  CatchReason reason_ = CatchReason::none;
};

// The releases of a driver, by the joints of its setup.
struct JointReleases {
  explicit JointReleases(std::size_t joints);

  std::optional<std::size_t> joint;  // without torque
  ReleaseWatch watch;
  std::vector<bool> waits;  // for a command near to where it was caught
  std::vector<RestWatch> positions, goals;
  std::vector<Time> torque_off, torque_on;  // of the loop: the last release of each joint
  Time read_when{}, read_at{};              // the last read, by the loop's clock and by the link's
};

}  // namespace doppel
