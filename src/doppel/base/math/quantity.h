#pragma once
// Numbers with a unit, as people write them into YAML files.

#include <optional>
#include <string>

#include "doppel/export.h"

namespace doppel {

// A number with an optional unit, in SI: "0.5 rad", "30 deg", "10 %", "0.2 kg", "50 mm". nullopt: no number,
// or a unit of another kind than `kind`.
enum class QuantityKind {
  position,
  angle,
  length,
  time,
  share,
  mass,
  speed,
  force,
  stiffness,
  voltage,
  current
};
DOPPEL_API std::optional<double> parse_quantity(const std::string& text, QuantityKind kind);
// "30 deg": what a value of this kind looks like.
DOPPEL_API const char* example_of(QuantityKind kind);

}  // namespace doppel
