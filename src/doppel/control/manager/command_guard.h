#pragma once
// Permits motions of a robot before its hardware gets them. The manager knows joints and limits and no
// geometry; the twin, which knows it, implements this interface.

#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include "doppel/base/core/status.h"
#include "doppel/base/core/time.h"
#include "doppel/export.h"

namespace doppel {

// A motion of some joints.
struct GuardedPath {
  std::span<const std::string> joints;
  Duration length{};
  // Writes the positions [joints] (rad, m) at a time since its beginning. False: there are none.
  std::function<bool(Duration since, std::span<double> positions)> sample;
};

// A path that runs in a simulation before it is sent. Its destructor gives it up.
class DOPPEL_API Rehearsal {
 public:
  virtual ~Rehearsal() = default;
  // Between ticks. nullopt: it has not ended. Refused: what went wrong, with its time.
  [[nodiscard]] virtual std::optional<Status> outcome() = 0;
};

class DOPPEL_API CommandGuard {
 public:
  virtual ~CommandGuard() = default;

  // Between ticks: the whole path, with all other joints where they are now. Refused with the pair and the
  // time of the first contact.
  [[nodiscard]] virtual Status check(const GuardedPath& path) = 0;
  // Between ticks: begins to run the path, beside the loop, from where the robot is now. `period`: between
  // two commands. nullptr: paths are sent without it.
  [[nodiscard]] virtual std::unique_ptr<Rehearsal> rehearse(const GuardedPath& /*path*/,
                                                            Duration /*period*/) {
    return nullptr;
  }
  // Between ticks: the hardware of joints is active since now. `positions`: [joints] of the model, rad or m;
  // NaN: not read. What touches there is no reason to refuse a motion afterwards. `period`: of the loop.
  virtual void begin(std::span<const double> positions, Duration period) = 0;
  // Between ticks: logs what permits() has refused since the last call.
  virtual void attend() = 0;

  // In the loop: whether the joints may be there. `positions`: as in begin(), with the commands. No
  // allocation, no lock, no throw.
  [[nodiscard]] virtual bool permits(std::span<const double> positions) noexcept = 0;
};

}  // namespace doppel
