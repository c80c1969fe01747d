#pragma once
// The fits of a recording that `doppel identify fit` and `doppel identify report` share.

#include <optional>
#include <string>
#include <vector>

#include "app/description_target.h"
#include "app/verbs/identify.h"
#include "doppel/review/identification/servo_fit.h"

namespace CLI {
class App;
}

namespace doppel::app {

struct FitRequest {
  std::vector<std::string> words;  // TARGET and its arguments
  std::vector<std::string> recordings;
  std::string last = "M2";
  PayloadWords payload;  // of the last recording
  std::vector<std::string> joints;
};
void add_fit_request(CLI::App& verb, FitRequest& request);

struct JointFit {
  std::string joint;
  bool slides = false;
  double seconds = 0;
  JointRecord record;
  ServoValues start{};
  ServoFit fit;
};
struct RecordingFits {
  DescriptionTarget target;
  std::string robot;
  std::vector<JointFit> joints;
};

// Warnings and the progress go to stderr. nullopt: interrupted. Throws InputError.
std::optional<RecordingFits> fit_recording(const FitRequest& request);

// "identified", or why it is not.
std::string assessment(const ServoFit& fit, ServoQuantity quantity);
std::vector<ServoQuantity> fitted_quantities(const ServoFit& fit);
bool has_result(const ServoFit& fit);
std::string fit_table(const JointFit& one);

// Names, hashes and date of recordings, for the evidence of what is written.
std::string recording_evidence(const std::vector<std::string>& recordings);

}  // namespace doppel::app
