#pragma once
// Private to the comparison of engines.

#include "doppel/lab/verification/compare.h"

namespace doppel {

// Explanation::same, step or unexplained. `floor`: differences below it are the same.
Explanation explanation_of(const Difference& difference, double floor);

// Orders unexplained joints first, among these the ones without unexplained joints below them, else by the
// model's order: an error in one body affects all joints that carry it, and the joint that moves it is the
// last of them.
void lead_with_cause(const Model& model, std::vector<Difference>& joints);

}  // namespace doppel
