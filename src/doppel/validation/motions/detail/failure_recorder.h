#pragma once
// Recordings of motions that have failed: the motion is made again with the recorder on, which costs nothing
// where all pass; equal inputs give equal motions.

#include <functional>
#include <set>
#include <string>

#include "doppel/validation/checks/context.h"
#include "doppel/validation/motions/machine_run.h"

namespace doppel {

inline constexpr std::size_t kMaxRecordings = 6;  // of one check

class FailureRecorder {
 public:
  // Both outlive it.
  FailureRecorder(const CheckContext& context, CheckResult& out) : context_(context), out_(out) {}

  // Records the failure of an item of the result, if there is none of this part (a joint) yet and fewer than
  // kMaxRecordings; a note says so where there are more. `repeat` makes the motion again, from a restored or
  // a new state.
  void record(CheckItem& item, const std::string& part, MachineRun& machine,
              const std::function<void()>& repeat);
  // The same for a motion that records itself.
  void record(CheckItem& item, const std::string& part, const std::function<RecordedMotion()>& motion);

 private:
  const CheckContext& context_;
  CheckResult& out_;
  std::set<std::string> parts_;  // that have failed
  bool is_capped_ = false;
};

// "T4_Revolute_2.mcap": letters, digits, '-', '.' and '_' alone, and different from `others`.
[[nodiscard]] std::string recording_file(const std::string& check, const std::string& part,
                                         const std::vector<FailureRecording>& others);

}  // namespace doppel
