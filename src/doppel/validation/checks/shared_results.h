#pragma once
// Results that several checks of one validation need, each computed by the first that asks and awaited by the
// others.

#include <map>
#include <memory>
#include <mutex>
#include <string>

#include "doppel/export.h"

namespace doppel {

class DOPPEL_API SharedResults {
 public:
  // The result of this name, made by `make` unless it is there. What `make` throws leaves it unmade. Any
  // thread; a name has one type.
  template <class T, class Make>
  std::shared_ptr<const T> get(const std::string& name, const Make& make) {
    const std::shared_ptr<Entry> entry = entry_of(name);
    const std::lock_guard lock(entry->mutex);
    if (entry->value == nullptr) entry->value = std::make_shared<const T>(make());
    return std::static_pointer_cast<const T>(entry->value);
  }

 private:
  struct Entry {
    std::mutex mutex;
    std::shared_ptr<const void> value;
  };
  std::shared_ptr<Entry> entry_of(const std::string& name) {
    const std::lock_guard lock(mutex_);
    std::shared_ptr<Entry>& out = entries_[name];
    if (out == nullptr) out = std::make_shared<Entry>();
    return out;
  }

  std::mutex mutex_;
  std::map<std::string, std::shared_ptr<Entry>> entries_;
};

}  // namespace doppel
