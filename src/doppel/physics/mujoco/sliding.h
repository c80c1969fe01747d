#pragma once
// Private to the MuJoCo back end: what is known of sliding contacts while the constraints of an island are solved.

#include <cstddef>
#include <vector>

namespace doppel {

// By rows of the constraints; of a contact, the row of its normal counts. Scratch.
struct SlidingRows {
  explicit SlidingRows(int rows) {
    for (std::vector<double>* const of : {&reference, &slip, &earlier_slip, &earlier_gap, &acceleration})
      of->resize(static_cast<std::size_t>(rows));
  }
  std::vector<double> reference;     // m/s^2 of the normal, without the slip
  std::vector<double> slip;          // m/s^2, subtracted from it
  std::vector<double> earlier_slip;  // m/s^2, before the latest correction
  std::vector<double> earlier_gap;   // m/s^2, then: of the solution's slip beyond the subtracted one
  std::vector<double> acceleration;  // m/s^2 or rad/s^2, of every row
};

}  // namespace doppel
