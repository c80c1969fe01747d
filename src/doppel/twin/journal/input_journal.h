#pragma once
// The journal of a twin, on topics that a recorder reads like any others: /doppel/inputs has each input
// (doppel_msgs/msg/Input) with the step after which the loop acts on it, /doppel/state_hash the hash over all
// states so far, once a second of simulated time. A run of the same scenario with the same inputs has the
// same hashes (lab/resimulation).

#include <cstdint>

#include "doppel/export.h"
#include "doppel/ros/bus/bus.h"
#include "doppel/ros/messages/doppel_msgs.h"
#include "doppel/twin/loop/tickable.h"
#include "doppel/twin/loop/twin_core.h"

namespace doppel {

inline constexpr const char* kInputsTopic = "/doppel/inputs";
inline constexpr const char* kStateHashTopic = "/doppel/state_hash";

class DOPPEL_API InputJournal : public Tickable {
 public:
  explicit InputJournal(TwinCore& core);
  ~InputJournal() override { core_.bus().observe_inputs({}); }

  Time publish(Time now) override;
  void between_steps(Time /*now*/) override { ++batch_; }

 private:
  void note(const BusInput& input);

  TwinCore& core_;
  Node node_;
  Publisher<doppel_msgs::msg::Input> inputs_;
  Publisher<doppel_msgs::msg::StateHash> hashes_;
  doppel_msgs::msg::Input message_;  // kept to reuse its memory
  std::uint64_t batch_ = 0;          // of inputs that are handled together
};

}  // namespace doppel
