#pragma once
// Periodic tasks of a twin besides engine and controllers: publishers, checks, services, sensors. Each
// registers in a list, of the world or of one robot, which the twin runs. All functions: the loop's thread.

#include <algorithm>
#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "doppel/base/core/saved_part.h"
#include "doppel/base/core/time.h"
#include "doppel/export.h"

namespace doppel {

// A period rounded to whole steps, at least one.
inline Duration whole_steps(Duration period, Duration step) {
  return step * std::max<std::int64_t>(1, (period.count() + step.count() / 2) / step.count());
}

// The next due time of a topic that is published at a rate, without drift.
class DOPPEL_API Pace {
 public:
  void restart(Time now) { next_ = now; }
  Time next(Time now, Duration period) {
    next_ = next_ + period > now ? std::min(next_ + period, now + period) : now + period;
    return next_;
  }

 private:
  Time next_{};
};

class DOPPEL_API Tickable {
 public:
  Tickable() = default;
  virtual ~Tickable() = default;
  Tickable(const Tickable&) = delete;
  Tickable& operator=(const Tickable&) = delete;

  // -- in the loop: no allocation, no lock, no throw
  // True if before_step() and after_step() are called.
  [[nodiscard]] virtual bool at_every_step() const { return false; }
  virtual void before_step(Time /*now*/) {}
  virtual void after_step(Time /*now*/) {}
  // Publishes in the loop at a rate: called when it is due; returns the next due time.
  virtual Time publish(Time /*now*/) { return Time::max(); }
  // The latest time of the next publish(), seen from now. Evaluated after every housekeeping, so that a
  // higher rate takes effect at once.
  [[nodiscard]] virtual Time next_after(Time /*now*/) const { return Time::max(); }

  // -- between steps
  virtual void between_steps(Time /*now*/) {}
  // The state was written, or time was stepped or set back: publishes the present state.
  virtual void show(Time /*now*/) {}
  // The simulation was reset.
  virtual void reset(Time /*now*/) {}
  // Instances were added or removed, or the engine was replaced: looks up handles again.
  virtual void instances_changed() {}
  // Another robot was added or removed.
  virtual void robots_changed(Time /*now*/) {}

  // -- saved states of the twin, between steps
  // Writes what changes while it runs into the slot, whose memory it reuses (saved_part.h).
  virtual void save(SavedSlot& /*slot*/) {}
  // Becomes as it was then; may be called twice. nullptr: it had nothing to save. Engine and handles are
  // those of the restored state, whose time is `now`.
  virtual void restore(const SavedPart* /*saved*/, Time /*now*/) {}

  // -- if the physics has diverged
  // What acts from outside: "1e+06 N m act on joint 'elbow'". Empty: nothing.
  [[nodiscard]] virtual std::string acting_loads() const { return ""; }
  // True: this part has brought the engine back to a finite state, and has reported it with the cause.
  virtual bool recover(const std::string& /*cause*/) { return false; }
};

// The state of a TickList: of each entry, in its order.
struct SavedTicks {
  struct One {
    Time next{};
    SavedSlot part;
  };
  std::vector<One> all;
  Time next{};
};

class DOPPEL_API TickList {
 public:
  void add(std::unique_ptr<Tickable> what) {
    if (what->at_every_step()) each_step_.push_back(what.get());
    all_.push_back({std::move(what), Time::min()});
    next_ = Time::min();
  }

  void before_step(Time now) {
    for (Tickable* what : each_step_) what->before_step(now);
  }
  void after_step(Time now) {
    for (Tickable* what : each_step_) what->after_step(now);
  }
  [[nodiscard]] bool is_due(Time now) const { return now >= next_; }
  void publish_due(Time now) {
    next_ = Time::max();
    for (Entry& entry : all_) {
      if (now >= entry.next) entry.next = entry.what->publish(now);
      next_ = std::min(next_, entry.next);
    }
  }
  // Called when a rate may have become higher.
  void advance_due_times(Time now) {
    for (Entry& entry : all_) {
      entry.next = std::min(entry.next, entry.what->next_after(now));
      next_ = std::min(next_, entry.next);
    }
  }
  void between_steps(Time now) {
    for (Entry& entry : all_) entry.what->between_steps(now);
  }
  void show(Time now) {
    for (Entry& entry : all_) entry.what->show(now);
  }
  // Time may have been set back, so everything is due.
  void reset(Time now) {
    for (Entry& entry : all_) {
      entry.what->reset(now);
      entry.next = Time::min();
    }
    next_ = Time::min();
  }
  void save(SavedTicks& out) {
    out.all.resize(all_.size());
    for (std::size_t i = 0; i < all_.size(); ++i) {
      out.all[i].next = all_[i].next;
      all_[i].what->save(out.all[i].part);
    }
    out.next = next_;
  }
  void restore(const SavedTicks& saved, Time now) {
    if (saved.all.size() != all_.size()) return reset(now);
    for (std::size_t i = 0; i < all_.size(); ++i) {
      all_[i].next = saved.all[i].next;
      all_[i].what->restore(saved.all[i].part.get(), now);
    }
    next_ = saved.next;
  }
  void instances_changed() {
    for (Entry& entry : all_) entry.what->instances_changed();
  }
  void robots_changed(Time now) {
    for (Entry& entry : all_) entry.what->robots_changed(now);
  }
  [[nodiscard]] std::string acting_loads() const {
    std::string out;
    for (const Entry& entry : all_) {
      const std::string loads = entry.what->acting_loads();
      if (!loads.empty()) out += (out.empty() ? "" : "; ") + loads;
    }
    return out;
  }
  bool recover(const std::string& cause) {
    return std::ranges::any_of(all_, [&](Entry& entry) { return entry.what->recover(cause); });
  }

 private:
  struct Entry {
    std::unique_ptr<Tickable> what;
    Time next;  // of publish()
  };
  std::vector<Entry> all_;
  std::vector<Tickable*> each_step_;
  Time next_ = Time::max();
};

}  // namespace doppel
