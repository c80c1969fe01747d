#pragma once
// The <state> of a saved world: where models and links are.

#include <map>
#include <string>

#include "doppel/scenario/sdf/detail/sdf_elements.h"

namespace doppel::sdf {

struct StatePoses {
  std::map<std::string, Pose> models;  // X_WM, by name; nested: "outer::inner"
  std::map<std::string, Pose> links;   // X_WL, by "model::link"
};

// Poses of <state> are in the world.
StatePoses read_state(const XmlNode* state, Elements& elements);

}  // namespace doppel::sdf
