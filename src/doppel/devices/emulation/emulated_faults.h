#pragma once
// Faults of an emulated bus, when they begin, and how often: for tests of hosts.

#include <cstdint>
#include <optional>
#include <random>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "doppel/base/core/time.h"
#include "doppel/export.h"

namespace doppel {

enum class FaultKind {
  drop,             // an answer is lost
  corrupt,          // a byte of an answer has a wrong bit
  late,             // an answer comes `amount` seconds later
  stranger,         // an answer has another servo's id
  echo,             // the host's own bytes come back
  unplug,           // nothing comes through
  brown_out,        // all servos restart, and are silent for 0.2 s
  stuck,            // the joint does not move
  slip,             // the horn has turned by `amount` rad against the shaft
  wrong_direction,  // the servo counts the other way
  hot,              // the temperature is `amount` degrees Celsius
  overload,         // the servo has latched its protection
};
[[nodiscard]] DOPPEL_API std::string_view to_string(FaultKind kind);
[[nodiscard]] DOPPEL_API std::vector<std::string> fault_kinds();
[[nodiscard]] DOPPEL_API std::optional<FaultKind> fault_kind(std::string_view name);

struct EmulatedFault {
  FaultKind kind = FaultKind::drop;
  std::optional<int> servo = {};  // id; nullopt: all
  Time begin{};                   // of the emulator's clock
  Time end = Time::max();
  double share = 1;   // of the answers
  double amount = 0;  // by the kind
};

// The faults of one run. Those with a share are drawn from the seed, in the order of the questions.
class DOPPEL_API FaultPlan {
 public:
  FaultPlan(std::vector<EmulatedFault> faults, std::uint64_t seed)
      : faults_(std::move(faults)), random_(seed) {}

  void replace(std::vector<EmulatedFault> faults) { faults_ = std::move(faults); }
  void add(const EmulatedFault& fault) { faults_.push_back(fault); }
  // The first fault of that kind now, of this servo or of all; nullptr: none.
  [[nodiscard]] const EmulatedFault* find(FaultKind kind, int servo, Time now) const;
  // True: there is one, and its share has hit.
  [[nodiscard]] bool draw(FaultKind kind, int servo, Time now);
  [[nodiscard]] std::uint64_t random() { return random_(); }

 private:
  std::vector<EmulatedFault> faults_;
  std::mt19937_64 random_;
};

}  // namespace doppel
