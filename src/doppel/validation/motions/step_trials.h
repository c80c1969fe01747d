#pragma once
// Steps of single joints through their real controllers, with their figures: T4, and the verification of
// gains.

#include <Eigen/Core>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "doppel/export.h"
#include "doppel/lab/curve_plot/curve_plot.h"
#include "doppel/validation/checks/context.h"
#include "doppel/validation/metrics/step_response.h"
#include "doppel/validation/motions/machine_run.h"

namespace doppel {

// A joint, and the configuration at which it makes its step.
struct StepPlace {
  std::string joint, pose;           // "start pose", "heaviest pose", "stretched pose", "folded pose"
  std::optional<Eigen::VectorXd> q;  // [nq] of Subject::model; none: where the twin starts
  double height = 0;                 // rad or m, signed; 0: there is no room for a step
};

enum class StepPoses { standard, all };  // start and heaviest pose; also stretched and folded

// The places of the joints that the context judges, on ways that touch neither the robot nor the ground.
DOPPEL_API std::vector<StepPlace> step_places(const CheckContext& context, StepPoses poses);

struct DOPPEL_API StepTrial {
  StepPlace place;
  bool payload = false;
  bool commanded = true;  // false: no active controller takes positions of the joint
  bool slides = false;
  std::string refusal;  // why the pose was not taken; empty: it was
  double start = 0, height = 0;
  double limited_time = 0;  // s that the step takes by the speed limit alone, where it is shrunk for it
  double diverged = 0;      // s after the step at which the physics diverged; 0: it did not
  std::optional<StepFigures> figures;
  double peak_effort = 0;  // of the effort limit
  double saturated = 0;    // share of the time, until it is settled, at the effort limit
  double effort = 0;       // N m or N: the limit
  double speed = 0;        // rad/s or m/s: the limit
  double coupling = 0;     // largest motion of another joint, rad or m
  PlotPanel panel;
  std::vector<std::pair<std::string, double>> posed;  // at its end

  // "Revolute 2, heaviest pose, with payload".
  [[nodiscard]] std::string subject() const;
  // The limits that it misses: "settling 0.61 s (limit 0.5 s)"; empty: none.
  [[nodiscard]] DOPPEL_API std::vector<std::string> misses(const StepResponseLimits& limits) const;
  // The reason of a miss, by what the drive did.
  [[nodiscard]] DOPPEL_API std::string cause() const;
};

inline double error_limit(const StepResponseLimits& limits, bool slides) {
  return slides ? limits.slide_error : limits.error;
}

// Runs the steps one after the other, each from the state that the machine has now. `report` is called with
// the completed number.
DOPPEL_API std::vector<StepTrial> run_steps(const CheckContext& context, MachineRun& machine, bool payload,
                                            const std::vector<StepPlace>& places,
                                            const std::function<void(std::size_t)>& report = {});

}  // namespace doppel
