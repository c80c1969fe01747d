#pragma once
// The same robot, world and commands in several engines: the difference between engines, compared with the
// own error of each (its motion at h against that at h/2), which separates explained from unexplained
// differences. docs/engines.md has the rules.

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "doppel/export.h"
#include "doppel/lab/verification/motion.h"

namespace doppel {

inline constexpr double kOwnErrors = 3.0;  // times the summed own errors: differences that steps explain
inline constexpr double kSame = 1e-6;      // rad or m: motions that differ by less are the same
// Of the largest effort of a joint: rounding error of an acceleration measured over microseconds.
inline constexpr double kSameEffort = 1e-6;
inline constexpr double kSamePose = 1e-9;  // m and rad
inline constexpr int kStaticConfigurations = 200;

struct ComparedEngine {
  MotionSubject subject;  // with the engine's name
  std::string label;      // "mujoco 2.2.2"
};

enum class Explanation {
  same,         // below rounding
  step,         // below kOwnErrors times the summed own errors
  modelling,    // disappears when a feature is disabled that the engines model in different ways
  unexplained,  // none of them
};
DOPPEL_API const char* name_of(Explanation explanation);

struct Difference {
  std::string name;          // of the joint or link
  const char* unit = "rad";  // "rad", "m", "N m", "N"
  double largest = 0;        // of any two engines
  double at = 0;             // s
  std::vector<double> own;   // [engines] largest own error
  Explanation explanation = Explanation::same;
};

// The engines in single states without motion: the poses of links, and the efforts that correspond to the
// computed accelerations by doppel's inverse dynamics (gravity, Coriolis forces, inertia, damping). The robot
// has no friction, limits, mimics and contacts.
struct StaticsComparison {
  int configurations = 0;
  std::vector<Difference> links;   // poses, in the order of the model
  std::vector<Difference> joints;  // efforts; unexplained ones first, those farthest from the root leading
};

struct MotionComparison {
  MotionKind kind{};
  std::vector<Difference> joints;       // as in StaticsComparison, else by the model's order
  double tool_largest = 0;              // m
  std::string feature;                  // the explanation of joints with Explanation::modelling
  std::optional<double> chaotic_after;  // s: the comparison ends there
  std::vector<std::string> ran_away;    // labels
  double span = 0;                      // s: compared time
  std::vector<double> time;
  std::vector<double> difference;        // rad or m: of the joint with the largest difference, at each time
  std::vector<std::vector<double>> own;  // [engines][times]
};

struct DOPPEL_API Comparison {
  std::string robot, world, tool;
  std::vector<std::string> engines;  // labels
  double step = 0, duration = 0;     // s
  std::optional<StaticsComparison> statics;
  std::vector<MotionComparison> motions;

  [[nodiscard]] bool explained() const;  // nothing is unexplained, and no engine diverged
};

struct CompareOptions {
  double duration = 2.0;  // s
  bool statics = true;
  std::vector<MotionKind> motions;
  std::string tool;  // link; empty: choose_tool()
  // Called before each run.
  std::function<void(const std::string& scenario, const std::string& engine)> on_run;
};

// Throws std::invalid_argument if the models of the engines differ in their numbers of joints, InputError if
// an engine rejects the robot or no link has the tool's name.
DOPPEL_API Comparison compare_engines(const std::vector<ComparedEngine>& engines,
                                      const CompareOptions& options);

DOPPEL_API StaticsComparison compare_statics(const std::vector<ComparedEngine>& engines);

// "fall        explained by the step: 2.1e-04 rad at most over 2 s"
DOPPEL_API std::string verdict_line(const MotionComparison& motion);
DOPPEL_API std::string verdict_line(const StaticsComparison& statics);
DOPPEL_API std::string comparison_text(const Comparison& of);
DOPPEL_API std::string comparison_json(const Comparison& of);
// Difference and own errors over time on a logarithmic scale.
DOPPEL_API std::string comparison_svg(const Comparison& of, const MotionComparison& motion);

}  // namespace doppel
