// Fuzz target: the first byte chooses a type, the rest is its CDR form. What the struct's reader accepts must
// survive being written again, and both readers must agree.

#include <cstdint>
#include <cstdlib>

#include "../test/messages_testing.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const auto types = doppel::messages_testing::all_types();
  if (size == 0) return 0;
  const doppel::TypeSupport& type = *types[data[0] % types.size()];
  const std::span<const std::byte> bytes(reinterpret_cast<const std::byte*>(data + 1), size - 1);
  doppel::Bytes once, twice;
  std::string yaml, json;
  const bool good = type.recode(bytes, once).ok();
  if (good != type.cdr_to_yaml(bytes, yaml).ok() || good != type.cdr_to_json(bytes, json).ok()) std::abort();
  if (good && (!type.recode(once, twice).ok() || once != twice)) std::abort();
  return 0;
}
