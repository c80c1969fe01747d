#pragma once
// Faults that a test injects into the code it runs: the nth large allocation, opening of a file or call of
// the engine "faulty" on this thread fails once. The program that links faults.cpp has them.

#include <cstdint>

namespace doppel::test {

enum class Fault { allocation, file, engine };
inline constexpr const char* kFaultNames[] = {"allocation", "file", "engine"};

// From now on, on this thread. n counts from 1; 0: none fails, they are counted only.
void arm(Fault fault, std::uint64_t n);
// Back to none. How many there were since arm().
std::uint64_t disarm();

// One more of this kind; true: this is the one that fails. Does not allocate.
bool strikes(Fault fault);

// Registers the engine "faulty": MuJoCo, whose calls may be struck.
void register_faulty_engine();
// Of worlds for "faulty", by this thread so far.
std::uint64_t compilations_here();

}  // namespace doppel::test
