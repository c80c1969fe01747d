#pragma once
// The sensors of all robots and models of a twin, in its loop. /doppel/sensors (doppel_msgs/msg/Sensors, latched) lists
// them with the rates that they reach, once a second; /diagnostics warns of those that leave samples out.

#include <cstdint>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "doppel/export.h"
#include "doppel/ros/messages/diagnostic_msgs.h"
#include "doppel/scenario/compile/compiled_scenario.h"
#include "doppel/sensors/rigs/light_rig.h"
#include "doppel/sensors/rigs/physical_rig.h"
#include "doppel/twin/loop/tickable.h"
#include "doppel/twin/loop/twin_core.h"

namespace doppel {

class DOPPEL_API SensorTicks : public Tickable {
 public:
  explicit SensorTicks(TwinCore& core);

  [[nodiscard]] bool at_every_step() const override { return true; }
  void before_step(Time /*now*/) override {
    if (!changed_) physical_.before_step(scene_.engine());
  }
  void after_step(Time now) override { light_.after_step(now, scene_.engine()); }
  Time publish(Time now) override { return changed_ ? now : physical_.publish(scene_.engine()); }
  [[nodiscard]] Time next_after(Time /*now*/) const override { return physical_.next(); }
  void between_steps(Time now) override;
  void reset(Time now) override;
  void save(SavedSlot& slot) override;
  void restore(const SavedPart* saved, Time now) override;
  // Only noted: a reload may be undone, and nodes must not be destroyed while it is under way.
  void instances_changed() override { changed_ = true; }
  [[nodiscard]] std::vector<RigStatus> status() const;

 private:
  void look_up();
  // The page and other readers read anew what follows from a sensor's values, such as camera_info.
  void number_revisions(std::vector<RigSensor>& sensors);
  void list_sensors();
  void report_shared_topics();
  void write_diagnostics();  // what is listed; no allocation
  // A frame of a sensor of a model that moves and is no robot.
  struct MovingFrame {
    std::string model;
    int instance = -1, link = 0;
    Pose X_LF = Pose::Identity();
  };
  // The frames of models, in "world": of static ones on /tf_static, of others on /tf.
  void find_frames(const std::vector<ModelSensors>& models);
  [[nodiscard]] Pose pose_of(const MovingFrame& frame) const;
  void publish_moving(Time now);

  TwinCore& core_;
  Bus& bus_ = core_.bus();
  const Scene& scene_ = core_.scene();
  const Log& log_ = core_.log();
  std::unique_ptr<Node> frames_node_;  // nullptr: there are no such frames
  Publisher<tf2_msgs::msg::TFMessage> tf_static_, tf_;
  std::vector<MovingFrame> moving_;
  tf2_msgs::msg::TFMessage moving_message_;  // a transform for each of them
  Time frames_due_ = Time::min();
  std::vector<std::shared_ptr<const CompiledRobot>> known_;  // of which the rigs' sensors are
  std::shared_ptr<const std::vector<ModelSensors>> known_models_;
  std::vector<RigSensor> numbered_;  // the present ones with their revisions
  std::uint64_t revision_ = 0;       // of the last edit
  LightRig light_;
  PhysicalRig physical_;
  std::optional<Node> list_node_;  // while there are sensors
  Publisher<doppel_msgs::msg::Sensors> list_topic_;
  doppel_msgs::msg::Sensors list_;  // first those of light, then the physical ones
  Publisher<diagnostic_msgs::msg::DiagnosticArray> diagnostics_topic_;
  diagnostic_msgs::msg::DiagnosticArray diagnostics_;           // of those of light
  std::vector<std::uint64_t> left_out_before_, failed_before_;  // at the last message, or the last edit
  std::set<std::string> shared_;                                // reports of topics that sensors share
  std::size_t lights_ = 0;                                      // number of the former
  Time list_due_ = Time::min();
  bool changed_ = false;
};

}  // namespace doppel
