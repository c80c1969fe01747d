#pragma once
// A twin of the machine that checks command and measure, without a page, a network or a pace.

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "doppel/base/core/log.h"
#include "doppel/export.h"
#include "doppel/lab/recording/motion_recording.h"
#include "doppel/twin/assembly/twin.h"
#include "doppel/validation/checks/context.h"

namespace doppel {

// A way on which a client commands a joint.
struct DOPPEL_API JointWay {
  enum class Kind {
    trajectory,
    trajectory_action,
    forward,
    reference,
    position_service,  // sets the joint's position at once
    effort_service,    // an effort that acts on the joint from outside
  } kind = Kind::trajectory;
  std::string controller, address;     // address: the topic, the action or the service
  std::string interface = "position";  // of the joint that the controller claims
  std::vector<std::string> joints;     // all that one command has, in its order
  std::size_t index = 0;               // of the joint among them

  // "/arm_controller/joint_trajectory".
  [[nodiscard]] const std::string& name() const { return address; }
};

struct MachineOptions {
  std::optional<Duration> step = {};  // nullopt: that of the scenario
  bool start_controllers = true, enforce_limits = true;
  bool payload = false;  // the suite's, fixed to the tool
};

struct MachineState;  // a saved state

class DOPPEL_API MachineRun {
 public:
  // Throws InputError: the twin cannot be started.
  MachineRun(const CheckContext& context, const MachineOptions& options);
  ~MachineRun();
  MachineRun(const MachineRun&) = delete;
  MachineRun& operator=(const MachineRun&) = delete;

  [[nodiscard]] Twin& twin() { return *twin_; }
  [[nodiscard]] const Model& model() const { return twin_->robot().model(); }
  // The driven joints that are judged: all, or the one of the context.
  [[nodiscard]] const std::vector<int>& joints() const { return joints_; }
  [[nodiscard]] const ModelJoint& joint(int index) const {
    return model().joints[static_cast<std::size_t>(index)];
  }
  [[nodiscard]] bool slides(int index) const { return joint(index).type == JointType::prismatic; }
  [[nodiscard]] std::vector<JointWay> ways(int joint) const;
  // The reference topic of an active pid_controller of the joint's position, which no other one commands.
  [[nodiscard]] std::optional<JointWay> reference_way(int joint) const;
  // The simulator's services that reach a joint. None commands a drive.
  [[nodiscard]] std::vector<JointWay> service_ways(int joint) const;

  // rad or m, per s, N m or N.
  [[nodiscard]] double position(int joint) const;
  [[nodiscard]] double speed(int joint) const;
  [[nodiscard]] double effort(int joint) const;
  [[nodiscard]] DriveMode drive(int joint) const { return twin_->robot().instance().drive(joint); }
  [[nodiscard]] std::vector<std::pair<std::string, double>> posed() const;

  // Runs for simulated seconds, or until `is_over`, which is asked before each step. False: the physics has
  // diverged.
  bool run(double seconds, const std::function<void()>& after_step = {},
           const std::function<bool()>& is_over = {});
  // Sends a value for one joint; the others of the same command hold their position. `seconds`: in which a
  // trajectory gets there, or for which an effort acts.
  void send(const JointWay& way, double value, double seconds = 0);
  // Commands every base that follows a Twist to drive forward at `speed` (m/s) for half a second;
  // `observe` gets the way of the base so far, m, after each step.
  void drive_base(double speed, const std::function<void(double)>& observe);
  // Writes the positions of joints, at rest; controllers hold them. Refused: a joint does not exist.
  Status place(const std::vector<std::pair<std::string, double>>& positions);
  // Continues from a former state.
  [[nodiscard]] std::shared_ptr<const SavedState> save() { return twin_->save(); }
  void restore(const SavedState& state);
  // The response to the last command by a service: whether it is a refusal, and its text.
  [[nodiscard]] bool is_refused() const { return !answer_; }
  [[nodiscard]] const std::string& answer() const { return answer_.why(); }

  // Records from now on (lab/recording/motion_recording.h). restore() begins the recording anew, so that its
  // times ascend.
  void start_recording();
  [[nodiscard]] RecordedMotion finish_recording();

  // The lines of the log since the last call.
  [[nodiscard]] std::vector<LogLine> take_lines();

 private:
  void attach_payload(const CheckContext& context);
  void call(const JointWay& way, double value, double seconds);

  Log log_;
  std::mutex lines_mutex_;
  std::vector<LogLine> lines_;
  Diagnostics diagnostics_;
  std::unique_ptr<Twin> twin_;
  std::uint64_t goals_ = 0;  // that were sent
  std::unique_ptr<Edge> edge_;
  std::unique_ptr<MotionRecording> recording_;
  std::vector<int> joints_;
  Status answer_;
};

// "0.5 rad" or "20 mm".
[[nodiscard]] DOPPEL_API std::string position_text(double value, bool slides);
[[nodiscard]] DOPPEL_API std::string speed_text(double value, bool slides);

}  // namespace doppel
