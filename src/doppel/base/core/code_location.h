#pragma once
// A place in the C++ sources, as std::source_location has it, which clang 14 lacks.

namespace doppel {

struct CodeLocation {
  const char* file = "";
  const char* function = "";  // its bare name, as __func__
  int line = 0;               // 1-based; 0: unknown

  // The place of the call, if it is a default argument.
  static constexpr CodeLocation current(const char* file = __builtin_FILE(),
                                        const char* function = __builtin_FUNCTION(),
                                        int line = __builtin_LINE()) {
    return {file, function, line};
  }
};

}  // namespace doppel
