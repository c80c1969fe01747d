#pragma once
// Private to the MuJoCo back end: the friction of each contact where MuJoCo's own rule, the larger coefficient
// of the two in every direction, is not that of the world (detail/contact_rule.h). The rules are applied
// between the detection of contacts and the constraints that are made of them.

#include <mujoco/mujoco.h>

#include <vector>

#include "doppel/physics/contract/detail/contact_rule.h"
#include "doppel/physics/engines/mujoco/bounces.h"
#include "doppel/physics/engines/mujoco/islands.h"
#include "doppel/physics/engines/mujoco/sliding.h"

namespace doppel {

// A shape of MuJoCo's model.
struct RuledShape {
  Friction friction;
  int direction_body = 0;  // MuJoCo's body in whose axes the direction is
  bool ruled = false;      // of an instance that has wheels, or a friction that MuJoCo's own rule cannot give
};

// A shape of MuJoCo's model, of a robot that can hold something or of a body that can be held (grasp.h).
struct GripShape {
  int robot = -1;  // instance; -1: not of a robot
  int held = -1;   // MuJoCo's body; -1: cannot be held
  int link = -1;   // MuJoCo's body
};

class ContactRules {
 public:
  ContactRules() = default;
  // shapes, grips: of each geom.
  // loose: shapes of objects and of the ground; empty: no object moves.
  ContactRules(FrictionRule rule, std::vector<RuledShape> shapes, std::vector<GripShape> grips,
               std::vector<bool> loose);

  // No shape needs a rule: every contact is as MuJoCo found it.
  [[nodiscard]] bool empty() const { return shapes_.empty(); }
  // These act on the contacts of ruled shapes, or on all with another rule than MuJoCo's, so that a robot
  // without wheels moves as it does in a world without robots that have some. They do not allocate.
  // Writes the friction and the tangents.
  void apply(mjData& data) const;
  // The functions below also act on the contacts of a robot with a body that two of its links hold (grasp.h).
  // MuJoCo's friction is a stiff damper, so that a load creeps. On a slope of 80 % of the friction a parked base
  // creeps by 0.25 mm a minute; a hundred times stiffer, by 0.003 mm. A pair with slip is as soft as that slip asks.
  void stiffen_friction(mjData& data) const;

  // MuJoCo's friction is a convex optimisation, whose contacts open with the speed mu v while they slide with
  // the speed v, and so hop. Subtracting it from the reference of the normal gives Coulomb's law (de Saxce and
  // Feng, International Journal of Engineering Science 29, 1991). v is that at the end of the step, which the
  // solution determines: the two functions below estimate it before the constraints of an island are solved,
  // and correct it afterwards. They change only contacts that slide, and also act on those of objects among
  // themselves and with the ground.
  [[nodiscard]] bool correct_slips() const { return !empty() || !grips_.empty() || !loose_.empty(); }
  void expect_slip(const mjModel& model, mjData& data, SlidingRows& sliding) const;
  // False: every slip is that of the solution. True: the constraints have to be solved again.
  bool correct_slip(const mjModel& model, mjData& data, SlidingRows& sliding) const;

 private:
  [[nodiscard]] bool ruled(const mjContact& contact) const;
  // A contact of a robot's shape with one that can be held.
  struct Touch {
    int robot = -1, held = -1, link = -1;
    double into = 1;  // the sign of the contact's normal into the held body
  };
  [[nodiscard]] Touch touch_of(const mjContact& contact) const;
  [[nodiscard]] bool holds(const mjData& data, const mjContact& contact) const;
  [[nodiscard]] bool slides_by_coulomb(const mjData& data, const mjContact& contact) const {
    return (!empty() && ruled(contact)) || (!grips_.empty() && holds(data, contact));
  }
  [[nodiscard]] bool between_objects(const mjContact& contact) const {
    return !loose_.empty() && loose_[static_cast<std::size_t>(contact.geom1)] &&
           loose_[static_cast<std::size_t>(contact.geom2)];
  }
  [[nodiscard]] bool obeys_coulomb(const mjData& data, const mjContact& contact) const {
    return between_objects(contact) || slides_by_coulomb(data, contact);
  }
  [[nodiscard]] double slip_of(const mjContact& contact) const;  // m/s per N
  void apply(const mjData& data, mjContact& contact) const;
  FrictionRule rule_ = FrictionRule::larger;
  std::vector<RuledShape> shapes_;  // [geoms]; empty: see empty()
  std::vector<GripShape> grips_;    // [geoms]; empty: nothing can be held
  std::vector<bool> loose_;         // [geoms]; empty: no object moves
};

// mj_step1 with the rules, island by island. With empty rules and one island the result is bit-identical to
// that of mj_step1 unless a robot holds something. begins_step: the state is one that a step begins with, and
// not one of a further stage.
void compute_contacts_and_constraints(const mjModel* model, mjData* data, const ContactRules& rules,
                                      const Bounces& bounces, IslandSolver& islands, bool begins_step = true);

}  // namespace doppel
