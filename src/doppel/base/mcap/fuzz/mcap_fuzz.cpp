// Fuzz target: an MCAP file, by its index and by a scan. Messages are within the bytes that were read.
#include <cstdint>

#include "doppel/base/core/diagnostic.h"
#include "doppel/base/mcap/mcap_reader.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto* const bytes = reinterpret_cast<const std::byte*>(data);
  unsigned sum = 0;
  try {
    doppel::McapReader reader(doppel::mcap_source({bytes, bytes + size}));
    while (const auto message = reader.next()) {
      for (const std::byte one : message->data) sum += static_cast<unsigned>(one);
    }
    for (const doppel::McapNamedPart& part : reader.contents().attachments) (void)reader.part(part);
    for (const doppel::McapNamedPart& part : reader.contents().metadata) (void)reader.part(part);
  } catch (const doppel::InputError&) {
  } catch (const std::runtime_error&) {  // no module of compression
  }
  return sum == 0xFFFFFFFF ? 1 : 0;
}
