#pragma once
// The input of a check: the machine, the suite and how much work it may do. Checks run beside each other on
// several threads; the result of each depends on its inputs and the seed alone.

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>

#include "doppel/export.h"
#include "doppel/validation/checks/check.h"
#include "doppel/validation/checks/shared_results.h"
#include "doppel/validation/checks/subject.h"
#include "doppel/validation/checks/suite.h"

namespace doppel {

// Thrown by a check whose progress was refused.
struct CheckCancelled {};

enum class Effort { quick, standard, full };

struct DOPPEL_API CheckContext {
  const Subject& subject;
  const Suite& suite;
  Effort effort = Effort::standard;
  std::uint64_t seed = 1;
  std::size_t threads = 1;  // that one check may use
  std::string joint = {};   // the only one that is judged; empty: all
  // Called with the completed fraction of the check, from any thread; false: it ends early, and its result
  // is not used. May be empty.
  std::function<bool(double)> progress = {};
  SharedResults* shared = nullptr;  // of the whole validation; nullptr: there is none
  bool record = false;              // motions that fail are repeated and recorded
  bool write_answers = true;        // committed answers that are missing are written (validation/tree.txt)

  // Throws CheckCancelled.
  void report(double done) const {
    if (progress && !progress(done)) throw CheckCancelled{};
  }
  // `quick`, `standard` or `full`, by the effort.
  [[nodiscard]] int amount(int quick, int standard, int full) const {
    return effort == Effort::quick ? quick : effort == Effort::standard ? standard : full;
  }
};

}  // namespace doppel
