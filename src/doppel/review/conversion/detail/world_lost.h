#pragma once
// The content that the document of a world cannot express: warnings "world.lost", the same for all formats.

#include <string>

#include "doppel/base/core/diagnostic.h"
#include "doppel/scenario/sdf/sdf_world.h"

namespace doppel {

class WorldLosses {
 public:
  // format: "MJCF".
  WorldLosses(std::string format, Diagnostics& diagnostics)
      : format_(std::move(format)), diagnostics_(diagnostics) {}

  // what: "the light 'sun'".
  void lose(const SourceLocation& where, const std::string& what, const std::string& fix = "");
  void lose_sensor(const SdfModel& model, const SdfSensor& sensor);
  // Of SDF, and of the <gazebo> elements of an included URDF.
  void lose_sensors_and_plugins(const SdfModel& model);
  void lose_plugins(const SdfWorld& world);
  void lose_lights(const SdfWorld& world);
  void lose_environment(const SdfWorld& world);

 private:
  std::string format_;
  Diagnostics& diagnostics_;
};

}  // namespace doppel
