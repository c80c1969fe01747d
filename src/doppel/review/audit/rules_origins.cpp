// Joint origins compared with the links that they connect: millimetres written as metres.
#include <algorithm>

#include "doppel/review/audit/detail/description_facts.h"
#include "doppel/review/audit/detail/rules.h"

namespace doppel::audit_rules {
namespace {

constexpr double kFar = 2;                          // m: nearer, the hundredfold may be a gantry
constexpr double kCertain = 100, kSuspicious = 30;  // against the largest link

struct Links {
  double largest = 0;     // m, the diagonal of the largest
  bool all_known = true;  // no mesh is missing
};

Links measured(const RobotDescription& robot) {
  Links out;
  for (const Link& link : robot.links) {
    if (const auto shape = link_shape(link))
      out.largest = std::max(out.largest, shape->size());
    else if (!link.visuals.empty() || !link.collisions.empty())
      out.all_known = false;
  }
  return out;
}

}  // namespace

void check_origins(const AuditInput& in, Findings& out) {
  const Links links = measured(in.robot);
  if (!(links.largest > 0)) return;
  for (const Joint& joint : in.robot.joints) {
    const Eigen::Vector3d& xyz = joint.origin.xyz;
    const double far = xyz.norm();
    if (far < kFar || far < kSuspicious * links.largest) continue;
    const Link* parent = in.robot.find_link(joint.parent);
    // A link without a shape may be a place in the world, so that any distance from it is possible.
    const bool touches = parent != nullptr && !(parent->visuals.empty() && parent->collisions.empty());
    const bool certain = touches && links.all_known && far > kCertain * links.largest;
    const Eigen::Vector3d metres = xyz / 1e3;
    Finding& f = out.add(
        "joint.origin_units", certain ? Severity::error : Severity::warning, subject(joint),
        joint.origin.source,
        fmt::format("its origin {:g} {:g} {:g} is {:.3g} m away, and the largest link is "
                    "{:.3g} m long: {} in millimetres",
                    xyz.x(), xyz.y(), xyz.z(), far, links.largest, certain ? "it is" : "it seems to be"),
        fmt::format("write xyz=\"{:g} {:g} {:g}\"", metres.x(), metres.y(), metres.z()));
    if (!certain) continue;
    Operation repair;
    repair.action = SetOrigin{joint.name, metres, {}};
    repair.why = "the origin is in millimetres";
    f.repair = {repair};
  }
}

}  // namespace doppel::audit_rules
