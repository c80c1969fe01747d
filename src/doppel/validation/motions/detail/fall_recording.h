#pragma once
// A recording of an engine without a twin: the topics of a robot_state_publisher, and the states of the
// joints.

#include <memory>

#include "doppel/lab/recording/motion_recording.h"
#include "doppel/physics/contract/engine.h"

namespace doppel {

class FallRecording {
 public:
  // From the present state of the engine's first instance on. The engine outlives it.
  explicit FallRecording(Engine& engine);
  ~FallRecording();
  FallRecording(const FallRecording&) = delete;
  FallRecording& operator=(const FallRecording&) = delete;

  // After each step.
  void take();
  [[nodiscard]] RecordedMotion finish();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace doppel
