#pragma once
// Allows new nodes with the names of existing ones, so that a replacement is complete before the former nodes
// are destroyed. While a stage is open, the graph has only the new nodes for its thread and only the former
// ones for all other threads; edges and their subscriptions stay. Afterwards either both exist, until the
// former ones are destroyed, or the former ones are unchanged.
//
//   BusStage stage(bus);
//   auto next = std::make_unique<Robot>(bus);  // may throw: `robot` is then unchanged on the bus
//   stage.commit();
//   robot = std::move(next);

#include <memory>

#include "doppel/export.h"
#include "doppel/ros/bus/bus.h"

namespace doppel {

class DOPPEL_API BusStage {
 public:
  // The loop's thread, between steps, one stage at a time. Throws std::bad_alloc; nothing has changed then.
  explicit BusStage(Bus& bus);
  // Without commit() the former nodes are restored. Precondition: the new ones are destroyed.
  ~BusStage();
  BusStage(const BusStage&) = delete;
  BusStage& operator=(const BusStage&) = delete;

  // Former and new nodes both exist; a service of both is served by the new one. Throws std::bad_alloc;
  // nothing has changed then.
  void commit();

 private:
  struct Saved;
  Bus& bus_;
  std::unique_ptr<Saved> saved_;
};

}  // namespace doppel
