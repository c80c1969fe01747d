#include "doppel/description/urdf/contact_surface.h"

namespace doppel {
namespace {

void take(const std::optional<double>& from, std::optional<double>& to) {
  if (from) to = from;
}

void read_direction(const XmlNode& node, const ElementNumbers& numbers, ContactSurface& out) {
  const XmlNode* const written = node.first("fdir1");
  if (written == nullptr) return;
  const auto direction = numbers.vector(node, "fdir1");
  if (!direction || !(direction->norm() > 0)) return;  // three zeros mean no direction
  out.fdir1 = *direction;
  for (const char* attribute : {"gz:expressed_in", "ignition:expressed_in"}) {
    if (const XmlAttribute* const frame = written->find(attribute)) out.fdir1_frame = frame->value;
  }
}

}  // namespace

void read_friction(const XmlNode& friction, const ElementNumbers& numbers, ContactSurface& out) {
  if (const XmlNode* const bullet = friction.first("bullet")) {
    take(numbers.number(*bullet, "friction"), out.mu);
    take(numbers.number(*bullet, "friction2"), out.mu2);
    read_direction(*bullet, numbers, out);
  }
  if (const XmlNode* const ode = friction.first("ode")) {
    take(numbers.number(*ode, "mu"), out.mu);
    take(numbers.number(*ode, "mu2"), out.mu2);
    take(numbers.number(*ode, "slip1"), out.slip1);
    take(numbers.number(*ode, "slip2"), out.slip2);
    read_direction(*ode, numbers, out);
  }
  if (const XmlNode* const torsional = friction.first("torsional")) {
    take(numbers.number(*torsional, "coefficient"), out.torsional_mu);
    take(numbers.number(*torsional, "patch_radius"), out.patch_radius);
  }
}

}  // namespace doppel
