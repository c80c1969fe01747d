#pragma once
// How exact a robot's motion is at the step of its world: the same motion at h, h/2 and h/4.
//
// With x_h = x + c h^p the differences d1 = x_h - x_h/2 and d2 = x_h/2 - x_h/4 have the ratio 2^p, which is
// the order p that is seen; x_h/4 + (x_h/4 - x_h/2) / (2^p - 1) stands for the exact motion (Richardson
// extrapolation; Hairer, Norsett, Wanner, Solving ODEs I, II.4), from which every error is taken.

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "doppel/export.h"
#include "doppel/verification/motion.h"

namespace doppel {

inline constexpr double kPerturbation = 1e-9;  // rad or m, of the start
inline constexpr double kChaoticGrowth =
    1e6;                                      // of the perturbation: then no step makes the motion repeatable
inline constexpr double kLost = 0.1;          // rad or m: an error above is another motion
inline constexpr double kMinSeenOrder = 0.5;  // less: the error does not shrink with the step
inline constexpr double kStillGood = 0.01;    // rad or m, until when such a motion is called good

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
  double largest = 0, at_end = 0;  // until the motion is chaotic
};

// Largest error of any joint at each sample, by the step: h, h/2, h/4. rad (a slide's m count as rad).
struct ErrorCurve {
  std::vector<double> time;
  std::vector<double> error[3];
};

struct DOPPEL_API MotionVerdict {
  MotionKind kind{};
  std::optional<double> runs_away_after;     // s, at the coarsest step that does
  std::vector<JointError> joints;            // of each coordinate of the motion (motion.h)
  double tool_largest = 0, tool_at_end = 0;  // m
  std::optional<double> order;               // none: the differences are rounding
  std::optional<double> energy_drift;        // of the largest kinetic energy, at h; smooth only
  std::optional<double> chaotic_after;       // s
  std::optional<double> touches_after;       // s: from then on no scheme is better than first order
  double span = 0;                           // s that the errors are of
  double good_until = 0;                     // s, before any joint errs by kStillGood
  ErrorCurve curve;

  [[nodiscard]] double largest(bool slides) const;  // over the joints
};

struct Verification {
  std::string robot, world, tool;
  Integrator integrator{};
  double step = 0, duration = 0;  // s
  std::vector<MotionVerdict> motions;
};

// The step is cut to a multiple of 4 ns. Throws InputError: the engine refuses the robot; there is no link of
// the tool's name.
DOPPEL_API Verification verify(const MotionSubject& subject, const VerifyOptions& options);

// "move    1 ms is good to 0.4 mrad (tool 0.2 mm) over 2 s"
DOPPEL_API std::string verdict_line(const Verification& of, const MotionVerdict& motion);
DOPPEL_API std::string verification_text(const Verification& of);
DOPPEL_API std::string verification_json(const Verification& of);
// Errors over time on a logarithmic scale, one panel a motion, one line a step.
DOPPEL_API std::string verification_svg(const Verification& of);

}  // namespace doppel
