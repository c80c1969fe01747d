#pragma once
// Counts what the whole test program takes from the heap: operator new and malloc, so that C libraries count
// too.

#include <cstdint>

namespace doppel::test {

std::uint64_t heap_allocations();

}  // namespace doppel::test
