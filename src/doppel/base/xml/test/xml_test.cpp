#include "doppel/base/xml/xml.h"

#include <gtest/gtest.h>

#include <clocale>

#include "doppel/base/core/diagnostic.h"
#include "doppel/base/xml/test/xml_refusal.h"
#include "doppel/description/xacro/xacro.h"

namespace doppel {
namespace {

using namespace std::string_literals;

TEST(Xml, NodesHavePlaces) {
  const XmlTree tree = parse_xml_tree(
      "<?xml version=\"1.0\"?>\n<!-- top -->\n<a b='1'\n   c=\"x &lt; &#65;&#x42;\ty\">\n  t &amp; u<d/>\n"
      "<![CDATA[<raw>]]><!-- in --><?p q r?></a>\n<!-- end -->",
      "f.xml");
  ASSERT_NE(tree.before.first, nullptr);
  EXPECT_EQ(tree.before.first->text, " top ");
  EXPECT_EQ(tree.before.first, tree.before.last);
  ASSERT_NE(tree.after.first, nullptr);
  EXPECT_EQ(locate(tree.after.first->where).place(), "f.xml:7:1");
  const XmlNode a = tree.node();
  EXPECT_EQ(a.where.place(), "f.xml:3:1");
  EXPECT_EQ(a.find("c")->where.place(), "f.xml:4:4");
  EXPECT_EQ(a.find("c")->value, "x < AB y");
  ASSERT_EQ(a.children.size(), 6U);
  EXPECT_EQ(a.children[0].text, "\n  t & u");
  EXPECT_EQ(a.children[1].where.place(), "f.xml:5:12");
  EXPECT_TRUE(a.children[3].cdata);
  EXPECT_EQ(a.children[3].text, "<raw>");
  EXPECT_EQ(a.children[4].kind, XmlNode::Kind::comment);
  EXPECT_EQ(a.children[5].text, "q r");
}

TEST(Xml, ContentModeDropsCommentsAndBlanks) {
  const XmlNode a = parse_xml("<a>\n <b> </b> <!-- c -->\n t <?p?> <c>\n</c> </a>", "f.xml");
  ASSERT_EQ(a.children.size(), 3U);
  EXPECT_EQ(a.children[0].children.at(0).text, " ");
  EXPECT_EQ(a.children[1].text, "\n t ");
}

TEST(Xml, MalformedTextIsRefusedWithPlace) {
  const std::pair<std::string, const char*> cases[] = {
      {"", "f.xml:1:1: error: the XML is not well-formed: the file contains no element"},
      {"text", "f.xml:1:1:"},
      {"<a>\n<b>\n</a>", "f.xml:3:1: error: the XML is not well-formed: <b>, opened at line 2, column 1"},
      {"<a><b>", "<b>, opened at line 1, column 4, is not closed"},
      {"<a/><b/>", "f.xml:1:5: error: the XML is not well-formed: there are two root elements"},
      {"<a/>x", "after the root"},
      {"<a b=1/>", "f.xml:1:6: error: the XML is not well-formed: the value of b needs quotes"},
      {"<a b/>", "the attribute b has no value"},
      {"<a b='1' b='2'/>", "f.xml:1:10: error: the XML is not well-formed: the attribute b is given twice"},
      {"<a b='1'c='2'/>", "unexpected 'c'"},
      {"<a b='x<y'/>", "f.xml:1:8: error: the XML is not well-formed: '<' is not allowed in the value"},
      {"<a b='x/>", "no closing quote"},
      {"<a>&nbsp;</a>", "f.xml:1:4: error: the XML is not well-formed: the entity &nbsp; is not defined"},
      {"<a>a & b</a>", "f.xml:1:6: error: the XML is not well-formed: '&' does not start a reference"},
      {"<a>&#0;</a>", "is not a character"},
      {"<a>&#xD800;</a>", "is not a character"},
      {"<a><!-- x -- y --></a>",
       "f.xml:1:11: error: the XML is not well-formed: '--' is not allowed in a comment"},
      {"<a><!-- x</a>", "the comment is not closed"},
      {"<a>]]></a>", "is not allowed in text"},
      {"<a><![CDATA[x</a>", "CDATA section is not closed"},
      {"<1/>", "f.xml:1:2: error: the XML is not well-formed: a name is expected"},
      {"<a><?xml version='1.0'?></a>", "not at the beginning"},
      {"<a>\0</a>"s, "f.xml:1:4: error: the XML is not well-formed: the character 0x00"},
      {std::string(10'000, '\0'), "the character 0x00"},
      {"<a>\xff</a>", "the byte 0xff is not UTF-8"},
      {"<a>\xc0\x80</a>", "is not UTF-8"},
      {"<?xml version='1.0' encoding='EBCDIC'?><a>\xff</a>", "the encoding 'ebcdic' is not supported"},
  };
  for (const auto& [text, wanted] : cases)
    EXPECT_NE(refusal_of(text).find(wanted), std::string::npos) << text.substr(0, 80) << "\n"
                                                                << refusal_of(text);
}

TEST(Xml, EncodingsAndLineEndsAreNormalised) {
  EXPECT_EQ(parse_xml("\xEF\xBB\xBF<a>\xC3\xA9</a>", "f").content(), "é");
  EXPECT_EQ(parse_xml("\xFF\xFE<\0a\0>\0\xE9\0<\0/\0a\0>\0"s, "f").content(), "é");
  EXPECT_EQ(parse_xml("\xFE\xFF\0<\0a\0>\xD8\x3C\xDF\x54\0<\0/\0a\0>"s, "f").content(), "🍔");
  EXPECT_EQ(parse_xml("<?xml version='1.0' encoding='ISO-8859-1'?><a>\xE9</a>", "f").content(), "é");
  EXPECT_EQ(parse_xml("<a>x\r\ny\rz</a>", "f").children[0].text, "x\ny\nz");
  EXPECT_EQ(parse_xml("<a b='x\r\ny\tz'/>", "f").find("b")->value, "x y z");
}

TEST(Xml, EntitiesAreBounded) {
  EXPECT_EQ(
      parse_xml("<!DOCTYPE a [<!ENTITY b 'x&c;'><!ENTITY c \"y\"><!ELEMENT a ANY>]><a d='&b;'>&b;</a>", "f")
          .content(),
      "xy");
  std::string laughs = "<!DOCTYPE a [<!ENTITY l0 'lol'>";
  for (int i = 1; i < 30; ++i) {
    laughs += "<!ENTITY l" + std::to_string(i) + " '";
    for (int k = 0; k < 10; ++k) laughs += "&l" + std::to_string(i - 1) + ";";
    laughs += "'>";
  }
  EXPECT_NE(refusal_of(laughs + "]><a>&l7;</a>").find("more than 1 MB"), std::string::npos);
  EXPECT_NE(refusal_of(laughs + "]><a>&l29;</a>").find("entities"), std::string::npos);
  EXPECT_NE(refusal_of("<!DOCTYPE a [<!ENTITY b '&b;'>]><a>&b;</a>").find("nested too deeply"),
            std::string::npos);
  EXPECT_NE(refusal_of("<!DOCTYPE a [<!ENTITY b SYSTEM '/etc/passwd'>]><a>&b;</a>").find("not defined"),
            std::string::npos);
}

TEST(Xml, DepthAndSizeAreBounded) {
  std::string deep, many = "<a>";
  for (int i = 0; i < 100'000; ++i) deep += "<a>";
  EXPECT_NE(refusal_of(deep).find("nested more than"), std::string::npos);
  for (int i = 0; i < 1'100'000; ++i) many += "<b/>";
  EXPECT_NE(refusal_of(many + "</a>").find("more than a million"), std::string::npos);
}

TEST(Xml, OnlyRegularFilesAreRead) {
  const auto error_of = [](const std::string& file) {
    try {
      load_xml(file);
    } catch (const InputError& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_NE(error_of("/no/such/file").find("No such file"), std::string::npos);
  EXPECT_NE(error_of("/tmp").find("it is a folder"), std::string::npos);
  EXPECT_NE(error_of("/dev/zero").find("not a regular file"), std::string::npos);
}

TEST(Xml, LocaleHasNoEffect) {
  if (std::setlocale(LC_ALL, "de_DE.UTF-8") == nullptr && std::setlocale(LC_ALL, "de_DE.utf8") == nullptr)
    GTEST_SKIP() << "the German locale is not installed";
  PackageResolver resolver;
  Diagnostics diagnostics;
  XmlTree tree = parse_xml_tree(
      "<a xmlns:xacro='x'>${1.5 + 1} ${'%.2f' % 2.5} ${float('1.25')} ${round(2.675, 2)}</a>", "f");
  const std::string text =
      expand_xacro(std::move(tree), "f", {}, resolver, diagnostics).tree.node().content();
  std::setlocale(LC_ALL, "C");
  EXPECT_EQ(text, "2.5 2.50 1.25 2.67");
}

}  // namespace
}  // namespace doppel
