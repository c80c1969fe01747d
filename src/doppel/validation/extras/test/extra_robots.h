#pragma once
// Small robots with closed forms, for the tests of the extras.

#include <memory>
#include <string>

#include "doppel/validation/checks/context.h"

namespace doppel {

// A description in a folder of its own, which is removed with it.
class WrittenRobot {
 public:
  explicit WrittenRobot(const std::string& urdf, const std::string& controllers = "");
  ~WrittenRobot();
  WrittenRobot(const WrittenRobot&) = delete;
  WrittenRobot& operator=(const WrittenRobot&) = delete;

  [[nodiscard]] const Subject& subject() const { return *subject_; }
  Suite suite;
  // With little work.
  [[nodiscard]] CheckContext context() const;

 private:
  std::string folder_;
  std::unique_ptr<Subject> subject_;
};

// A link with a point of `mass` at `x`, kg and m, with a small inertia of its own.
std::string bar_link(const std::string& name, double mass, double x, double inertia = 1e-4);
struct HingeText {
  std::string name, parent, child;
  double x = 0;  // m: origin in the parent
  std::string axis = "0 1 0";
  double effort = 100, velocity = 3, limit = 3, friction = 0, damping = 0;
};
std::string hinge_text(const HingeText& hinge);

// Two links of 0.3 m and 0.2 m along x, masses of 1 and 0.5 kg in their middles, horizontal axes; tool0 at
// the end.
std::string two_link_arm();

}  // namespace doppel
