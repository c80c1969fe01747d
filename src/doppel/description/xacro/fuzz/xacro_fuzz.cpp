// Fuzz target: expands any content of a robot; with arguments, and without any package.
#include <cstdint>

#include "doppel/description/xacro/xacro.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string text = "<r>" + std::string(reinterpret_cast<const char*>(data), size) + "</r>";
  for (const doppel::XmlContent keep : {doppel::XmlContent::content, doppel::XmlContent::everything}) {
    doppel::PackageResolver resolver;
    doppel::Diagnostics diagnostics;
    try {
      const doppel::XacroResult result =
          doppel::expand_xacro(doppel::parse_xml_tree(text, "/nowhere/fuzz.xacro", keep),
                               "/nowhere/fuzz.xacro", {{"a", "1"}, {"b", "x"}}, resolver, diagnostics);
      doppel::xacro_text(result.tree, "fuzz.xacro");
      static_cast<void>(result.tree.node());
    } catch (const doppel::InputError&) {
      continue;
    }
  }
  return 0;
}
