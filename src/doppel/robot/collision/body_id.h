#pragma once

#include <compare>

#include "doppel/export.h"

namespace doppel {

// A body of a world or of a collision scene: a link of an instance. The ground is instance -1, link 0.
struct DOPPEL_API BodyId {
  int instance = -1, link = 0;
  [[nodiscard]] bool is_ground() const { return instance < 0; }
  auto operator<=>(const BodyId&) const = default;
};

}  // namespace doppel
