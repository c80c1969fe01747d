#pragma once
// The motion of one joint for the fit of its servo: a slow triangle (friction, backlash), steps of growing
// size (delay, limits) and five harmonics of 0.2 Hz (inertia, damping), about a position.

#include <array>
#include <vector>

#include "doppel/export.h"

namespace doppel {

inline constexpr double kExcitationSpeed = 0.6;  // of the joint's speed limit, at most
inline constexpr double kRehearsalSpeed = 0.3;   // of the excitation's
inline constexpr double kMinExcitation = 20;     // s
inline constexpr double kUsualExcitation = 54;   // s

struct ExcitationRange {
  double position = 0;          // rad or m, about which the joint moves
  double lower = 0, upper = 0;  // rad or m; may be infinite
  double speed = 0;             // rad/s or m/s, the joint's limit; may be infinite
  bool slides = false;
  double furthest = 1e300;  // rad or m, of the motion to either side
};

inline constexpr double kBaseFrequency = 0.2;  // Hz
inline constexpr int kHarmonics = 5;
// sum_k a_k sin(k w t) + b_k cos(k w t), k = 1..5, of any scale.
struct DOPPEL_API FourierSeries {
  std::array<double, kHarmonics> a{}, b{};
  [[nodiscard]] double value(double time) const;
};
// Falling amplitudes, with the phases of Schroeder (1970), which keep the peaks low.
DOPPEL_API FourierSeries schroeder_series();

struct Waypoint {
  double time = 0;      // s
  double position = 0;  // rad or m
};

// How far it goes to either side, rad or m: within the limits with a margin of 5 % of the range; 0: there is
// no room.
DOPPEL_API double excitation_amplitude(const ExcitationRange& range);

// Between the waypoints the position is linear. It begins and ends with a second of rest at the position.
DOPPEL_API std::vector<Waypoint> plan_excitation(const ExcitationRange& range, double seconds,
                                                 const FourierSeries& series = schroeder_series());
// The part with the harmonics alone, with rest before and behind it.
DOPPEL_API std::vector<Waypoint> plan_harmonics(const ExcitationRange& range, double seconds,
                                                const FourierSeries& series);

// The whole range of the excitation, at kRehearsalSpeed of its largest speed.
DOPPEL_API std::vector<Waypoint> plan_rehearsal(const ExcitationRange& range);

}  // namespace doppel
