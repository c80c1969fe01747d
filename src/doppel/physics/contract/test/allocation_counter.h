#pragma once
// Counts the heap allocations of the whole test program: operator new and malloc, so that C libraries are
// included.

#include <cstdint>

namespace doppel::test {

std::uint64_t heap_allocations();

}  // namespace doppel::test
