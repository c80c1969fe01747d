#pragma once
// Reports once that the engine had no room for a contact.

#include "doppel/base/core/log.h"
#include "doppel/twin/loop/scene.h"
#include "doppel/twin/loop/tickable.h"

namespace doppel {

class ContactRoomMonitor : public Tickable {
 public:
  ContactRoomMonitor(const Scene& scene, const Log& log) : scene_(scene), log_(log) {}

  void between_steps(Time now) override;
  void reset(Time /*now*/) override { reported_ = false; }
  void save(SavedSlot& slot) override { save_run(reported_, slot); }
  void restore(const SavedPart* saved, Time /*now*/) override {
    if (saved != nullptr) restore_run(*saved, reported_);
  }

 private:
  const Scene& scene_;
  const Log& log_;
  bool reported_ = false;
};

}  // namespace doppel
