#pragma once
// Motions of several joints of a twin through its controllers.

#include <Eigen/Core>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "doppel/validation/motions/machine_run.h"

namespace doppel {

class JointMotion {
 public:
  // `joints`: names. Each has to have a position command on a topic; missing() is the first that has none.
  JointMotion(MachineRun& machine, const std::vector<std::string>& joints);
  [[nodiscard]] const std::string& missing() const { return missing_; }
  // s: the slowest tick of the controllers.
  [[nodiscard]] double period() const;

  // Positions [joints] at a time in s after the begin of the motion; they begin where the joints are.
  using Course = std::function<Eigen::VectorXd(double)>;
  // Moves for `seconds` along the course, which trajectory controllers get in points `step` apart, and rests
  // for `rest`. after_step() gets the time since the begin of the motion, which is negative before it.
  // False: the physics has diverged.
  bool run(const Course& course, double seconds, double step, double rest,
           const std::function<void(double)>& after_step);

 private:
  struct Command {
    JointWay way;
    std::vector<std::optional<std::size_t>> indices;  // of the way's joints among those of the motion
  };
  [[nodiscard]] std::vector<double> values(const Command& command, const Eigen::VectorXd& positions) const;
  void send_trajectory(const Command& command, const Course& course, double seconds, double step, Time begin);
  void send_values(const Command& command, const Eigen::VectorXd& positions);

  MachineRun& machine_;
  std::unique_ptr<Edge> edge_;
  std::vector<Command> commands_;
  std::string missing_;
};

}  // namespace doppel
