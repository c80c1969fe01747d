// Fuzz target: a message as YAML or JSON, as clients of the server send it; the first two bytes select the
// type. What is accepted is a valid message, and the same one by both readers.
#include <cstdint>
#include <cstdlib>

#include "../test/messages_testing.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size < 2) return 0;
  static const auto types = doppel::messages_testing::all_types();
  const doppel::TypeSupport& type = *types[(std::size_t{data[0]} << 8 | data[1]) % types.size()];
  const std::string_view text(reinterpret_cast<const char*>(data) + 2, size - 2);
  doppel::Bytes by_yaml, by_json, again;
  const bool is_yaml{type.yaml_to_cdr(text, by_yaml)}, is_json{type.json_to_cdr(text, by_json)};
  if (is_yaml && (!type.recode(by_yaml, again) || by_yaml != again)) std::abort();
  if (is_json && (!type.recode(by_json, again) || by_json != again)) std::abort();
  // The escapes of a character are others in YAML.
  if (is_yaml && is_json && text.find('\\') == std::string_view::npos && by_yaml != by_json) std::abort();
  return 0;
}
