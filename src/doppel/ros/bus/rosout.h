#pragma once
// The program's log on /rosout, each line under the name of the node that it concerns.

#include <memory>

#include "doppel/base/core/log.h"
#include "doppel/export.h"
#include "doppel/ros/bus/bus.h"
#include "doppel/ros/messages/rcl_interfaces.h"

namespace doppel {

// The place of a log call in the C++ sources, as rclcpp's macros fill it in.
DOPPEL_API void fill_place(rcl_interfaces::msg::Log& line, const CodeLocation& where);

// The loop's thread. Its node is /doppel, under whose name lines that concern no node are published, too.
class DOPPEL_API Rosout {
 public:
  explicit Rosout(Bus& bus);
  ~Rosout();
  Rosout(const Rosout&) = delete;
  Rosout& operator=(const Rosout&) = delete;

  // For Log::add_sink(). Lines of any thread are published between steps, and dropped once this
  // object is destroyed.
  [[nodiscard]] Log::Sink sink() const;

 private:
  struct Impl;
  struct Endpoint;
  std::shared_ptr<Impl> impl_;
  std::shared_ptr<Endpoint> endpoint_;
};

}  // namespace doppel
