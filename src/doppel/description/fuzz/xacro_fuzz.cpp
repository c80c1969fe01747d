// Fuzz target: expands whatever is inside of a robot; with arguments, and without any package.
#include <cstdint>

#include "doppel/description/xacro.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string text = "<r>" + std::string(reinterpret_cast<const char*>(data), size) + "</r>";
  for (const doppel::XmlKeep keep : {doppel::XmlKeep::content, doppel::XmlKeep::everything}) {
    doppel::PackageResolver resolver;
    doppel::Diagnostics diagnostics;
    try {
      doppel::XmlDocument document = doppel::parse_xml_document(text, "/nowhere/fuzz.xacro", keep);
      document.root = doppel::expand_xacro(std::move(document.root), "/nowhere/fuzz.xacro",
                                           {{"a", "1"}, {"b", "x"}}, resolver, diagnostics, keep)
                          .root;
      doppel::xacro_text(document, "fuzz.xacro");
    } catch (const doppel::InputError&) {
      continue;
    }
  }
  return 0;
}
