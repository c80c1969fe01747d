// Fuzz target: the first two bytes select a type, the third the meaning of the rest: its CDR form, or the
// seed of a valid message and bytes that are then changed in it. What the struct's reader accepts must be the
// same after it is written again, and all readers must agree: the struct's, the one for the description, and
// that of a type created at run time from a node's description.

#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <memory>

#include "../test/messages_testing.h"
#include "../test/struct_codecs.h"
#include "doppel/ros/messages/described_type.h"

namespace {

using doppel::Bytes;
using doppel::TypeSupport;

struct Subject {
  const TypeSupport* compiled;
  std::shared_ptr<const TypeSupport> described;
  decltype(doppel::messages_testing::StructCodec::recode) recode_struct = nullptr;
};

std::vector<Subject> subjects() {
  std::vector<Subject> all;
  const auto codecs = doppel::messages_testing::struct_codecs();
  for (const TypeSupport* type : doppel::messages_testing::all_types()) {
    doppel::Status status;
    all.push_back({type, doppel::described_type(doppel::description_message(*type->description()), status)});
    if (!status || all.back().described->hash() != type->hash()) std::abort();
    for (const auto& codec : codecs) {
      if (codec.type->name == type->name) all.back().recode_struct = codec.recode;
    }
  }
  return all;
}

// Three bytes for each edit: the position (of the whole message) and the value.
Bytes edited(Bytes message, std::span<const std::byte> edits) {
  for (; edits.size() >= 3; edits = edits.subspan(3)) {
    const std::size_t at =
        std::to_integer<std::size_t>(edits[0]) << 8 | std::to_integer<std::size_t>(edits[1]);
    message[at % message.size()] = edits[2];
  }
  if (!edits.empty())
    message.resize(message.size() - std::to_integer<std::size_t>(edits[0]) % message.size());
  return message;
}

void check(const Subject& subject, std::span<const std::byte> bytes) {
  const TypeSupport &compiled = *subject.compiled, &described = *subject.described;
  Bytes once, twice, other;
  std::string yaml, json;
  const bool good = compiled.recode(bytes, once).ok();
  if (good != compiled.cdr_to_yaml(bytes, yaml).ok() || good != described.cdr_to_json(bytes, json).ok() ||
      good != described.recode(bytes, other).ok()) {
    std::abort();
  }
  if (Bytes read; subject.recode_struct != nullptr && subject.recode_struct(bytes, read).ok() != good)
    std::abort();
  if (!good) return;
  if (!compiled.recode(once, twice).ok() || once != twice) std::abort();
  if (!described.recode(other, twice).ok() || other != twice || once.size() != other.size()) std::abort();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const std::vector<Subject> all = subjects();
  constexpr std::size_t kHead = 3, kSeed = 4;
  if (size < kHead) return 0;
  const Subject& subject = all[(std::size_t{data[0]} << 8 | data[1]) % all.size()];
  const std::span<const std::byte> rest = std::as_bytes(std::span(data, size)).subspan(kHead);
  if (data[2] % 2 == 0) {
    check(subject, rest);
  } else if (rest.size() >= kSeed) {
    std::uint32_t seed = 0;
    std::memcpy(&seed, rest.data(), kSeed);
    std::mt19937 random(seed);
    check(subject, edited(doppel::messages_testing::random_message(*subject.compiled->description(), random),
                          rest.subspan(kSeed)));
  }
  return 0;
}
