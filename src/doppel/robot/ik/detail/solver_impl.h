#pragma once
// Private to this module: what an IkSolver is made of.

#include <optional>
#include <vector>

#include "doppel/robot/ik/detail/analytic_arm.h"
#include "doppel/robot/ik/detail/starts.h"
#include "doppel/robot/ik/ik_solver.h"
#include "doppel/robot/lanes/lane_program.h"

namespace doppel {

// A way by sub-problems: the arm, or an arm with one joint held.
struct AnalyticWay {
  ArmAxes axes;
  std::optional<AnalyticArm> arm;  // of the axes as they are
  int held = -1;                   // of seven joints; its arm is found for each position
  double misfit = 0;
};

struct IkSolver::Impl {
  Impl(std::shared_ptr<const Model> the_model, Chain the_chain)
      : model(std::move(the_model)),
        chain(std::move(the_chain)),
        program(chain),
        kernels(lane_kernels()),
        space(find_task_space(chain)),
        starts(halton_starts(chain, kIkAttempts)) {
    find_way();
  }

  void find_way();
  [[nodiscard]] bool is_exact() const { return way && way->misfit <= kExactArm; }
  [[nodiscard]] bool place(Eigen::VectorXd& u, const Eigen::VectorXd& seed, double slack) const;
  [[nodiscard]] Eigen::VectorXd seed_of(const IkRequest& request) const;
  [[nodiscard]] LaneSearch search_of(const IkRequest& request, bool wide = false) const;
  [[nodiscard]] const double* start_at(int index) const { return starts.data() + index * chain.size(); }
  [[nodiscard]] IkSolution measured(const IkRequest& request, const Eigen::VectorXd& u) const;
  [[nodiscard]] bool proven(const IkRequest& request, const IkSolution& solution) const;
  [[nodiscard]] static bool contains(const std::vector<IkSolution>& solutions, const Eigen::VectorXd& u);
  void keep(const IkRequest& request, const Eigen::VectorXd& seed, const double* u, bool limited,
            std::vector<IkSolution>& out) const;
  // Runs a search from `count` starting points, and keeps what it finds.
  void run(LaneSearch& search, const IkRequest& request, const Eigen::VectorXd& seed,
           const double* starts_of_search, std::size_t count, bool limited,
           std::vector<IkSolution>& out) const;
  // The branches of an exact arm with their distance from the seed, the nearest first, not measured.
  void exact_branches(const IkRequest& request, const Eigen::VectorXd& seed, bool limited,
                      std::vector<IkSolution>& out) const;
  // Refines `count` configurations [count][variables] at once, and keeps the solutions.
  void refine(const IkRequest& request, const Eigen::VectorXd& seed, const double* first, std::size_t count,
              bool limited, std::vector<IkSolution>& out) const;
  // Measures a branch, and refines it where the sub-problems have lost digits. False: it is no solution.
  [[nodiscard]] bool prove(const IkRequest& request, const Eigen::VectorXd& seed, bool limited,
                           IkSolution& branch) const;
  [[nodiscard]] std::optional<IkSolution> nearest_exact_branch(const IkRequest& request,
                                                               const Eigen::VectorXd& seed) const;
  void branches(const IkRequest& request, const Eigen::VectorXd& seed, bool limited, bool sweep,
                std::vector<IkSolution>& out) const;
  // Seven joints, one of them held at the seed, and with `sweep` also spread over its range.
  void held_branches(const IkRequest& request, const Eigen::VectorXd& seed, bool sweep,
                     std::vector<Branch>& out) const;
  // The accepted configuration that comes nearest to the pose; `refused`: those that request.accepts refuses.
  [[nodiscard]] std::optional<IkSolution> nearest_found(const IkRequest& request, const Eigen::VectorXd& seed,
                                                        bool in_reach,
                                                        std::vector<Eigen::VectorXd>& refused) const;
  void attempts(const IkRequest& request, const Eigen::VectorXd& seed, int first, int count, bool limited,
                std::vector<IkSolution>& out, bool wide = false) const;
  [[nodiscard]] std::optional<IkSolution> search(const IkRequest& request, const Eigen::VectorXd& seed) const;
  [[nodiscard]] std::optional<IkSolution> nearest_accepted(const IkRequest& request,
                                                           const Eigen::VectorXd& seed,
                                                           const std::vector<Eigen::VectorXd>& refused) const;

  std::shared_ptr<const Model> model;
  Chain chain;
  LaneProgram program;
  const LaneKernels& kernels;
  TaskSpace space;
  std::vector<double> starts;  // [kIkAttempts][variables]
  std::optional<AnalyticWay> way;
};

}  // namespace doppel
