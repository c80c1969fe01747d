#pragma once
// Lets nodes be put together beside those that are there and under the same names, so that what replaces them
// is complete before they are let go. While a stage is open its thread sees none of the nodes from before and
// others only those; edges and what they subscribe stay. Then either both are there, until the former ones
// are destroyed, or the former ones are as they were.
//
//   BusStage stage(bus);
//   auto next = std::make_unique<Robot>(bus);  // may throw: `robot` is on the bus again, as it was
//   stage.commit();
//   robot = std::move(next);

#include <memory>

#include "doppel/bus/bus.h"
#include "doppel/export.h"

namespace doppel {

class DOPPEL_API BusStage {
 public:
  // The loop's thread, between steps, one at a time. Throws std::bad_alloc; nothing has changed then.
  explicit BusStage(Bus& bus);
  // Without commit(): the nodes from before are back. Those since must be gone.
  ~BusStage();
  BusStage(const BusStage&) = delete;
  BusStage& operator=(const BusStage&) = delete;

  // Nodes from before and since are both there; of a service that both serve the newer one counts. Throws
  // std::bad_alloc; nothing has changed then.
  void commit();

 private:
  struct Saved;
  Bus& bus_;
  std::unique_ptr<Saved> saved_;
};

}  // namespace doppel
