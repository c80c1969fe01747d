#pragma once
// For tests of loops that must leave the heap alone: linked in (doppel_heap_touches), every operator new and
// delete of the program is counted.

#include <cstddef>

namespace doppel::test {

// What this thread asked of the heap while the counter ran.
class HeapTouches {
 public:
  void run();
  void pause();
  [[nodiscard]] std::size_t count() const { return count_; }

 private:
  std::size_t count_ = 0;
};

// Those of one piece of work.
template <class Work>
std::size_t heap_touches_of(const Work& work) {
  HeapTouches touches;
  touches.run();
  work();
  touches.pause();
  return touches.count();
}

}  // namespace doppel::test
