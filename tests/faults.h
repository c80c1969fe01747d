#pragma once
// Faults that a test injects into the code it runs: the nth large allocation, opening of a file or call of
// the engine "faulty" on this thread fails once. Programs get them by linking faults.cpp.

#include <cstdint>

namespace doppel::test {

enum class Fault { allocation, file, engine };
inline constexpr const char* kFaultNames[] = {"allocation", "file", "engine"};

// Effective on this thread from now on. n counts from 1; 0: none fails, they are only counted.
void arm(Fault fault, std::uint64_t n);
// No fault from now on. Returns the number of possible faults since arm().
std::uint64_t disarm();

// Counts one more of this kind; true: this is the one that fails. Does not allocate.
bool strikes(Fault fault);

// Registers the engine "faulty": MuJoCo, whose calls may fail.
void register_faulty_engine();
// The compilations of worlds for "faulty" on this thread so far.
std::uint64_t compilations_here();
// While true, no compilation of a world for "faulty" on another thread than the caller's ends.
void hang_compilations(bool hang);

}  // namespace doppel::test
