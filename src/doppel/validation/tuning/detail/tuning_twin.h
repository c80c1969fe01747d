#pragma once
// Twins of the machine with other gains, masses, friction and delay than its files have.

#include <optional>
#include <string>
#include <vector>

#include "doppel/validation/motions/step_trials.h"
#include "doppel/validation/tuning/tune.h"

namespace doppel {

// Factors of masses, friction and delay.
struct Perturbation {
  double mass = 1, friction = 1, delay = 1;
};

// A machine with the gains of its file, or with new ones.
class TuningTwin {
 public:
  // `joints`: whose controllers get their gains from `gains` [joints]; none: those of the file.
  TuningTwin(const Subject& subject, const Suite& suite, const TuneOptions& options,
             const std::vector<TunedJoint>& joints)
      : subject_(subject), suite_(suite), options_(options), joints_(joints) {}

  using Gains = std::vector<std::optional<LoopGains>>;  // [joints]

  // The steps at the places, with and without payload, or with one of both. Throws CheckCancelled.
  [[nodiscard]] std::vector<StepTrial> run(const Gains& gains, const std::vector<StepPlace>& places,
                                           const Perturbation& perturbation,
                                           std::optional<bool> payload = {}) const;

  // The subject with these gains in place of those of its file.
  [[nodiscard]] Subject variant(const Gains& gains, const Perturbation& perturbation) const;

 private:
  const Subject& subject_;
  const Suite& suite_;
  const TuneOptions& options_;
  const std::vector<TunedJoint>& joints_;
};

// The worst of a joint's steps.
[[nodiscard]] WorstStep worst_step(const std::vector<StepTrial>& trials, const std::string& joint,
                                   const Suite& suite);

// Replaces the joint's gains by a relay around what holds it at the start pose. `index`: among `joints`.
[[nodiscard]] RelayCheck check_by_relay(const TuningTwin& twin, const Suite& suite,
                                        const std::vector<TunedJoint>& joints, std::size_t index,
                                        const TuningTwin::Gains& gains, const std::vector<StepPlace>& places);

}  // namespace doppel
