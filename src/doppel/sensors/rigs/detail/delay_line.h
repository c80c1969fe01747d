#pragma once
// Samples that wait for the end of their sensor's latency: a ring whose samples keep their memory.

#include <cmath>
#include <utility>
#include <vector>

#include "doppel/base/core/time.h"

namespace doppel {

template <class Sample>
class DelayLine {
 public:
  DelayLine() = default;
  // latency, period: s; 0 is no latency. `blank`: what the places for samples begin as.
  DelayLine(double latency, double period, const Sample& blank) : latency_(from_seconds(latency)) {
    if (latency_ > Duration{})
      waiting_.assign(static_cast<std::size_t>(std::ceil(latency / period)) + 3, {Time{}, blank});
  }

  [[nodiscard]] bool delays() const { return latency_ > Duration{}; }
  void clear() { first_ = count_ = 0; }
  // Takes over the samples that wait in the line of a former sensor with the same values.
  void resume(const DelayLine& before) {
    std::vector<Waiting> all;
    for (std::size_t i = 0; i < before.count_; ++i)
      all.push_back(before.waiting_[(before.first_ + i) % before.waiting_.size()]);
    first_ = 0;
    count_ = all.size();
    all.insert(all.end(), waiting_.begin(), waiting_.end());
    waiting_ = std::move(all);
  }

  // -- in the loop
  // The place for the sample of this instant; a former one is in it.
  Sample& add(Time now) {
    Waiting& next = waiting_[(first_ + count_++) % waiting_.size()];
    next.due = now + latency_;
    return next.sample;
  }
  // Calls `send` with each sample whose latency is over.
  template <class Send>
  void release(Time now, const Send& send) {
    for (; count_ > 0 && now >= waiting_[first_].due; --count_) {
      send(waiting_[first_].sample);
      first_ = (first_ + 1) % waiting_.size();
    }
  }
  [[nodiscard]] Time next_release() const { return count_ > 0 ? waiting_[first_].due : Time::max(); }

 private:
  struct Waiting {
    Time due{};
    Sample sample;
  };
  Duration latency_{};
  std::vector<Waiting> waiting_;  // a ring
  std::size_t first_ = 0, count_ = 0;
};

}  // namespace doppel
