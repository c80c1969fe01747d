#pragma once
// Private to the MuJoCo back end: the mjData of a state. MuJoCo 2.2 allocates it for the largest number of
// constraint rows of the model, with two matrices of that number squared that only its dual solvers use (1.9
// of 2.1 MB for omarm_one), and clears and copies all of it. Here those two are left out, the memory of rows
// is not touched before a constraint needs it, and only the part in use is copied.

#include <mujoco/mujoco.h>

#include <memory>

namespace doppel {

struct DataDeleter {
  void operator()(mjData* data) const;
};
using DataHandle = std::unique_ptr<mjData, DataDeleter>;

// Data as after mj_resetData. For models of MuJoCo's primal solvers, without noslip. Throws std::bad_alloc.
DataHandle make_data(const mjModel* model);
// Precondition: both were made for `model`. Does not allocate. The statistics of the solver's iterations
// (mjData::solver) are not copied.
void copy_data(const mjModel* model, mjData* to, const mjData* from);

}  // namespace doppel
