// Fuzz target: an SRDF file. What is read is written, and reads as the same again.
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "doppel/description/srdf/srdf.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  try {
    doppel::Diagnostics diagnostics;
    const std::string_view text(reinterpret_cast<const char*>(data), size);
    const std::string first =
        doppel::write_srdf(doppel::read_srdf(doppel::parse_xml(text, "robot.srdf"), diagnostics));
    doppel::Diagnostics none;
    const std::string second =
        doppel::write_srdf(doppel::read_srdf(doppel::parse_xml(first, "written.srdf"), none));
    if (first != second || !none.all().empty()) std::abort();
  } catch (const doppel::InputError&) {
  }
  return 0;
}
