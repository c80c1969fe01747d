#pragma once
// SDF text in memory for the tests of the reader.

#include <gtest/gtest.h>

#include <algorithm>
#include <string>

#include "doppel/scenario/sdf/sdf_world.h"

namespace doppel {

struct ReadSdf {
  SdfWorld world;
  Diagnostics notes;

  [[nodiscard]] const SdfModel& model(const std::string& name) const {
    const SdfModel* const found = world.find(name);
    if (found == nullptr) throw std::runtime_error("no model " + name);
    return *found;
  }
  [[nodiscard]] int count(const std::string& rule) const {
    return static_cast<int>(std::ranges::count(notes.all(), rule, &Diagnostic::rule));
  }
  [[nodiscard]] std::string message(const std::string& rule) const {
    for (const Diagnostic& diagnostic : notes.all()) {
      if (diagnostic.rule == rule) return diagnostic.str();
    }
    return "";
  }
};

inline ReadSdf read_sdf(const std::string& text, const std::filesystem::path& folder = {}) {
  ReadSdf out;
  PackageResolver resolver;
  out.world = parse_sdf(text, "test.sdf", folder, resolver, out.notes);
  return out;
}

inline ReadSdf read_world(const std::string& content, const std::string& version = "1.9") {
  return read_sdf("<sdf version='" + version + "'><world name='w'>\n" + content + "</world></sdf>");
}

// The errors of a text that is refused.
inline std::vector<Diagnostic> errors_of(const std::string& text) {
  try {
    read_sdf(text);
  } catch (const InputError& refused) {
    return refused.diagnostics();
  }
  return {};
}

// The pose of a link in the world, all joints at zero, by the description's own tree.
inline Pose link_pose(const SdfModel& model, const std::string& link) {
  for (const Joint& joint : model.description->joints) {
    if (joint.child == link) return link_pose(model, joint.parent) * joint.origin.pose();
  }
  return model.X_WR;
}

inline constexpr const char* kBall =
    "<link name='link'><inertial><mass>2</mass><inertia><ixx>0.1</ixx><iyy>0.2</iyy><izz>0.25</izz></inertia>"
    "</inertial><collision "
    "name='c'><geometry><sphere><radius>0.5</radius></sphere></geometry></collision></link>";

inline std::string model(const std::string& name, const std::string& content) {
  return "<model name='" + name + "'>" + content + "</model>\n";
}

// Links without joints.
inline std::string links(int count) {
  std::string out;
  for (int i = 0; i < count; ++i) {
    out += "<link name='l" + std::to_string(i) + "'><pose>" + std::to_string(i) +
           " 0 0 0 0 0</pose><inertial><mass>1</mass></inertial></link>";
  }
  return out;
}

}  // namespace doppel
