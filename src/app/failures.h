#pragma once
// The end of a program where its work throws: one message, and the exit code.

#include <exception>

#include "app/print_stderr.h"
#include "doppel/core/diagnostic.h"

namespace doppel::app {

inline constexpr int kBadInput = 2;

// The exit code that `work` returns; kBadInput for an InputError, 1 for anything else that it throws.
template <class Work>
int with_failures_reported(const Work& work) {
  try {
    return work();
  } catch (const InputError& error) {
    print_stderr("{}\n", error.what());
    return kBadInput;
  } catch (const std::exception& error) {
    print_stderr("error: {}\n", error.what());
    return 1;
  }
}

}  // namespace doppel::app
