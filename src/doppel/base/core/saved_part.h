#pragma once
// A part of a running simulation writes it when the simulation is saved, and reads it when it is restored: a
// value whose type only the part has.

#include <memory>
#include <utility>

#include "doppel/export.h"

namespace doppel {

class DOPPEL_API SavedPart {
 public:
  SavedPart() = default;
  virtual ~SavedPart() = default;
  SavedPart(const SavedPart&) = delete;
  SavedPart& operator=(const SavedPart&) = delete;
};

// The place of a saved value. One that is written again keeps the memory of its vectors and strings, so
// that states that are saved periodically hardly allocate. nullptr: the part has nothing to save.
using SavedSlot = std::unique_ptr<SavedPart>;

template <class T>
class SavedValue final : public SavedPart {
 public:
  T value = T();
};

// The value in a slot, made if the slot has none of this type; what was saved there last is in it.
template <class T>
T& value_in(SavedSlot& slot) {
  auto* present = dynamic_cast<SavedValue<T>*>(slot.get());
  if (present == nullptr) {
    auto fresh = std::make_unique<SavedValue<T>>();
    present = fresh.get();
    slot = std::move(fresh);
  }
  return present->value;
}

// nullptr: there is none of this type.
template <class T>
const T* value_of(const SavedPart* saved) {
  const auto* present = dynamic_cast<const SavedValue<T>*>(saved);
  return present == nullptr ? nullptr : &present->value;
}

// For a part that keeps what changes while it runs in one struct, which can be copied.
template <class Run>
bool save_run(const Run& run, SavedSlot& slot) {
  value_in<Run>(slot) = run;
  return true;
}
template <class Run>
void restore_run(const SavedPart& saved, Run& run) {
  if (const Run* before = value_of<Run>(&saved)) run = *before;
}

}  // namespace doppel
