// Bytes that are not a document: an error with its location, within a short time, whatever they are.
#include <gtest/gtest.h>

#include "doppel/base/xml/test/xml_refusal.h"
#include "doppel/base/xml/xml.h"

namespace doppel {
namespace {

TEST(XmlLimits, ContentBeforeRootIsRefused) {
  for (const char* text :
       {"</robot>", " </>", "<![CDATA[x]]><a/>", "<!ELEMENT a (b)><a/>", "<!-- c --></a>"}) {
    EXPECT_NE(refusal_of(text).find("f.xml:1:"), std::string::npos) << text;
  }
}

TEST(XmlLimits, DeepNestingIsRefused) {
  std::string text;
  for (int i = 0; i < 100'000; ++i) text += "<a>";
  EXPECT_NE(refusal_of(text).find("f.xml:1:"), std::string::npos);
}

TEST(XmlLimits, EntityExpansionIsBounded) {
  std::string text = "<!DOCTYPE r [<!ENTITY a0 \"ha\">";
  for (int i = 1; i < 40; ++i) {
    const std::string n = std::to_string(i), m = std::to_string(i - 1);
    text += "<!ENTITY a" + n + " \"&a" + m + ";&a" + m + ";&a" + m + ";&a" + m + ";\">";
  }
  EXPECT_NE(refusal_of(text + "]><r>&a39;</r>"), "");
  EXPECT_NE(refusal_of("<!DOCTYPE r [<!ENTITY a \"&b;\"><!ENTITY b \"&a;\">]><r>&a;</r>"), "");
}

TEST(XmlLimits, ExternalEntitiesAreNotRead) {
  EXPECT_NE(refusal_of("<!DOCTYPE r [<!ENTITY a SYSTEM \"file:///etc/passwd\">]><r>&a;</r>"), "");
}

TEST(XmlLimits, InvalidBytesAreRefusedAndUtf16IsRead) {
  EXPECT_NE(refusal_of(std::string(1 << 20, '\0')), "");
  EXPECT_NE(refusal_of(""), "");
  EXPECT_NE(refusal_of("<r a='\xff\xfe'/>"), "");
  EXPECT_EQ(parse_xml("\xEF\xBB\xBF<r a='\xC3\xA4'/>", "a.xml").find("a")->value, "\xC3\xA4");
  const std::string utf16("\xFF\xFE<\0r\0 \0a\0=\0'\0\xE4\0'\0/\0>\0", 22);
  EXPECT_EQ(parse_xml(utf16, "a.xml").find("a")->value, "\xC3\xA4");
}

}  // namespace
}  // namespace doppel
