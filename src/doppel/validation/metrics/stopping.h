#pragma once
// The time and the way of a stop, from samples of position and speed (ISO 10218-1, annex B: stopping time and
// distance).

#include <optional>
#include <span>

#include "doppel/export.h"

namespace doppel {

struct StopOptions {
  double stop_time = 0;      // s: the stop is triggered
  double threshold = 0.001;  // rad/s or m/s: a lower speed is rest
};

// Units of the samples: rad or m.
struct StopFigures {
  double initial_speed = 0;  // rad/s or m/s, signed, at the trigger
  double time = 0;           // s from the trigger until the speed remains below the threshold
  double distance = 0;       // |way| in this time
  double largest_way = 0;    // |way| at its largest, also after `time` (a joint may sag)
  bool stopped = false;      // otherwise `time` and `distance` are those of the last sample: lower bounds
};

// Between two samples the speed is linear and the position its integral. A speed that friction ends within a
// period falls with the slope of the period before. None if a value is not finite, the times do not rise, or
// there are fewer than two samples from the trigger on.
DOPPEL_API std::optional<StopFigures> stop_figures(std::span<const double> time,
                                                   std::span<const double> position,
                                                   std::span<const double> speed,
                                                   const StopOptions& options = {});

}  // namespace doppel
