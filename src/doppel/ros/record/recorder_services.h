#pragma once
// The services of rosbag2's recorder, as node /rosbag2_recorder: pause, resume, toggle_paused, is_paused,
// split_bagfile, stop and, where it is offered, snapshot.

#include <functional>
#include <string>

#include "doppel/export.h"
#include "doppel/ros/bus/bus.h"

namespace doppel {

inline constexpr const char* kRecorderNode = "/rosbag2_recorder";

enum class RecorderAction { pause, resume, toggle_paused, split, snapshot, stop };

struct RecorderControl {
  // Any time later, `done` is called once with whether it was done. Both on the bus's thread.
  std::function<void(RecorderAction, std::function<void(bool)> done)> act;
  std::function<bool()> is_paused;
  bool has_snapshot = false;
};

// The bus's thread only. The bus outlives it.
class DOPPEL_API RecorderServices {
 public:
  RecorderServices(Bus& bus, RecorderControl control, const std::string& node = kRecorderNode);

 private:
  template <Service S>
  void serve(const char* name, RecorderAction action);

  RecorderControl control_;
  Node node_;
};

}  // namespace doppel
