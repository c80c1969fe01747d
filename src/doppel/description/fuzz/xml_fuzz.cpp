// Fuzz target: what parses is written, and what is written parses again, to the same text.
#include <cstdint>
#include <cstdlib>

#include "doppel/core/diagnostic.h"
#include "doppel/description/xacro.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  try {
    doppel::parse_xml(text, "fuzz.xml");
    const std::string written = doppel::xacro_text(doppel::parse_xml_document(text, "fuzz.xml"), "");
    if (written.find("<![CDATA[") != std::string::npos) return 0;
    const std::string once = doppel::to_xml(doppel::parse_xml(written, "written.xml"));
    if (doppel::to_xml(doppel::parse_xml(once, "once.xml")) != once) std::abort();
  } catch (const doppel::InputError& error) {
    if (error.diagnostics().front().where.file && *error.diagnostics().front().where.file != "fuzz.xml")
      std::abort();
  }
  return 0;
}
