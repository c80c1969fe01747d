#pragma once
// Private to the MuJoCo back end: an mjData as a state has it. MuJoCo 2.2 lays one out for the most rows of
// constraints that the model may have, with two matrices of their number squared that only its dual solvers
// use (1.9 of 2.1 MB for omarm_one), and clears and copies all of it. Here those two are left out, rows are
// memory that nobody touches before a constraint needs it, and only what is in use is copied.

#include <mujoco/mujoco.h>

#include <memory>

namespace doppel {

struct DataDeleter {
  void operator()(mjData* data) const;
};
using DataHandle = std::unique_ptr<mjData, DataDeleter>;

// As after mj_resetData. For models of MuJoCo's primal solvers, without noslip. Throws std::bad_alloc.
DataHandle make_data(const mjModel* model);
// Precondition: both were made for `model`. Does not allocate. What MuJoCo tells of its solver's iterations
// (mjData::solver) stays behind.
void copy_data(const mjModel* model, mjData* to, const mjData* from);

}  // namespace doppel
