#pragma once
// Gains of a machine's controllers that pass T4 with margin: from a model of each joint, verified in the
// twin.

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "doppel/export.h"
#include "doppel/validation/checks/context.h"
#include "doppel/validation/tuning/loop_design.h"

namespace doppel {

struct TuneOptions {
  std::string joint;                // the only one that is tuned; empty: all
  std::optional<double> bandwidth;  // rad/s, not exceeded
  double transport = 0;             // s: delay of the real arm besides the controller's period
  bool relay = false;               // cross-check of the models by relays in the twin
  std::size_t jobs = 1;             // threads
  // Called with the completed fraction and what is done, from one thread at a time; false: the work ends with
  // CheckCancelled. May be empty.
  std::function<bool(double done, const std::string& what)> progress = {};
};

// The worst step of a joint over poses and loads.
struct WorstStep {
  bool judged = false, passed = false;
  double overshoot = 0, settling = 0, error = 0,
         peak_effort = 0;  // the worst of each; of 1, s, rad or m, of 1
  double saturated = 0;    // share of the time at the effort limit, at the place
  double use = 0;          // the largest share of a limit: above 1 it fails
  std::string place;       // where: "heaviest pose, with payload"
  std::string message;     // the limits that it misses and the cause
};

// A rule's gains, and what T4 at the start pose makes of them.
struct RuleTrial {
  TuningRule rule = TuningRule::ziegler_nichols;
  LoopGains gains;
  WorstStep step;
};

struct RelayCheck {
  std::string refusal;  // why there is no ultimate point; empty: there is one
  UltimatePoint relay, model;
  std::vector<RuleTrial> rules;
};

struct DOPPEL_API TunedJoint {
  std::string joint, controller, type;
  std::string interface;              // that the controller commands: "position", "effort", "velocity"
  bool gains_act = false;             // the controller has gains, and they act
  bool slides = false;                // N, m and kg in place of N m, rad and kg m^2
  double stiffness = 0, damping = 0;  // of the servo
  double period = 0;                  // s, of the controller
  JointPlant plant;
  std::optional<LoopGains> old_gains;  // as written; none: the file has none
  std::optional<LoopDesign> design;    // none: no bandwidth has the margins, or the gains do not act
  WorstStep before, after;             // with the old and the new gains
  WorstStep perturbed;                 // over the runs with other masses, friction and delay
  std::string why_not_faster;
  std::optional<RelayCheck> relay;

  [[nodiscard]] DOPPEL_API bool passed() const;
};

struct DOPPEL_API TuneReport {
  std::string robot, target, version;
  double payload = 0;  // kg
  int runs = 0;        // with other masses, friction and delay
  std::vector<TunedJoint> joints;
  std::vector<std::string> notes;
  double seconds = 0;  // of wall-clock time

  [[nodiscard]] DOPPEL_API bool passed() const;
  [[nodiscard]] DOPPEL_API bool any_gains_act() const;
};

// Throws InputError: the twin cannot be started; CheckCancelled: `progress` has ended it.
DOPPEL_API TuneReport tune(const Subject& subject, const Suite& suite, const TuneOptions& options);

// The text of a controllers' file with the new gains of the report; all other bytes stay. Throws InputError:
// a form that cannot be edited, with what to write by hand.
DOPPEL_API std::string with_new_gains(const std::string& text, const std::filesystem::path& file,
                                      const TuneReport& report);
// The file with the gains: the last one with gains of the report's controllers, else the last one that
// declares their parameters. Empty: none.
DOPPEL_API std::filesystem::path gains_file(const Subject& subject, const TuneReport& report);

DOPPEL_API std::string to_text(const TuneReport& report);
DOPPEL_API std::string to_json(const TuneReport& report);

}  // namespace doppel
