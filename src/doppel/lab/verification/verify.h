#pragma once
// The accuracy of a robot's motion at the step of its world: the same motion at h, h/2 and h/4.
//
// With x_h = x + c h^p the differences d1 = x_h - x_h/2 and d2 = x_h/2 - x_h/4 have the ratio 2^p, which
// gives the observed order p; errors are relative to the extrapolated motion x_h/4 + (x_h/4 - x_h/2) / (2^p -
// 1) (Richardson extrapolation; Hairer, Norsett, Wanner, Solving ODEs I, II.4).

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "doppel/export.h"
#include "doppel/lab/verification/motion.h"

namespace doppel {

inline constexpr double kPerturbation = 1e-9;  // rad or m, of the start
inline constexpr double kChaoticGrowth = 1e6;  // of the perturbation: no step makes such a motion repeatable
inline constexpr double kLost = 0.1;           // rad or m: with a larger error it is another motion
inline constexpr double kMinSeenOrder = 0.5;   // below it the error does not decrease with the step
inline constexpr double kStillGood = 0.01;     // rad or m: error up to which such a motion is good

struct VerifyOptions {
  double duration = 2.0;            // s
  std::vector<MotionKind> motions;  // empty: all
  std::string tool;                 // link; empty: choose_tool()
  // Called before each of the kRuns runs of a motion, counted from 1.
  std::function<void(MotionKind, int run)> on_run;
};
inline constexpr int kRuns = 4;  // h, h/2, h/4, and h from a changed start

struct JointError {
  std::string joint;
  bool slides = false;             // m, else rad
  double largest = 0, at_end = 0;  // rad or m, until the motion is chaotic
};

// Largest error of any joint at each sample, by the step: h, h/2, h/4. rad (m of prismatic joints as rad).
struct ErrorCurve {
  std::vector<double> time;
  std::vector<double> error[3];
};

struct DOPPEL_API MotionVerdict {
  MotionKind kind{};
  std::optional<double> runs_away_after;     // s: divergence, at the coarsest step that diverges
  std::vector<JointError> joints;            // of each coordinate of the motion (motion.h)
  double tool_largest = 0, tool_at_end = 0;  // m
  std::optional<double> order;               // none: the differences are rounding
  std::optional<double> energy_drift;        // of the largest kinetic energy, at h; smooth only
  std::optional<double> chaotic_after;       // s
  std::optional<double> touches_after;       // s: first contact, after which every scheme has order 1
  double span = 0;                           // s: duration to which the errors refer
  double good_until = 0;                     // s: until the error of a joint exceeds kStillGood
  ErrorCurve curve;

  [[nodiscard]] double largest(bool slides) const;  // over the joints
};

struct Verification {
  std::string robot, world, tool;
  Integrator integrator{};
  double step = 0, duration = 0;  // s
  std::vector<MotionVerdict> motions;
};

// The step is rounded down to a multiple of 4 ns. Throws InputError: the engine rejects the robot, or no link
// has the tool's name.
DOPPEL_API Verification verify(const MotionSubject& subject, const VerifyOptions& options);

// "move    1 ms is good to 0.4 mrad (tool 0.2 mm) over 2 s"
DOPPEL_API std::string verdict_line(const Verification& of, const MotionVerdict& motion);
DOPPEL_API std::string verification_text(const Verification& of);
DOPPEL_API std::string verification_json(const Verification& of);
// Errors over time on a logarithmic scale, one panel a motion, one line a step.
DOPPEL_API std::string verification_svg(const Verification& of);

}  // namespace doppel
