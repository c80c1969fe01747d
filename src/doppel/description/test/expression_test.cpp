#include "doppel/description/expression.h"

#include <gtest/gtest.h>

namespace doppel {
namespace {

class Names : public NameScope {
 public:
  std::optional<Value> find(const std::string& name) override {
    if (name == "length") return Value(2.5);
    if (name == "arm")
      return Value::dict(
          {{Value("mass"), Value(std::int64_t{3})}, {Value("names"), Value::list({Value("a"), Value("b")})}});
    return std::nullopt;
  }
  [[nodiscard]] std::vector<std::string> names() const override { return {"length", "arm"}; }
};

std::string result(const std::string& text) {
  Names names;
  std::int64_t budget = 100'000;
  try {
    return evaluate(text, names, budget).str();
  } catch (const ExpressionError& error) {
    return std::string("error: ") + error.what();
  }
}

// Each right side is what Python 3 prints.
TEST(Expression, ArithmeticIsPythons) {
  EXPECT_EQ(result("1 + 2 * 3"), "7");
  EXPECT_EQ(result("7 / 2"), "3.5");
  EXPECT_EQ(result("4 / 2"), "2.0");
  EXPECT_EQ(result("-7 // 2"), "-4");
  EXPECT_EQ(result("-7 % 3"), "2");
  EXPECT_EQ(result("2 ** 10"), "1024");
  EXPECT_EQ(result("2 ** -1"), "0.5");
  EXPECT_EQ(result("-2 ** 2"), "-4");
  EXPECT_EQ(result("2 ** 3 ** 2"), "512");
  EXPECT_EQ(result("0.1 + 0.2"), "0.30000000000000004");
  EXPECT_EQ(result("1e-05"), "1e-05");
  EXPECT_EQ(result("0.0001"), "0.0001");
  EXPECT_EQ(result("1e16"), "1e+16");
  EXPECT_EQ(result("1e15"), "1000000000000000.0");
  EXPECT_EQ(result("59 * 2 * pi / 60"), "6.178465552059927");
  EXPECT_EQ(result("radians(90)"), "1.5707963267948966");
  EXPECT_EQ(result("math.pi == pi"), "True");
}

TEST(Expression, LogicReturnsOperandsAndComparisonsChain) {
  EXPECT_EQ(result("0 or 'x'"), "x");
  EXPECT_EQ(result("1 and 0"), "0");
  EXPECT_EQ(result("1 < 2 < 3"), "True");
  EXPECT_EQ(result("1 < 3 < 2"), "False");
  EXPECT_EQ(result("'a' if length > 2 else 'b'"), "a");
  EXPECT_EQ(result("not 'x' in 'yz'"), "True");
  EXPECT_EQ(result("3 not in [1, 2]"), "True");
  EXPECT_EQ(result("None is None"), "True");
  EXPECT_EQ(result("1 == 1.0 == True"), "True");
}

TEST(Expression, ContainersIndexSliceAndComprehend) {
  EXPECT_EQ(result("arm['mass'] * 2"), "6");
  EXPECT_EQ(result("arm.mass"), "3");
  EXPECT_EQ(result("arm.names[-1]"), "b");
  EXPECT_EQ(result("[1, 2, 3, 4][1:3]"), "[2, 3]");
  EXPECT_EQ(result("'abcdef'[::-2]"), "fdb");
  EXPECT_EQ(result("[x * x for x in range(5) if x % 2]"), "[1, 9]");
  EXPECT_EQ(result("{'a': 1, 'b': 2}"), "{'a': 1, 'b': 2}");
  EXPECT_EQ(result("dict(x=1).get('y', 7)"), "7");
  EXPECT_EQ(result("' '.join(['a', 'b'])"), "a b");
  EXPECT_EQ(result("'1 2 3'.split()"), "['1', '2', '3']");
  EXPECT_EQ(result("'{}-{:.2f}'.format('a', 1.5)"), "a-1.50");
  EXPECT_EQ(result("'%s_%d' % ('j', 3)"), "j_3");
  EXPECT_EQ(result("(1,)"), "(1,)");
  EXPECT_EQ(result("max(1, 2.5)"), "2.5");
}

TEST(Expression, ErrorsNameWhatIsWrong) {
  EXPECT_EQ(result("lenght"), "error: name 'lenght' is not defined; did you mean 'length'?");
  EXPECT_EQ(result("1 / 0"), "error: division by zero");
  EXPECT_NE(result("arm['mas']").find("did you mean 'mass'"), std::string::npos);
  EXPECT_NE(result("1 +").find("ends too early"), std::string::npos);
  EXPECT_NE(result("(1").find("')' is missing"), std::string::npos);
  EXPECT_NE(result("'a' + 1").find("unsupported operand"), std::string::npos);
}

TEST(Expression, IsBoundedWhateverTheText) {
  EXPECT_NE(result(std::string(100000, '(')).find("nested too deeply"), std::string::npos);
  EXPECT_NE(result(std::string(100000, '-') + "1").find("nested too deeply"), std::string::npos);
  EXPECT_NE(result("'x' * 10 ** 9").find("too long"), std::string::npos);
  EXPECT_NE(result("[y for x in range(1000) for y in range(1000)]").find("error"), std::string::npos);
  EXPECT_NE(result("[[z for z in range(1000)] for x in range(1000)]").find("too many steps"),
            std::string::npos);
}

}  // namespace
}  // namespace doppel
