#pragma once
// Private to the MuJoCo back end: the friction of each contact where MuJoCo's own rule, the larger coefficient
// of the two in every direction, is not that of the world (detail/contact_rule.h). The rules are applied
// between the detection of contacts and the constraints that are made of them.

#include <mujoco/mujoco.h>

#include <vector>

#include "doppel/physics/detail/contact_rule.h"
#include "doppel/physics/mujoco/islands.h"

namespace doppel {

// A shape of MuJoCo's model.
struct RuledShape {
  Friction friction;
  int direction_body = 0;  // MuJoCo's body in whose axes the direction is
  bool ruled = false;      // of an instance that has wheels, or a friction that MuJoCo's own rule cannot give
};

class ContactRules {
 public:
  ContactRules() = default;
  ContactRules(FrictionRule rule, std::vector<RuledShape> shapes);  // shapes: of each geom

  // No shape needs a rule: every contact is as MuJoCo found it.
  [[nodiscard]] bool empty() const { return shapes_.empty(); }
  // These act on the contacts of ruled shapes, or on all with another rule than MuJoCo's, so that a robot
  // without wheels moves as it does in a world without robots that have some. They do not allocate.
  // Writes the friction and the tangents.
  void apply(mjData& data) const;
  // MuJoCo's friction is a convex optimisation, whose contacts open with the speed mu v while they slide with
  // the speed v, and so hop. Subtracting it from the reference of the normal gives Coulomb's law (de Saxce
  // and Feng, International Journal of Engineering Science 29, 1991).
  void keep_sliding_contacts(mjData& data) const;
  // MuJoCo's friction is a stiff damper, so that a load creeps. On a slope of 80 % of the friction a parked base
  // creeps by 0.25 mm a minute; a hundred times stiffer, by 0.003 mm.
  void stiffen_friction(mjData& data) const;

 private:
  [[nodiscard]] bool ruled(const mjContact& contact) const;
  void apply(const mjData& data, mjContact& contact) const;
  FrictionRule rule_ = FrictionRule::larger;
  std::vector<RuledShape> shapes_;  // [geoms]; empty: see empty()
};

// mj_step1 with the rules, island by island. With empty rules and one island the result is bit-identical to
// that of mj_step1.
void compute_contacts_and_constraints(const mjModel* model, mjData* data, const ContactRules& rules,
                                      IslandSolver& islands);

}  // namespace doppel
