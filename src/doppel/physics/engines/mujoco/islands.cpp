#include "doppel/physics/engines/mujoco/islands.h"

#include <algorithm>
#include <cstddef>

#include "doppel/physics/engines/mujoco/contact_rules.h"

namespace doppel {
namespace {

constexpr int kMaxCorrections = 10;  // of the slip of contacts, in a step

std::size_t place(int n) {
  return static_cast<std::size_t>(n);
}

template <class T>
void gather(T* to, const T* from, const std::vector<int>& indices) {
  for (const int index : indices) *to++ = from[index];
}

template <class T>
void scatter(T* to, const T* from, const std::vector<int>& indices) {
  for (const int index : indices) to[index] = *from++;
}

}  // namespace

IslandSolver::IslandSolver(const mjModel& model, const IslandLayout& layout, const ContactRules& rules)
    : layout_(&layout), rules_(&rules), model_(model), sliding_(rules.correct_slips() ? model.njmax : 0) {
  // One moving instance is one island: MuJoCo's own solution is used then, and nothing is kept for others.
  int moving = 0;
  for (int i = 0; i < layout.instances(); ++i) moving += layout.dofs(i) > 0 ? 1 : 0;
  if (moving < 2) return;
  data_ = make_data(&model);
  for (std::vector<int>* const of_dofs : {&parent_id_, &mass_row_, &simple_, &column_})
    of_dofs->resize(place(model.nv));
  parent_.resize(place(layout.instances()));
  next_instance_.resize(parent_.size());
  islands_.resize(parent_.size());
  row_instance_.resize(place(model.njmax));
  next_row_.resize(place(model.njmax));
  dofs_.reserve(place(model.nv));
  rows_.reserve(place(model.njmax));
}

// -- which instances and rows belong together

// The representative of the set that the instance belongs to (union-find).
int IslandSolver::root(int instance) {
  int& parent = parent_[place(instance)];
  while (parent != parent_[place(parent)]) parent = parent_[place(parent)];
  return parent;
}

// The smaller index becomes the root, so that the order of the islands is that of the instances.
void IslandSolver::join(int a, int b) {
  const int first = root(a), second = root(b);
  parent_[place(std::max(first, second))] = std::min(first, second);
}

// Joins the instances that a row acts on. Returns one of them, -1: none moves.
int IslandSolver::join_row(const mjModel& model, const mjData& data, int row) {
  const int id = data.efc_id[row];
  int a = 0, b = 0;  // bodies
  switch (data.efc_type[row]) {
    case mjCNSTR_EQUALITY:
      a = model.eq_obj1id[id];
      b = std::max(model.eq_obj2id[id], 0);
      if (model.eq_type[id] == mjEQ_JOINT) {
        a = model.jnt_bodyid[a];
        b = model.eq_obj2id[id] < 0 ? 0 : model.jnt_bodyid[b];
      }
      break;
    case mjCNSTR_FRICTION_DOF:
      a = model.dof_bodyid[id];
      break;
    case mjCNSTR_LIMIT_JOINT:
      a = model.jnt_bodyid[id];
      break;
    default:  // contacts: the engine's models have no tendons
      a = model.geom_bodyid[data.contact[id].geom1];
      b = model.geom_bodyid[data.contact[id].geom2];
  }
  const auto moving = [this](int body) {
    const int instance = layout_->instance_of_body[place(body)];
    return instance >= 0 && layout_->dofs(instance) > 0 ? instance : -1;
  };
  const int first = moving(a), second = moving(b);
  if (first >= 0 && second >= 0) join(first, second);
  return std::max(first, second);
}

// Divides instances and rows into islands. Returns false if there is at most one, which MuJoCo solves as it
// is.
bool IslandSolver::divide(const mjModel& model, const mjData& data) {
  if (data_ == nullptr || data.nefc == 0) return false;
  for (int i = 0; i < layout_->instances(); ++i) {
    parent_[place(i)] = i;
    islands_[place(i)] = {};
  }
  // Every row joins the instances that it acts on.
  for (int row = 0; row < data.nefc; ++row) row_instance_[place(row)] = join_row(model, data, row);
  int islands = 0;
  // The instances and rows of an island are linked lists; they are built from the end, so that each begins
  // with the smallest index.
  for (int i = layout_->instances() - 1; i >= 0; --i) {
    if (layout_->dofs(i) == 0) continue;
    islands += root(i) == i ? 1 : 0;
    int& first = islands_[place(root(i))].first_instance;
    next_instance_[place(i)] = first;
    first = i;
  }
  for (int row = data.nefc - 1; row >= 0; --row) {
    if (row_instance_[place(row)] < 0) continue;
    int& first = islands_[place(root(row_instance_[place(row)]))].first_row;
    next_row_[place(row)] = first;
    first = row;
  }
  return islands > 1;
}

// -- one island as a problem of its own

// Makes `model_` and `data_` the problem of one island: its degrees of freedom and rows, renumbered from 0.
void IslandSolver::enter(const mjModel& model, mjData& data, const Island& island) {
  dofs_.clear();
  for (int i = island.first_instance; i >= 0; i = next_instance_[place(i)]) {
    for (int dof = layout_->first_dof[place(i)]; dof < layout_->first_dof[place(i) + 1]; ++dof) {
      column_[place(dof)] = static_cast<int>(dofs_.size());
      dofs_.push_back(dof);
    }
  }
  rows_.clear();
  for (int row = island.first_row; row >= 0; row = next_row_[place(row)]) rows_.push_back(row);
  take_masses(model, data);
  data_->contact = data.contact;
  data_->ncon = data.ncon;
  take_rows(model, data);
}

// The blocks of the mass matrix. MuJoCo stores the rows of its lower triangle along the chain of parents, so
// a row is copied as it is; only the parents' numbers and the rows' addresses change.
void IslandSolver::take_masses(const mjModel& model, const mjData& data) {
  model_ = model;
  model_.nv = static_cast<int>(dofs_.size());
  model_.dof_parentid = parent_id_.data();
  model_.dof_Madr = mass_row_.data();
  model_.dof_simplenum = simple_.data();
  model_.stat.meaninertia = 0;
  int next = 0;
  for (std::size_t i = 0; i < dofs_.size(); ++i) {
    const int dof = dofs_[i], parent = model.dof_parentid[dof];
    parent_id_[i] = parent < 0 ? -1 : column_[place(parent)];
    simple_[i] = model.dof_simplenum[dof];
    mass_row_[i] = next;
    const int first = model.dof_Madr[dof];
    const int end = dof + 1 < model.nv ? model.dof_Madr[dof + 1] : model.nM;
    for (int k = first; k < end; ++k) data_->qM[next++] = data.qM[k];
    model_.stat.meaninertia += model.dof_M0[dof];
  }
  model_.stat.meaninertia /= model_.nv;
}

// The rows of constraints, with the counts of equalities and joint friction that come first.
void IslandSolver::take_rows(const mjModel& model, const mjData& data) {
  mjData& own = *data_;
  own.nefc = static_cast<int>(rows_.size());
  own.ne = own.nf = 0;
  gather(own.efc_type, data.efc_type, rows_);
  gather(own.efc_id, data.efc_id, rows_);
  gather(own.efc_pos, data.efc_pos, rows_);
  gather(own.efc_margin, data.efc_margin, rows_);
  gather(own.efc_frictionloss, data.efc_frictionloss, rows_);
  gather(own.efc_D, data.efc_D, rows_);
  gather(own.efc_R, data.efc_R, rows_);
  gather(own.efc_diagApprox, data.efc_diagApprox, rows_);
  for (int i = 0; i < own.nefc; ++i) {
    std::copy_n(data.efc_KBIP + 4 * rows_[place(i)], 4, own.efc_KBIP + 4 * i);
    own.ne += own.efc_type[i] == mjCNSTR_EQUALITY ? 1 : 0;
    own.nf += own.efc_type[i] == mjCNSTR_FRICTION_DOF ? 1 : 0;
    take_row(model, data, i);
  }
  if (mj_isSparse(&model_) != 0) transpose_rows();
}

// A row of the Jacobian. An island of few degrees of freedom is dense, as MuJoCo decides for it alone.
void IslandSolver::take_row(const mjModel& model, const mjData& data, int to) {
  mjData& own = *data_;
  const int row = rows_[place(to)], nv = model_.nv;
  if (mj_isSparse(&model) == 0) {
    gather(own.efc_J + to * nv, data.efc_J + row * model.nv, dofs_);
    return;
  }
  const double* const values = data.efc_J + data.efc_J_rowadr[row];
  const int* const columns = data.efc_J_colind + data.efc_J_rowadr[row];
  const int count = data.efc_J_rownnz[row];
  if (mj_isSparse(&model_) == 0) {
    std::fill_n(own.efc_J + to * nv, nv, 0.0);
    for (int k = 0; k < count; ++k) own.efc_J[to * nv + column_[place(columns[k])]] = values[k];
    return;
  }
  const int first = to == 0 ? 0 : own.efc_J_rowadr[to - 1] + own.efc_J_rownnz[to - 1];
  own.efc_J_rowadr[to] = first;
  own.efc_J_rownnz[to] = count;
  own.efc_J_rowsuper[to] = 0;  // only saves MuJoCo time
  for (int k = 0; k < count; ++k) {
    own.efc_J[first + k] = values[k];
    own.efc_J_colind[first + k] = column_[place(columns[k])];
  }
}

// MuJoCo's sparse solver also reads the transpose, as lists of the rows that act on a degree of freedom:
// they are counted, then filled in the order of the rows.
void IslandSolver::transpose_rows() {
  mjData& own = *data_;
  int* const counts = own.efc_JT_rownnz;
  std::fill_n(counts, model_.nv, 0);
  std::fill_n(own.efc_JT_rowsuper, model_.nv, 0);
  const int end = own.efc_J_rowadr[own.nefc - 1] + own.efc_J_rownnz[own.nefc - 1];
  for (int k = 0; k < end; ++k) ++counts[own.efc_J_colind[k]];
  int next = 0;
  for (int v = 0; v < model_.nv; ++v) {
    own.efc_JT_rowadr[v] = next;
    next += counts[v];
    counts[v] = 0;
  }
  for (int row = 0; row < own.nefc; ++row) {
    for (int k = own.efc_J_rowadr[row]; k < own.efc_J_rowadr[row] + own.efc_J_rownnz[row]; ++k) {
      const int v = own.efc_J_colind[k], at = own.efc_JT_rowadr[v] + counts[v]++;
      own.efc_JT[at] = own.efc_J[k];
      own.efc_JT_colind[at] = row;
    }
  }
}

// -- MuJoCo's functions, island by island

// The reference accelerations depend on the velocities of the island only.
void IslandSolver::refer(const mjModel& model, mjData& data) {
  if (!divide(model, data)) {
    mj_referenceConstraint(&model, &data);
    return;
  }
  for (const Island& island : islands_) {
    if (island.first_row < 0) continue;
    enter(model, data, island);
    gather(data_->qvel, data.qvel, dofs_);
    mj_referenceConstraint(&model_, data_.get());
    scatter(data.efc_vel, data_->efc_vel, rows_);
    scatter(data.efc_aref, data_->efc_aref, rows_);
  }
}

// Most steps need no correction: the slip changes little from step to step.
void IslandSolver::solve_rows(const mjModel& model, mjData& data) {
  rules_->expect_slip(model, data, sliding_);
  mj_fwdConstraint(&model, &data);
  for (int i = 0; i < kMaxCorrections && rules_->correct_slip(model, data, sliding_); ++i)
    mj_fwdConstraint(&model, &data);
}

void IslandSolver::solve(const mjModel& model, mjData& data) {
  if (!divide(model, data)) {
    solve_rows(model, data);
    return;
  }
  // Instances without constraints are not entered.
  std::copy_n(data.qacc_smooth, model.nv, data.qacc);
  std::fill_n(data.qfrc_constraint, model.nv, 0.0);
  std::fill_n(data.efc_force, data.nefc, 0.0);
  data.solver_iter = 0;
  for (const Island& island : islands_) {
    if (island.first_row < 0) continue;
    enter(model, data, island);
    solve_island(data);
  }
  std::copy_n(data.qacc, model.nv, data.qacc_warmstart);
}

void IslandSolver::solve_island(mjData& data) {
  mjData& own = *data_;
  gather(own.efc_aref, data.efc_aref, rows_);
  gather(own.qacc_smooth, data.qacc_smooth, dofs_);
  gather(own.qfrc_smooth, data.qfrc_smooth, dofs_);
  gather(own.qacc_warmstart, data.qacc_warmstart, dofs_);
  // The island begins with an empty stack, and with the accelerations of the step before as first guess.
  own.pstack = 0;
  solve_rows(model_, own);
  scatter(data.efc_aref, own.efc_aref, rows_);
  scatter(data.qacc, own.qacc, dofs_);
  scatter(data.qfrc_constraint, own.qfrc_constraint, dofs_);
  scatter(data.efc_force, own.efc_force, rows_);
  scatter(data.efc_state, own.efc_state, rows_);
  data.solver_iter = std::max(data.solver_iter, own.solver_iter);
}

}  // namespace doppel
