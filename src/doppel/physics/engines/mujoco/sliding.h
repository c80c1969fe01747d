#pragma once
// Private to the MuJoCo back end: what is known of sliding contacts while the constraints of an island are solved.

#include <cstddef>
#include <vector>

namespace doppel {

// The scratch of a solution, by the rows of the constraints. A contact has the row of its normal.
struct SlidingRows {
  explicit SlidingRows(int rows) {
    for (std::vector<double>* const row : {&reference, &slip, &earlier_slip, &earlier_gap, &acceleration})
      row->resize(static_cast<std::size_t>(rows));
  }
  std::vector<double> reference;     // m/s^2 of the normal, without the slip
  std::vector<double> slip;          // m/s^2, subtracted from it
  std::vector<double> earlier_slip;  // m/s^2, before the latest correction
  std::vector<double> earlier_gap;   // m/s^2, then: of the solution's slip beyond the subtracted one
  std::vector<double> acceleration;  // m/s^2 or rad/s^2, of every row
};

}  // namespace doppel
