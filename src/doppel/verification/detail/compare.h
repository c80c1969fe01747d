#pragma once
// Private to the comparison of engines.

#include "doppel/verification/compare.h"

namespace doppel {

// Same, step or unexplained. `floor`: differences below are the same.
Explanation explanation_of(const Difference& difference, double floor);

// Unexplained joints first, of these those without unexplained joints below them, else in the model's order:
// an error in one body shows in all joints that carry it, and the joint that moves it is the last of them.
void lead_with_cause(const Model& model, std::vector<Difference>& joints);

}  // namespace doppel
