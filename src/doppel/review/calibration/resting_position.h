#pragma once
// A position of a machine as a measurement needs it: of a joint at rest.

#include <optional>
#include <string>
#include <vector>

#include "doppel/base/core/diagnostic.h"
#include "doppel/export.h"

namespace doppel {

class DOPPEL_API RestingPosition {
 public:
  static constexpr double kMaxWait = 3;        // s, for samples that agree
  static constexpr double kMinBetween = 0.04;  // s, between two samples

  // rad or m; NaN is no sample. The mean of five in a row that agree, once there are as many.
  std::optional<double> take(double sample);
  // Why there is none after kMaxWait.
  [[nodiscard]] InputError refusal(const std::string& joint) const;

 private:
  std::vector<double> samples_;
  bool reported_ = false;
};

}  // namespace doppel
