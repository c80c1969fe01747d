// Any bytes as a picture: read, or refused.
#include <cstddef>
#include <cstdint>

#include "doppel/base/core/diagnostic.h"
#include "doppel/base/images/image.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  try {
    (void)doppel::decode_image({reinterpret_cast<const char*>(data), size}, "input");
  } catch (const doppel::InputError&) {
    // Refused by its message.
  }
  return 0;
}
