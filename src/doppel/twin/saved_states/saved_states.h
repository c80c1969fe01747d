#pragma once
// Saved states of the twin by name, in memory, and automatic ones of the last 30 s of simulated time, to
// which it can be rewound. Services on the node /doppel (docs/saved_states.md): ~/save_state,
// ~/restore_state, ~/delete_state, ~/list_states, ~/rewind. All functions: the loop's thread, between
// steps.

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "doppel/base/core/status.h"
#include "doppel/base/core/time.h"
#include "doppel/export.h"
#include "doppel/ros/bus/bus.h"
#include "doppel/twin/loop/saved_state.h"
#include "doppel/twin/loop/tickable.h"
#include "doppel/twin/loop/twin_core.h"

namespace doppel {

inline constexpr std::size_t kMaxSavedStates = 64;        // with a name
inline constexpr Duration kRewindPeriod{500'000'000};     // simulated, between automatic states
inline constexpr Duration kRewindLength{30'000'000'000};  // simulated: what is older is forgotten

class DOPPEL_API SavedStates : public Tickable {
 public:
  explicit SavedStates(TwinCore& core);

  // Throws InputError if it cannot be saved (TwinCore::save()).
  [[nodiscard]] std::shared_ptr<const SavedState> save_now();
  // A rewind cannot go back before it, because the automatic states belong to what is given up.
  Status restore_state(const SavedState& state);

  // Under a name, in place of a former state of that name. strict: refused if a controller would be
  // reactivated at a restore. Refused, too: an empty name, too many states. `done`: what was saved, for a
  // message.
  Status save_named(const std::string& name, bool strict, std::string& done);
  Status restore_named(const std::string& name, std::string& done);
  Status remove(const std::string& name);

  // Whether automatic states are kept; by default they are not.
  void keep(bool on);
  // To the newest automatic state that is at least so old. Refused if there is none. `done`: where it went.
  Status rewind(Duration back, std::string& done);

  void between_steps(Time now) override {
    if (keeps_ && now >= next_) save_automatically(now);
  }
  void reset(Time now) override { forget_later_than(Time::min(), now); }

 private:
  using State = std::unique_ptr<SavedState>;
  void serve();
  void save_automatically(Time now);
  void forget_later_than(Time time, Time now);

  TwinCore& core_;
  Node node_;
  std::map<std::string, std::shared_ptr<const SavedState>> named_;
  bool keeps_ = false;
  Time next_ = Time::min();
  std::string why_not_;           // the last one could not be saved; empty: it could
  std::vector<State> automatic_;  // the oldest first
  std::vector<State> spare_;      // whose memory the next ones reuse
};

}  // namespace doppel
