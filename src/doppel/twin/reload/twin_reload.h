#pragma once
// The reload of a running twin: a machine made from the scenario's current files is built on another thread
// and replaces the running one between two steps. An edit with which the physics diverges is taken back.

#include <map>
#include <memory>
#include <optional>
#include <string>

#include "doppel/base/core/diagnostic.h"
#include "doppel/export.h"
#include "doppel/twin/loop/tickable.h"
#include "doppel/twin/loop/twin_core.h"

namespace doppel {

struct TwinReplacement {
  std::unique_ptr<CompiledScenario> machine;
  std::map<std::string, ControllerSelection> selections;  // by namespace
  std::shared_ptr<const RunningMachine> running;          // the machine for which it was made
};

// On any thread. Throws InputError if the files cannot be used; the running machine is not affected.
[[nodiscard]] DOPPEL_API std::shared_ptr<TwinReplacement> prepare_replacement(
    const std::shared_ptr<const RunningMachine>& running, Diagnostics& diagnostics);

class DOPPEL_API TwinReload : public Tickable {
 public:
  explicit TwinReload(TwinCore& core) : core_(core) {}

  // Continues with the replacement from the present time and joint state. True: the controllers of all robots
  // continue; false: some were made again. Throws InputError; the old machine then keeps running.
  bool replace(TwinReplacement& fresh);

  void between_steps(Time now) override;
  void reset(Time /*now*/) override { edited_.reset(); }  // its time is another one from now on
  // The time is another one from now on, too.
  void restore(const SavedPart* /*saved*/, Time /*now*/) override { edited_.reset(); }
  bool recover(const std::string& cause) override;

 private:
  // The machine before the last edit, with its state at that moment, while the edit may be taken back.
  struct Edited {
    std::shared_ptr<TwinReplacement> before;
    // The world of the edit; another one: something was added or removed since.
    std::shared_ptr<const CompiledWorld> world;
    Time applied{};  // simulated
  };

  TwinCore& core_;
  std::optional<Edited> edited_;
};

}  // namespace doppel
