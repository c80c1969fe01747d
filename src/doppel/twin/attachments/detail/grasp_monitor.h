#pragma once
// Looks at what robots hold between their fingers (physics/contract/grasp.h), between steps: 20 times a second of
// simulated time, 50 times while something is held, and never in a world where nothing can be held.
//
// /doppel/grasps (diagnostic_msgs/msg/DiagnosticArray, at each look while there are subscribers, empty if nothing is
// held): a status for each held body, and one for each attachment (Engine::attach()). Its values are robot, object, links, force (N), friction used (%), slip (mm),
// held for (s), weight (N). WARN: more than 90 % of the friction is used; ERROR: the body slips.
//
// A body that slips is logged once for each grasp, with the cause.

#include <string>
#include <vector>

#include "doppel/base/core/log.h"
#include "doppel/physics/contract/grasp.h"
#include "doppel/ros/bus/bus.h"
#include "doppel/ros/messages/diagnostic_msgs.h"
#include "doppel/twin/loop/scene.h"
#include "doppel/twin/loop/tickable.h"

namespace doppel {

class GraspMonitor : public Tickable {
 public:
  // Scene and log outlive it.
  GraspMonitor(Bus& bus, const Scene& scene, const Log& log);

  void between_steps(Time now) override {
    const bool attached = !scene_.engine().attachments().empty();
    if ((can_hold_ || attached) && (now >= next_look_ || now < last_look_)) look(now);
  }
  void show(Time now) override { next_look_ = now; }
  void reset(Time now) override;
  void instances_changed() override;
  // The grasps; it looks again at once.
  void save(SavedSlot& slot) override { save_run(held_, slot); }
  void restore(const SavedPart* saved, Time /*now*/) override {
    if (saved != nullptr) restore_run(*saved, held_);
  }

 private:
  // The point of a link and the point of the body that met when the link began to touch.
  struct Mark {
    int link = 0;
    Eigen::Vector3d p_L = Eigen::Vector3d::Zero(), p_B = Eigen::Vector3d::Zero();  // m
    double slip = 0;                                                               // m
  };
  struct Held {
    std::string robot, object;  // instances
    int body_link = 0;
    Time since{};
    std::vector<Mark> marks;
    double slip = 0;  // m, the largest of the marks
    bool slips = false, reported = false, creep_reported = false;
    [[nodiscard]] bool is(const Scene& scene, const Grasp& grasp) const;
  };
  void look(Time now);
  Held follow(const Grasp& grasp, Time now) const;
  void measure_slip(const Grasp& grasp, Held& held) const;
  void report(const Grasp& grasp, Held& held) const;
  void report_creep(const Grasp& grasp, Held& held) const;
  [[nodiscard]] std::string names_of_links(const Grasp& grasp) const;
  [[nodiscard]] double weight_of(const Grasp& grasp) const;  // N
  [[nodiscard]] std::string cause_of(const Grasp& grasp) const;
  [[nodiscard]] diagnostic_msgs::msg::DiagnosticStatus status_of(const Grasp& grasp, const Held& held,
                                                                 Time now) const;
  void publish_grasps(Time now) const;

  const Scene& scene_;
  const Log& log_;
  Node node_;
  Publisher<diagnostic_msgs::msg::DiagnosticArray> topic_;
  bool can_hold_ = false;
  Time next_look_{}, last_look_{};
  std::vector<Contact> contacts_;
  std::vector<Grasp> grasps_;
  std::vector<Held> held_;  // of each grasp
};

}  // namespace doppel
