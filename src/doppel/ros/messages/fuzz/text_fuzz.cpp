// Fuzz target: a message as YAML or JSON, as clients of the server send it; the first two bytes select the
// type. What is accepted is a valid message.
#include <cstdint>
#include <cstdlib>

#include "../test/messages_testing.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size < 2) return 0;
  static const auto types = doppel::messages_testing::all_types();
  const doppel::TypeSupport& type = *types[(std::size_t{data[0]} << 8 | data[1]) % types.size()];
  doppel::Bytes message, again;
  if (!type.yaml_to_cdr({reinterpret_cast<const char*>(data) + 2, size - 2}, message)) return 0;
  if (!type.recode(message, again) || message != again) std::abort();
  return 0;
}
