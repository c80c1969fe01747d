#pragma once
// For tests of loops that must not use the heap: linked in (doppel_heap_touches), it counts every operator
// new and delete of the program.

#include <cstddef>

namespace doppel::test {

// The heap operations of this thread while the counter was on.
class HeapTouches {
 public:
  void run();
  void pause();
  [[nodiscard]] std::size_t count() const { return count_; }

 private:
  std::size_t count_ = 0;
};

// Those of one function call.
template <class Work>
std::size_t heap_touches_of(const Work& work) {
  HeapTouches touches;
  touches.run();
  work();
  touches.pause();
  return touches.count();
}

}  // namespace doppel::test
