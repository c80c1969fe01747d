// The behaviour that the tests of ros/xacro (ROS 2 branch) check, in our own words: sources and their
// expansions.
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <map>
#include <numbers>

#include "doppel/description/xacro/detail/value.h"
#include "doppel/description/xacro/xacro.h"

namespace doppel {
namespace {

namespace fs = std::filesystem;
using Files = std::map<std::string, std::string>;
using Given = std::vector<std::pair<std::string, std::string>>;

// A folder with files for includes, removed when the test ends.
class Folder {
 public:
  explicit Folder(const Files& files)
      : path_(fs::temp_directory_path() / ("xacro_language_" + std::to_string(getpid()))) {
    fs::create_directories(path_);
    for (const auto& [name, text] : files) {
      fs::create_directories((path_ / name).parent_path());
      std::ofstream(path_ / name, std::ios::binary) << text;
    }
  }
  ~Folder() { fs::remove_all(path_); }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;
  [[nodiscard]] const fs::path& path() const { return path_; }

 private:
  fs::path path_;
};

std::string squeezed(const XmlNode& node) {
  std::string out;
  if (node.kind == XmlNode::Kind::comment) return "<!--" + node.text + "-->";
  if (node.kind == XmlNode::Kind::text) {
    for (std::size_t i = 0; (i = node.text.find_first_not_of(" \t\n", i)) != std::string::npos;) {
      const std::size_t end = std::min(node.text.find_first_of(" \t\n", i), node.text.size());
      out += (out.empty() ? "" : " ") + node.text.substr(i, end - i);
      i = end;
    }
    return escape_xml(out, false);
  }
  out = "<" + node.name;
  for (const XmlAttribute& a : node.attributes)
    out += " " + a.name + "=\"" + escape_xml(a.value, true) + "\"";
  std::string inner;
  for (const XmlNode& child : node.children) inner += squeezed(child);
  return out + (inner.empty() ? "/>" : ">" + inner + "</" + node.name + ">");
}

struct Outcome {
  std::string text;  // the expansion without insignificant white space; or the error
  std::string messages;
};

Outcome expanded(const std::string& inside, const Given& given = {}, const Files& files = {},
                 XmlContent keep = XmlContent::everything) {
  const Folder folder(files);
  PackageResolver resolver;
  resolver.add_package("here", folder.path());
  Diagnostics diagnostics;
  Outcome out;
  const std::string source = inside.starts_with("<a")
                                 ? inside
                                 : "<a xmlns:xacro=\"http://www.ros.org/wiki/xacro\">" + inside + "</a>";
  try {
    const fs::path file = folder.path() / "main.xacro";
    const XacroResult result =
        expand_xacro(parse_xml_tree(source, file.string(), keep), file, given, resolver, diagnostics);
    out.text = squeezed(result.tree.node());
  } catch (const InputError& error) {
    out.text = "error " + error.diagnostics().front().rule + ": " + error.what();
  }
  for (const Diagnostic& d : diagnostics.all()) out.messages += d.message + "\n";
  return out;
}

struct Case {
  const char* source;
  const char* wanted;  // inside <a>; or "error RULE"
  Given given = {};
};

void check(const std::vector<Case>& cases, const Files& files = {}) {
  for (const Case& c : cases) {
    const std::string wanted = c.wanted, got = expanded(c.source, c.given, files).text;
    if (wanted.starts_with("error "))
      EXPECT_TRUE(got.starts_with(wanted)) << c.source << "\n" << got;
    else if (wanted.starts_with("<a>") || wanted.starts_with("<a "))
      EXPECT_EQ(got, wanted) << c.source;
    else
      EXPECT_EQ(got, wanted.empty() ? "<a/>" : "<a>" + wanted + "</a>") << c.source;
  }
}

#define PROPERTY(name, value) "<xacro:property name='" name "' value='" value "'/>"

TEST(XacroLanguage, PropertiesAreEvaluatedLazily) {
  check({
      {PROPERTY("foo", "42") "<f r='${foo}'/>", R"(<f r="42"/>)"},
      {"<xacro:property name='no.dots'/>", "error xacro.property_name"},
      {"<xacro:property name='__hidden' value='1'/>", "error xacro.property_name"},
      {"<xacro:property name='pass' value='1'/>", "error xacro.property_name"},
      {"<xacro:property name='1abc' value='1'/>", "error xacro.property_name"},
      {PROPERTY("a", " 42 ") PROPERTY("b", "${ 2 * a }") "<d v='${b}'/>", R"(<d v="84"/>)"},
      {PROPERTY("b", "${2*a}") PROPERTY("a", "42") "<d v='${b}'/>", R"(<d v="84"/>)"},
      {PROPERTY("a", "${b}") PROPERTY("b", "${2*a}") "<d v='${b}'/>", "error xacro.circular"},
      {PROPERTY("s", "AbCd") "<xacro:property name='s' value='${s.lower()}' lazy_eval='false'/>${s}", "abcd"},
      {PROPERTY("a", "42") PROPERTY("b", "${a}") PROPERTY("b", "${-a}") PROPERTY("b", "${a}") "${b} ${b}",
       "42 42"},
      {PROPERTY("x", "42") PROPERTY("w", "${x}") "<o xyz='0 0 ${w/2}'/>", R"(<o xyz="0 0 21.0"/>)"},
      {PROPERTY("x", "0") "<t v='${1/x}'/>", "error xacro.division_by_zero"},
      {PROPERTY("xyz", "5 -2") "${xyz}", "5 -2"},
      {PROPERTY("f", "1.23") PROPERTY("i", "123") PROPERTY("s", "1_2_3") "${f+1} ${i+1} ${s}",
       "2.23 124 1_2_3"},
      {PROPERTY("l", "[0, 1+1]") PROPERTY("m", "${[0, 1+1]}") "${l} ${m} ${m[1]}", "[0, 1+1] [0, 2] 2"},
      {PROPERTY("d", "{1:0}") "${d}", "{1:0}"},
      {PROPERTY("p", "&apos;5&apos;") "${p + 1}", "6"},
      {PROPERTY("p", "&apos;a b&apos;") "${p}", "a b"},
      {PROPERTY("p", "inf") "${p}", "inf"},
      {PROPERTY("p", "007") "${p}", "7"},
      {PROPERTY("p", "123456789012345678901234567890") "${p}", "123456789012345678901234567890"},
      {PROPERTY("p", "true") "<xacro:if value='${p}'><t/></xacro:if>${p}", "<t/>True"},
      {"<xacro:property name='${\"a\" + \"b\"}' value='1'/>${ab}", "1"},
      {"<xacro:property name='p' value='' default=''/>", "error xacro.property"},
      {"<xacro:property name='p' value='' remove='true'/>", "error xacro.property"},
      {"<xacro:property name='p' default='' remove='true'/>", "error xacro.property"},
      {"<xacro:property name='p' default='42' remove='false'/>${p}", "42"},
      {"<xacro:property name='p' default='1'/><xacro:property name='p' remove='true'/><xacro:property "
       "name='p' "
       "default='2'/>${p}",
       "2"},
      {PROPERTY("p", "1") "<xacro:property name='p' default='2'/>${p}", "1"},
      {PROPERTY("v", "2") "<xacro:macro name='m'>in</xacro:macro><xacro:property name='b'><t "
                          "v='${v}'><xacro:m/></t></xacro:property><f><xacro:insert_block name='b'/></f>",
       R"(<f><t v="2">in</t></f>)"},
      {"<xacro:insert_block name='b'/>", "error xacro.undefined_block"},
      {PROPERTY("l", "${[1,2,3]}") PROPERTY("q", "${[l[i]*l[i] for i in [0,1,2]]}") "${q}", "[1, 4, 9]"},
      {PROPERTY("f", "${lambda x: 2 * x}") "${f(4)}", "8"},
  });
}

TEST(XacroLanguage, PropertyScopesMatchReference) {
  check({
      {"<xacro:macro name='m' params='k'><xacro:property name='foo' value='${21*k}' "
       "scope='parent'/></xacro:macro><xacro:m k='2'/>${foo}",
       "42"},
      {"<xacro:macro name='m' params='k'><xacro:macro name='n'><xacro:property name='foo' value='${21*k}' "
       "scope='global'/></xacro:macro><xacro:n/></xacro:macro><xacro:m k='2'/>${foo}",
       "42"},
      {"<xacro:macro name='m'><xacro:property name='foo' value='1'/></xacro:macro><xacro:m/>${foo}",
       "error xacro.undefined_name"},
      {PROPERTY("p", "outer") "<xacro:macro name='m'><o p='${p}'/>" PROPERTY(
           "p", "inner") "<xacro:macro name='m'><i "
                         "p='${p}'/></xacro:macro><xacro:m/></xacro:macro><xacro:m/><xacro:m/>",
       R"(<o p="outer"/><i p="inner"/><o p="outer"/><i p="inner"/>)"},
  });
  const Files files{
      {"A.xacro",
       "<a xmlns:xacro='x'><xacro:include filename='B.xacro' ns='B'/><xacro:property name='prop' "
       "value='B'/><A prop='${prop}'/></a>"},
      {"B.xacro",
       "<a xmlns:xacro='x'><xacro:property name='prop' value='b'/><xacro:macro name='set'><xacro:property "
       "name='prop' value='macro' scope='parent'/></xacro:macro></a>"}};
  check({{PROPERTY("prop", "root") "<xacro:include filename='A.xacro' ns='A'/><r p='${prop}' a='${A.prop}' "
                                   "b='${A.B.prop}'/><xacro:A.B.set/><r p='${prop}'/>",
          R"(<A prop="B"/><r p="root" a="B" b="b"/><r p="macro"/>)"}},
        files);
}

TEST(XacroLanguage, MacrosAndBlocksMatchReference) {
  check({
      {"<xacro:macro name='m' params='v'><x v='${v}'/></xacro:macro><xacro:m v='100'/>", R"(<x v="100"/>)"},
      {"<xacro:macro name='in' params='*b'><i><xacro:insert_block name='b'/></i></xacro:macro><xacro:macro "
       "name='out' "
       "params='*b'><o><xacro:in><xacro:insert_block "
       "name='b'/></xacro:in></o></xacro:macro><xacro:out><w/></xacro:out>",
       "<o><i><w/></i></o>"},
      {"<xacro:macro name='m' params='l'>${l[-1]}</xacro:macro><xacro:m l='${[1,2,3]}'/>", "3"},
      {R"(<xacro:macro name="m" params="a='1 -2' c=3"><b a="${a}" c="${c}"/></xacro:macro><xacro:m/>)",
       R"(<b a="1 -2" c="3"/>)"},
      {"<xacro:macro name='m' params='*b'><xacro:insert_block name='b'/><xacro:insert_block "
       "name='b'/></xacro:macro><xacro:m><k/></xacro:m>",
       "<k/><k/>"},
      {"<xacro:macro name='m' params='*p *q'><xacro:insert_block name='q'/><xacro:insert_block "
       "name='p'/></xacro:macro><xacro:m><p/><q/></xacro:m>",
       "<q/><p/>"},
      {"<xacro:macro name='m' params='**b'><xacro:insert_block "
       "name='b'/></xacro:macro><xacro:m><k>t<x/></k></xacro:m>",
       "t<x/>"},
      {"<xacro:macro name='m' params='*b'/><xacro:m/>", "error xacro.missing_block"},
      {"<xacro:macro name='m' params=''/><xacro:m><k/></xacro:m>", "error xacro.unused_block"},
      {"<xacro:macro name='m' params='p:=base c *o'><j c='${c}' p='${p}'><xacro:insert_block "
       "name='o'/></j></xacro:macro><xacro:m c='k'><o/></xacro:m><xacro:m c='k' p='q'><o/></xacro:m>",
       R"(<j c="k" p="base"><o/></j><j c="k" p="q"><o/></j>)"},
      {"<xacro:macro name='m' params='a b'/><xacro:m a='1'/>", "error xacro.missing_parameter"},
      {"<xacro:macro name='m' params='a'/><xacro:m a='1' b='2'/>", "error xacro.unknown_parameter"},
      {"<xacro:nothing/>", "error xacro.unknown_macro"},
      {"<xacro:call macro='nothing'/>", "error xacro.unknown_macro"},
      {"<xacro:call/>", "error xacro.missing_attribute"},
      {"<xacro:macro name='${p}_m'><a/></xacro:macro><xacro:macro name='m'><b/></xacro:macro><xacro:m/>",
       "<b/>"},
      {"<xacro:macro name='call'/>", "error xacro.macro_name"},
      {"<xacro:macro name='a.b'/>", "error xacro.macro_name"},
      {"<xacro:macro name='f'><x/></xacro:macro><xacro:macro name='g'><y/></xacro:macro>" PROPERTY(
           "v", "g") "<xacro:call macro='${v}'/>",
       "<y/>"},
      {PROPERTY("foo",
                "1.0") "<xacro:macro name='m' params='foo'><x v='${foo}'/></xacro:macro><xacro:m foo='1 "
                       "${foo}'/>" PROPERTY("foo",
                                            "2.0") "<xacro:macro name='m' params='foo'><y "
                                                   "v='${foo}'/></xacro:macro><xacro:m foo='2 ${foo}'/>",
       R"(<x v="1 1.0"/><y v="2 2.0"/>)"},
      {"<xacro:macro name='m' params='a b:=${a} c:=$${a}'>${a} ${b} ${c}</xacro:macro>" PROPERTY("a", "1")
           PROPERTY("d", "$${a}") "<d d='${d}'><xacro:m a='2'/></d>",
       R"(<d d="${a}">2 1 ${a}</d>)"},
      {PROPERTY("v", "42") "<xacro:macro name='m' params='v:=^'>${v}</xacro:macro><xacro:m/>", "42"},
      {PROPERTY("v", "42") "<xacro:macro name='m' params='v:=^|'>${v}</xacro:macro><xacro:m/>", "42"},
      {PROPERTY("v", "42") "<xacro:macro name='m' params='v:=^|6'>${v}</xacro:macro><xacro:m/>", "42"},
      {"<xacro:macro name='m' params='v:=^|6'>${v}</xacro:macro><xacro:m/>", "6"},
      {"<xacro:macro name='m' params='v:=^'>${v}</xacro:macro><xacro:m/>", "error xacro.missing_parameter"},
      {"<xacro:macro name='m' params='v:=${2*foo}'>" PROPERTY(
           "foo",
           "-") "<f v='${v}'/></xacro:macro>" PROPERTY("foo",
                                                       "${3*7}") "<xacro:m/>" PROPERTY("foo",
                                                                                       "*") "<xacro:m/>",
       R"(<f v="42"/><f v="**"/>)"},
      {"<xacro:macro name='m' params='n'><xacro:if value='${n > 0}'><x n='${n}'/><xacro:m "
       "n='${n-1}'/></xacro:if>"
       "</xacro:macro><xacro:m n='3'/>",
       R"(<x n="3"/><x n="2"/><x n="1"/>)"},
      {"<xacro:macro name='m' params='n'><xacro:element xacro:name='${n}' "
       "k='1'><i/></xacro:element></xacro:macro>"
       "<xacro:m n='A'/><xacro:m n='B'/>",
       R"(<A k="1"><i/></A><B k="1"><i/></B>)"},
      {"<xacro:element xacro:name=''/>", "error xacro.element"},
      {"<t><xacro:attribute name='${\"k\"}' value='${1+1}'/></t>", R"(<t k="2"/>)"},
      {"<t><xacro:attribute name='' value='1'/></t>", "error xacro.attribute"},
  });
  EXPECT_NE(expanded("<xacro:macro name='xacro:m'><x/></xacro:macro><xacro:m/>").messages.find("'xacro:'"),
            std::string::npos);
}

TEST(XacroLanguage, ParametersAreSplitAsByReference) {
  const auto shown = [](const std::string& params) {
    const std::string source =
        "<xacro:macro name=\"m\" params=\"" + params + "\">${foo}|${bar}</xacro:macro><xacro:m/>";
    return expanded(source).text;
  };
  for (const char* sign : {"=", ":=", " = ", " := "}) {
    for (const auto& [text, value] :
         {std::pair{"'single quoted'", "single quoted"}, std::pair{"${2 * (1 + 1)}", "4"},
          std::pair{"plain", "plain"}, std::pair{"any~w/o~space-'in quotes'", "any~w/o~space-'in quotes'"},
          std::pair{"$(optenv NO_SUCH x y)", "x y"}}) {
      const std::string got = shown(std::string("foo") + sign + text + "  bar=7");
      EXPECT_EQ(got, "<a>" + std::string(value) + "|7</a>") << sign << text;
    }
  }
  EXPECT_TRUE(shown("foo='open bar=7").starts_with("error xacro.parameters"));
}

TEST(XacroLanguage, ConditionsMatchReference) {
  check({
      {"<xacro:if value='false'><p/></xacro:if><xacro:if value='true'><q/></xacro:if>", "<q/>"},
      {"<xacro:unless value='false'><p/></xacro:unless><xacro:unless value='1'><q/></xacro:unless>", "<p/>"},
      {"<xacro:if value='nonsense'/>", "error xacro.not_boolean"},
      {"<xacro:if value='1.0'/>", "error xacro.not_boolean"},
      {"<xacro:if value=''/>", "error xacro.not_boolean"},
      {"<xacro:if/>", "error xacro.missing_attribute"},
      {"<xacro:if value='${0*42}'><p/></xacro:if><xacro:if value='0'><q/></xacro:if><xacro:if "
       "value='${1*2+3}'><r/></xacro:if>",
       "<r/>"},
      {"<xacro:if value='${3*0.0}'><p/></xacro:if><xacro:if value='${3*0.1}'><q/></xacro:if>", "<q/>"},
      {PROPERTY("t",
                "${True}") "<xacro:if value='${t}'><p/></xacro:if><xacro:if value='${[]}'><q/></xacro:if>",
       "<p/>"},
      {"<xacro:if value='1'><xacro:if value='0'><p/></xacro:if></xacro:if>", ""},
      {PROPERTY("v",
                "useit") "<xacro:if value=\"${v == 'useit'}\"><p/></xacro:if><xacro:if value=\"${'use' in "
                         "v}\"><q/></xacro:if>",
       "<p/><q/>"},
      {"<xacro:if value='false'><xacro:include filename='absent'/></xacro:if>", ""},
  });
}

TEST(XacroLanguage, SubstitutionsMatchReference) {
  setenv("DOPPEL_TEST_SET", "value", 1);
  check({
      {"<f v='${0.9 / 2 - 0.2}'/>", R"(<f v="0.25"/>)"},
      {"<f v='${1. + sin(pi)}'/>", R"(<f v="1.0000000000000002"/>)"},
      {"<t b='$${foo}' c='$$${foo}' d='t $${foo}' f='$$(pwd)'/>",
       R"x(<t b="${foo}" c="$${foo}" d="t ${foo}" f="$(pwd)"/>)x"},
      {"<t b='$' c='text $' d='text $ text'/>", R"(<t b="$" c="text $" d="text $ text"/>)"},
      {"a${", "error xacro.expression"},
      {"${b", "error xacro.expression"},
      {"${{}}", "error xacro.expression"},
      {"a$(", "error xacro.expression"},
      {"$(b", "error xacro.expression"},
      {"$(nothing x)", "error xacro.substitution"},
      {"$(find)", "error xacro.substitution"},
      {"$(arg foo)", "error xacro.undefined_argument"},
      {"<xacro:arg name='foo' default='2'/>$(arg foo)", "2"},
      {"<xacro:arg name='foo' default='2'/>$(arg foo)", "4", {{"foo", "4"}}},
      {"<xacro:arg name='foo' default='2'/>$(arg foo)", "2", {{"foo", ""}}},
      {"<xacro:arg name='foo' default=''/>$(arg foo)", ""},
      {"<xacro:arg name='foo' default='bar'/>${xacro.arg('foo')}", "bar"},
      {"<xacro:arg name='foo' default='0.5'/>" PROPERTY("p", "$(arg foo)") "${p-0.25}", "0.25"},
      {"<xacro:arg name='foo' default='0.5'/><xacro:arg name='bar' default='$(arg foo)'/>" PROPERTY(
           "p", "$(arg bar)") "${p-0.25}",
       "0.25"},
      {"${2*'$(arg var)'}", "xacroxacro", {{"var", "xacro"}}},
      {"$(arg ${'v'+'ar'})", "xacro", {{"var", "xacro"}}},
      {"$(env DOPPEL_TEST_SET)", "value"},
      {"$(env DOPPEL_TEST_UNSET)", "error xacro.environment"},
      {"$(optenv DOPPEL_TEST_UNSET a b)|$(optenv DOPPEL_TEST_UNSET)|$(optenv DOPPEL_TEST_SET x)",
       "a b||value"},
      {"$(find no_such_package)", "error xacro.package_not_found"},
      {"$(eval 1 + 2)", "3"},
      {"<xacro:arg name='n' default='2'/>$(eval n * 2)", "4"},
      {"<xacro:arg name='b' default='true'/><xacro:if value='$(eval not b)'><p/></xacro:if>", ""},
      {"${__import__('os')}", "error xacro.expression"},
      {"${''.__class__}", "error xacro.expression"},
      {"${open('/etc/passwd')}", "error xacro.undefined_name"},
      {"${eval('1')}", "error xacro.undefined_name"},
      {"<![CDATA[${x} <]]>", "${x} &lt;"},
      {"🍔 ${'🍔' * 2}", "🍔 🍔🍔"},
      {PROPERTY("b", "🍔") "<xacro:if value=\"${b == u'🍔'}\">🍟</xacro:if>", "🍟"},
      {PROPERTY("str", "sin") "${str}", "sin"},
      {"${xacro.tokenize('ab, cd;ef')} ${xacro.tokenize('a  b', sep=' ', skip_empty=False)}",
       "['ab', 'cd', 'ef'] ['a', '', 'b']"},
      {PROPERTY("s", "${xacro.dotify(dict(a=1, b=dict(c=2)))}") "${s.a + s.b.c}", "3"},
      {"${xacro.fatal('so', 2)}", "error xacro.fatal"},
      {"${xacro.message('colored', 'text', 2, 3.14)}", ""},
  });
  for (const char* f : {"message", "warning", "error"})
    EXPECT_NE(expanded(std::string("${xacro.") + f + "('colored', 'text', 2, 3.14)}")
                  .messages.find("colored text 2 3.14"),
              std::string::npos);
  EXPECT_NE(expanded(PROPERTY("pi", "3.14")).messages.find("'pi'"), std::string::npos);
  EXPECT_NE(expanded("<xacro:if value='1' valeu='2'/>").messages.find("did you mean 'value'"),
            std::string::npos);
}

TEST(XacroLanguage, IncludesMatchReference) {
  const Files files{
      {"inc1.xml", "<r><inc1/></r>"},
      {"inc2.xml", "<r><inc2/></r>"},
      {"one.xacro",
       "<r xmlns:xacro='x'><xacro:property name='var' value='1'/><xacro:macro "
       "name='foo'><one/></xacro:macro></r>"},
      {"two.xacro",
       "<r xmlns:xacro='x'><xacro:property name='var' value='2'/><xacro:property name='inner' "
       "value='int'/><xacro:macro name='bar' params='arg'><x arg='${arg}' ext='${ext}' "
       "var='${var}'/></xacro:macro></r>"},
      {"sub/inc1.xml", "<r><sub_inc1/></r>"},
      {"sub/again.xacro",
       "<r xmlns:xacro='x'><xacro:include filename='inc1.xml'/><xacro:include "
       "filename='./inc1.xml'/><xacro:include filename='../inc1.xml'/></r>"},
      {"sub/call.xacro", "<r xmlns:xacro='x'><xacro:foo/></r>"},
      {"sub/dir.xacro", "<r xmlns:xacro='x'><d v='$(dirname)'/></r>"},
      {"three.xacro",
       "<r xmlns:xacro='x'><xacro:include filename='inner.xacro'/><xacro:macro name='foo'><inc3 "
       "included='${p}'/><xacro:inner/></xacro:macro></r>"},
      {"inner.xacro",
       "<r xmlns:xacro='x'><xacro:property name='p' value='inner'/><xacro:macro "
       "name='inner'><inner/></xacro:macro></r>"},
      {"space.xml", "<r xmlns:b='http://b'/>"},
      {"broken.xml", "<r><b></r>"},
      {"loop.xacro", "<r xmlns:xacro='x'><xacro:include filename='loop.xacro'/></r>"}};
  check(
      {
          {"<xacro:include filename='inc1.xml'/>", "<inc1/>"},
          {"<xacro:include filename='$(find here)/inc1.xml'/>", "<inc1/>"},
          {"<xacro:include filename='inc*.xml'/>", "<inc1/><inc2/>"},
          {"<xacro:include filename='inc?.xml'/>", "<inc1/><inc2/>"},
          {"<xacro:include filename='inc[1-2].xml'/>", "<inc1/><inc2/>"},
          {"<xacro:include filename='none*.xml'/>", ""},
          {"<xacro:include filename='inc3.xml'/>", "error xacro.file_not_found"},
          {"<xacro:include filename='inc3.xml' optional='True'/>", ""},
          {"<xacro:include filename='inc1.xml' optional='true'/>", "<inc1/>"},
          {"<xacro:include filename='broken.xml'/>", "error xml.not_well_formed"},
          {"<xacro:include filename='sub'/>", "error file.unreadable"},
          {"<xacro:include filename='loop.xacro'/>", "error xacro.include_loop"},
          {"<xacro:include/>", "error xacro.missing_attribute"},
          {PROPERTY("f", "inc1.xml") "<xacro:include filename='${f}'/>", "<inc1/>"},
          {"<xacro:include filename='inc1.xml'/><xacro:include filename='./inc1.xml'/><xacro:include "
           "filename='sub/again.xacro'/>",
           "<inc1/><inc1/><sub_inc1/><sub_inc1/><inc1/>"},
          {PROPERTY("var",
                    "main") "<xacro:include filename='one.xacro' ns='A'/><xacro:include filename='two.xacro' "
                            "ns='B'/><xacro:A.foo/><m v='${var}' a='${2*A.var}' b='${B.var+1}'/>",
           R"(<one/><m v="main" a="2" b="3"/>)"},
          {"<xacro:include filename='two.xacro' ns='B'/>" PROPERTY("ext", "main")
               PROPERTY("var", "main") "<xacro:B.bar arg='${ext}'/><xacro:B.bar arg='${var}'/><xacro:B.bar "
                                       "arg='${inner}'/>",
           R"(<x arg="main" ext="main" var="2"/><x arg="2" ext="main" var="2"/><x arg="int" ext="main" var="2"/>)"},
          {"<xacro:macro name='foo' params='file:=inc1.xml'><xacro:include "
           "filename='${file}'/></xacro:macro><xacro:foo/>"
           "<xacro:foo file='${xacro.abs_filename(\"inc1.xml\")}'/><xacro:include "
           "filename='sub/call.xacro'/>",
           "<inc1/><inc1/><sub_inc1/>"},
          {"<xacro:include filename='three.xacro' ns='C'/><xacro:C.foo/>",
           R"(<inc3 included="inner"/><inner/>)"},
          {"<xacro:include filename='one.xacro' ns='A'/>${A.nothing}", "error xacro.undefined_name"},
          {"<include filename='x'><tag/></include>", R"(<include filename="x"><tag/></include>)"},
          {"<xacro:macro name='m'><xacro:include filename='space.xml'/></xacro:macro><xacro:m/>",
           R"(<a xmlns:b="http://b"/>)"},
      },
      files);
  EXPECT_NE(expanded("<xacro:include filename='sub/dir.xacro'/>", {}, files).text.find("/sub\""),
            std::string::npos);
}

TEST(XacroLanguage, RootNamespacesMatchReference) {
  check({
      {"<a xmlns:xacro='x' xacro:targetNamespace='http://t'/>", R"(<a xmlns="http://t"/>)"},
      {"<a xmlns:xacro='x'><b xacro:targetNamespace='http://t'/></a>", "<b/>"},
      {"<a xmlns:xacro='x' xmlns:c='y'/>", R"(<a xmlns:c="y"/>)"},
  });
}

TEST(XacroLanguage, CommentsMatchReference) {
  check({
      {"<!-- A -->\n\n<!-- x -->\n<!-- y -->\n" PROPERTY(
           "f", "1") "\n<!-- z -->\n<xacro:if value='1'><!-- B "
                     "--></xacro:if>\n<!-- w -->\n<xacro:macro name='m'><!-- C --></xacro:macro>\n<!-- v "
                     "-->\n<xacro:m/>",
       "<!-- A --><!-- B --><!-- C -->"},
      {"<xacro:if value='1'><!-- c --> text <b/></xacro:if>", "<!-- c -->text<b/>"},
      {"<xacro:macro name='m' params='*b'><!-- c -->foo<xacro:insert_block "
       "name='b'/></xacro:macro><xacro:m><!-- i "
       "-->ignored<k/></xacro:m>",
       "<!-- c -->foo<k/>"},
      {PROPERTY("n", "foo") "<!-- xacro:eval-comments --><!-- ${n} --> <!-- ${n} -->",
       "<!-- foo --><!-- foo -->"},
      {PROPERTY("n", "foo") "<!-- xacro:eval-comments:on --><!-- ${n} -->text<!-- ${n} -->",
       "<!-- foo -->text<!-- ${n} -->"},
      {PROPERTY("n", "foo") "<!-- xacro:eval-comments --><!-- ${n} --><t/><!-- ${n} -->",
       "<!-- foo --><t/><!-- ${n} -->"},
      {PROPERTY(
           "n",
           "foo") "<!-- xacro:eval-comments --><!-- ${n} --><!-- xacro:eval-comments:off --><!-- ${n} -->",
       "<!-- foo --><!-- ${n} -->"},
      {"<!-- ${n} -->", "<!-- ${n} -->"},
  });
}

TEST(XacroLanguage, YamlMatchesReference) {
  const Files files{
      {"s.yaml", "arms:\n  one: {file: inc1.xml, macro: m1, port: 4242}\n  two: {file: inc2.xml}\n"},
      {"list.yaml", "- [A1, A2]\n- [B1, B2]\n- {a: {A: 1, B: [2, 3]}, b: [4]}\n"},
      {"items.yaml", "- val: {x: 1}\n- val: {x: 2}\n"},
      {"units.yaml", "a: !degrees 180\nb: !radians 0.5*pi\nc: 42\nd: !millimeters 5\n"},
      {"bad1.yaml", "a: !degrees 1..2\n"},
      {"bad2.yaml", "a: !radians nothing\n"},
      {"bad3.yaml", "a: [1\n"},
      {"bad4.yaml", "a: !unknown 3\n"},
      {"two.yaml", "a: 1\n---\nb: 2\n"},
      {"types.yaml",
       "[1, 1.5, yes, off, ~, '1', 1e3, 1.0e+3, 0x10, 010, 1_000, .inf, 1:30, -2, text, \"q\", ]"},
      {"merge.yaml", "base: &b {x: 1, y: 2}\nother:\n  <<: *b\n  y: 3\n"},
      {"laughs.yaml",
       "a: &a [x,x,x,x,x,x,x,x,x]\nb: &b [*a,*a,*a,*a,*a,*a,*a,*a,*a]\nc: &c "
       "[*b,*b,*b,*b,*b,*b,*b,*b,*b]\nd: &d [*c,*c,*c,*c,*c,*c,*c,*c,*c]\ne: &e "
       "[*d,*d,*d,*d,*d,*d,*d,*d,*d]\nf: &f [*e,*e,*e,*e,*e,*e,*e,*e,*e]\ng: "
       "[*f,*f,*f,*f,*f,*f,*f,*f,*f]\n"},
      {"deep.yaml", std::string(5000, '[')},
      {"self.yaml", "&a [*a]\n"}};
#define YAML(name) PROPERTY("s", "${xacro.load_yaml(\"" name "\")}")
  check(
      {
          {YAML("s.yaml") "${s['arms']['one']['file']} ${s.arms.two.file} ${s.arms.one.port + 1}",
           "inc1.xml inc2.xml 4243"},
          {YAML("s.yaml") "${s.baz}", "error xacro.attribute"},
          {YAML("s.yaml") "${s['baz']}", "error xacro.key"},
          {YAML("s.yaml") "${'arms' in s} ${'baz' in s}", "True False"},
          {YAML("list.yaml") "${s[0][1]} ${s[1][0]} ${s[2].a.A} ${s[2].a.B[0]} ${s[2].b[0]}", "A2 B1 1 2 4"},
          {"${[2*i.val.x for i in xacro.load_yaml('items.yaml')]}", "[2, 4]"},
          {"${[2*i.val.x for i in load_yaml('items.yaml')]}", "[2, 4]"},
          {YAML("units.yaml") "${s.a} ${s.b} ${s.c} ${s.d}", "3.141592653589793 1.5707963267948966 42 0.005"},
          {YAML("bad1.yaml") "${s.a}", "error xacro.yaml"},
          {YAML("bad2.yaml") "${s.a}", "error xacro.yaml"},
          {YAML("bad3.yaml") "${s.a}", "error xacro.yaml"},
          {YAML("bad4.yaml") "${s.a}", "error xacro.yaml"},
          {YAML("two.yaml") "${s.a}", "error xacro.yaml"},
          {YAML("absent.yaml") "${s.a}", "error xacro.file_not_found"},
          {YAML("types.yaml") "${s}",
           "[1, 1.5, True, False, None, '1', '1e3', 1000.0, 16, 8, 1000, inf, 90, -2, 'text', 'q']"},
          {YAML("merge.yaml") "${s.other}", "{'x': 1, 'y': 3}"},
          {YAML("laughs.yaml") "${s}", "error xacro.yaml"},
          {YAML("deep.yaml") "${s}", "error xacro.yaml"},
          {YAML("self.yaml") "${s}", "error xacro.yaml"},
      },
      files);
}

TEST(XacroLanguage, EndlessRecursionIsError) {
  std::string doubling_text = PROPERTY("p0", "xxxxxxxxxx"), nested_lists = PROPERTY("l", "1");
  for (int i = 1; i <= 60; ++i)
    doubling_text += "<xacro:property name='p" + std::to_string(i) + "' value='${p" + std::to_string(i - 1) +
                     "}${p" + std::to_string(i - 1) + "}'/>";
  for (int i = 0; i < 2000; ++i)
    nested_lists += "<xacro:property name='l' value='${[l]}' lazy_eval='false'/>";
  std::string chain = PROPERTY("q0", "1");
  for (int i = 1; i <= 20000; ++i)
    chain +=
        "<xacro:property name='q" + std::to_string(i) + "' value='${q" + std::to_string(i - 1) + " + 1}'/>";
  const std::string blocks =
      "<xacro:macro name='m' params='*b'><xacro:m><x><xacro:insert_block name='b'/><xacro:insert_block "
      "name='b'/></x></xacro:m></xacro:macro><xacro:m><y/></xacro:m>";
  const std::string self =
      "<xacro:property name='b'><xacro:insert_block name='b'/></xacro:property><xacro:insert_block "
      "name='b'/>";
  for (const std::string& source : {doubling_text + "${p60}", nested_lists, chain + "${q20000}", blocks, self,
                                    std::string(PROPERTY("f", "${lambda x: f(x)}") "${f(1)}"),
                                    std::string("${'x' * 10**9}"), std::string("${9**9**9}")}) {
    const std::string got = expanded(source).text;
    EXPECT_TRUE(got.starts_with("error ")) << source.substr(0, 100) << got.substr(0, 100);
    EXPECT_LT(got.size(), 3000U) << got.substr(0, 3000);
  }
}

TEST(XacroLanguage, ErrorsListIncludesAndProperties) {
  const Files files{{"joints.xacro",
                     "<r xmlns:xacro='x'>\n<xacro:macro name='joint' params='a'>\n  <j l='${lenght}'/>\n"
                     "</xacro:macro></r>"}};
  const std::string got =
      expanded("<xacro:include filename='joints.xacro'/>\n" PROPERTY("length", "1") "<xacro:joint a='1'/>",
               {}, files)
          .text;
  EXPECT_NE(got.find("main.xacro:2:42: in macro 'joint' ("), std::string::npos) << got;
  EXPECT_NE(got.find("joints.xacro:3:6): error: name 'lenght' is not defined; did you mean 'length'?"),
            std::string::npos)
      << got;
  const std::string lazy = expanded(PROPERTY("a", "${1/0}") "\n<b c='${a}'/>").text;
  EXPECT_NE(lazy.find("main.xacro:2:4: in property 'a' ("), std::string::npos) << lazy;
}

}  // namespace
}  // namespace doppel
