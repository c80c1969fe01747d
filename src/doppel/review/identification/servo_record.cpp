#include <fmt/format.h>

#include <algorithm>
#include <functional>

#include "doppel/base/core/diagnostic.h"
#include "doppel/review/identification/detail/servo_simulation.h"

namespace doppel::identification_detail {
namespace {

constexpr std::size_t kMinSamples = 500;

}  // namespace

void check_record(const JointRecord& record) {
  const std::size_t n = record.time.size();
  if (n < kMinSamples || record.command_time.size() < 2) {
    throw InputError("identify.too_short", {},
                     fmt::format("the recording has {} samples of the joint; a fit needs {}", n, kMinSamples),
                     "record a motion of at least 20 s at 100 Hz");
  }
  const bool even = record.position.size() == n && record.load.size() == n && record.inertia.size() == n &&
                    record.command.size() == record.command_time.size();
  const auto rises = [](const std::vector<double>& t) {
    return std::ranges::adjacent_find(t, std::greater_equal<>()) == t.end();
  };
  if (!even || !rises(record.time) || !rises(record.command_time)) {
    throw InputError("identify.times", {}, "the times of the recording do not rise, or values are missing",
                     "remove repeated samples");
  }
  const auto [least, most] = std::ranges::minmax(record.command);
  if (!(most - least > 0)) {
    throw InputError("identify.no_motion", {}, "the command of the joint does not change",
                     "record a motion of the joint");
  }
}

bool is_in_release(const JointRecord& record, double time) {
  return std::ranges::any_of(record.released, [&](const ReleasedSpan& span) {
    return time >= span.begin && time <= std::max(span.end, span.follows);
  });
}

}  // namespace doppel::identification_detail
