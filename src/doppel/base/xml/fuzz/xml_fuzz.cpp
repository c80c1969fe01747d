// Fuzz target: the lenient rules terminate; what parses by the strict rules is written, and what is written
// parses again to the same elements.
#include <cstdint>
#include <cstdlib>

#include "doppel/base/core/diagnostic.h"
#include "doppel/description/xacro/xacro.h"

namespace {

// The elements and attributes, without the texts, because the layout changes their white space.
std::string elements(const doppel::XmlNode& node) {
  std::string out = "<" + node.name;
  for (const doppel::XmlAttribute& a : node.attributes) out += " " + a.name + "=" + a.value;
  for (const doppel::XmlNode& child : node.children) {
    if (child.kind == doppel::XmlNode::Kind::element) out += elements(child);
  }
  return out + ">";
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  try {
    doppel::parse_xml_tree(std::string(text), "fuzz.xml", doppel::XmlContent::content,
                           doppel::XmlRules::lenient);
  } catch (const doppel::InputError&) {
    // Rejected by the strict rules as well, or for its size.
  }
  try {
    doppel::parse_xml(text, "fuzz.xml");
    const std::string written = doppel::xacro_text(doppel::parse_xml_tree(std::string(text), "fuzz.xml"), "");
    if (written.find("<![CDATA[") != std::string::npos) return 0;
    const doppel::XmlNode once = doppel::parse_xml(written, "written.xml");
    const doppel::XmlNode twice = doppel::parse_xml(doppel::to_xml(once), "once.xml");
    if (elements(once) != elements(twice)) std::abort();
  } catch (const doppel::InputError& error) {
    if (error.diagnostics().front().where.file && *error.diagnostics().front().where.file != "fuzz.xml")
      std::abort();
  }
  return 0;
}
