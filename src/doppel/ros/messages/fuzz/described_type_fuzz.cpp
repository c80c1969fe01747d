// Fuzz target: the bytes are the CDR form of a type's description, as another node would send it, followed
// (at an offset in two bytes) by a message of that type. An accepted description must be written back
// identically, and reading, printing and writing its messages must be safe.

#include <cstdint>
#include <cstdlib>

#include "../test/messages_testing.h"
#include "doppel/ros/messages/described_type.h"
#include "doppel/ros/messages/type_hash.h"

namespace {

using doppel::Bytes;

void check(const doppel::TypeSupport& type, std::span<const std::byte> bytes) {
  doppel::Status status;
  const auto again = doppel::described_type(doppel::description_message(*type.description()), status);
  if (!status || again->hash() != type.hash() || again->schema() != type.schema()) std::abort();
  Bytes once, twice;
  std::string yaml, json;
  const bool good = type.recode(bytes, once).ok();
  if (good != type.cdr_to_yaml(bytes, yaml).ok() || good != type.cdr_to_json(bytes, json).ok()) std::abort();
  if (good && (!type.recode(once, twice).ok() || once != twice)) std::abort();
  constexpr std::size_t kSmall = 100'000;
  if (type.description()->least_cdr_size < kSmall &&
      (!type.yaml_to_cdr("{}", once) || !type.recode(once, twice)))
    std::abort();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size < 2) return 0;
  const std::span<const std::byte> rest = std::as_bytes(std::span(data, size)).subspan(2);
  const std::size_t cut = (std::size_t{data[0]} << 8 | data[1]) % (rest.size() + 1);
  doppel::TypeDescriptionMessage message;
  if (!doppel::from_cdr(rest.first(cut), message)) return 0;
  doppel::Status status;
  const auto type = doppel::described_type(message, status);
  if ((type != nullptr) != status.ok()) std::abort();
  if (type != nullptr) check(*type, rest.subspan(cut));
  return 0;
}
