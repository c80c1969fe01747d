// Python's math module.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include "doppel/description/xacro/detail/expression_functions.h"
#include "doppel/description/xacro/detail/expression_operators.h"

namespace doppel {
namespace {

// f(x), with Python's errors: not a number for a finite x, or too large.
Value checked(double result, const Arguments& a, const char* name) {
  const bool finite = std::all_of(a.begin(), a.end(), [](const Value& v) { return std::isfinite(v.real()); });
  if (finite && std::isnan(result))
    throw ExpressionError(fmt::format("{}({}) is undefined", name, a[0].brief()));
  if (finite && std::isinf(result))
    throw ExpressionError(fmt::format("{}({}) is too large", name, a[0].brief()));
  return Value(result);
}

void add_real_functions(FunctionTable& t) {
  using Function = double (*)(double);
  const std::pair<const char*, Function> kOne[] = {
      {"sin", std::sin},      {"cos", std::cos},     {"tan", std::tan},     {"asin", std::asin},
      {"acos", std::acos},    {"atan", std::atan},   {"sinh", std::sinh},   {"cosh", std::cosh},
      {"tanh", std::tanh},    {"asinh", std::asinh}, {"acosh", std::acosh}, {"atanh", std::atanh},
      {"sqrt", std::sqrt},    {"cbrt", std::cbrt},   {"exp", std::exp},     {"exp2", std::exp2},
      {"expm1", std::expm1},  {"fabs", std::fabs},   {"erf", std::erf},     {"erfc", std::erfc},
      {"log10", std::log10},  {"log2", std::log2},   {"log1p", std::log1p}, {"gamma", std::tgamma},
      {"lgamma", std::lgamma}};
  for (const auto& [name, f] : kOne) {
    add_function(t, name, [f = f, name = name](const Arguments& a) {
      expect_arguments(a, 1, 1, name);
      return checked(f(real_argument(a, 0, name)), a, name);
    });
  }
  add_function(t, "radians", [](const Arguments& a) {
    expect_arguments(a, 1, 1, "radians");
    return Value(real_argument(a, 0, "radians") * (std::numbers::pi / 180.0));
  });
  add_function(t, "degrees", [](const Arguments& a) {
    expect_arguments(a, 1, 1, "degrees");
    return Value(real_argument(a, 0, "degrees") * (180.0 / std::numbers::pi));
  });
  using Function2 = double (*)(double, double);
  const std::pair<const char*, Function2> kTwo[] = {
      {"atan2", std::atan2},         {"pow", std::pow},
      {"fmod", std::fmod},           {"copysign", std::copysign},
      {"remainder", std::remainder}, {"nextafter", std::nextafter}};
  for (const auto& [name, f] : kTwo) {
    add_function(t, name, [f = f, name = name](const Arguments& a) {
      expect_arguments(a, 2, 2, name);
      return checked(f(real_argument(a, 0, name), real_argument(a, 1, name)), a, name);
    });
  }
  add_function(t, "log", [](const Arguments& a) {
    expect_arguments(a, 1, 2, "log");
    const Value value = checked(std::log(real_argument(a, 0, "log")), a, "log");
    if (a.size() == 1) return value;
    const double base = std::log(real_argument(a, 1, "log"));
    if (base == 0.0) throw ExpressionError("log() with base 1 is undefined");
    return checked(value.real() / base, a, "log");
  });
}

void add_whole_functions(FunctionTable& t) {
  using Function = double (*)(double);
  const std::pair<const char*, Function> kRound[] = {
      {"floor", std::floor}, {"ceil", std::ceil}, {"trunc", std::trunc}};
  for (const auto& [name, f] : kRound) {
    add_function(t, name, [f = f, name = name](const Arguments& a) {
      expect_arguments(a, 1, 1, name);
      if (a[0].is<Value::Big>()) return a[0];
      const double value = real_argument(a, 0, name);
      return a[0].integral() ? Value(a[0].integer()) : to_integer(f(value), name);
    });
  }
  add_function(t, "gcd", [](const Arguments& a) {
    std::int64_t out = 0;
    for (std::size_t i = 0; i < a.size(); ++i) out = std::gcd(out, integer_argument(a, i, "gcd"));
    return Value(out);
  });
  add_function(t, "factorial", [](const Arguments& a) {
    const std::int64_t n = integer_argument(a, 0, "factorial");
    if (n < 0 || n > 20) throw ExpressionError("factorial() needs 0 to 20 (64 bits)");
    std::int64_t out = 1;
    for (std::int64_t i = 2; i <= n; ++i) out *= i;
    return Value(out);
  });
  add_function(t, "comb", [](const Arguments& a) {
    const std::int64_t n = integer_argument(a, 0, "comb"), k = integer_argument(a, 1, "comb");
    if (n < 0 || k < 0) throw ExpressionError("comb() needs non-negative numbers");
    std::int64_t out = k > n ? 0 : 1;
    for (std::int64_t i = 1; i <= std::min(k, n - k); ++i) {
      if (__builtin_mul_overflow(out, n - std::min(k, n - k) + i, &out))
        throw ExpressionError("comb() needs more than 64 bits");
      out /= i;
    }
    return Value(out);
  });
  add_function(t, "isqrt", [](const Arguments& a) {
    const std::int64_t n = integer_argument(a, 0, "isqrt");
    if (n < 0) throw ExpressionError("isqrt() of a negative number");
    auto root = static_cast<std::int64_t>(std::sqrt(static_cast<double>(n)));
    while (root > 0 && root > n / root) --root;
    while (root + 1 <= n / (root + 1)) ++root;
    return Value(root);
  });
}

void add_judging_functions(FunctionTable& t) {
  add_function(t, "isnan",
               [](const Arguments& a) { return Value(std::isnan(real_argument(a, 0, "isnan"))); });
  add_function(t, "isinf",
               [](const Arguments& a) { return Value(std::isinf(real_argument(a, 0, "isinf"))); });
  add_function(t, "isfinite",
               [](const Arguments& a) { return Value(std::isfinite(real_argument(a, 0, "isfinite"))); });
  t["isclose"] = Value::function("isclose", [](ValueList& a, KeywordArguments& keywords) {
    const double x = real_argument(a, 0, "isclose"), y = real_argument(a, 1, "isclose");
    double relative = 1e-9, absolute = 0.0;
    for (const auto& [name, value] : keywords) {
      if (!value.number()) throw ExpressionError("isclose() needs numbers");
      (name == "abs_tol" ? absolute : relative) = value.real();
    }
    if (x == y) return Value(true);
    if (std::isinf(x) || std::isinf(y)) return Value(false);
    const double apart = std::abs(x - y);
    return Value(apart <= std::max(relative * std::max(std::abs(x), std::abs(y)), absolute));
  });
}

void add_folding_functions(FunctionTable& t) {
  add_function(t, "hypot", [](const Arguments& a) {
    double out = 0;
    for (std::size_t i = 0; i < a.size(); ++i) out = std::hypot(out, real_argument(a, i, "hypot"));
    return Value(out);
  });
  add_function(t, "dist", [](const Arguments& a) {
    const ValueList p = items_argument(a, 0, "dist"), q = items_argument(a, 1, "dist");
    if (p.size() != q.size()) throw ExpressionError("dist() needs points of one dimension");
    double out = 0;
    for (std::size_t i = 0; i < p.size(); ++i)
      out = std::hypot(out, real_argument(p, i, "dist") - real_argument(q, i, "dist"));
    return Value(out);
  });
  add_function(t, "prod", [](const Arguments& a) {
    Value out(std::int64_t{1});
    for (const Value& item : items_argument(a, 0, "prod"))
      out = binary_operation(Operator::multiply, out, item);
    return out;
  });
  // Neumaier's sum, accurate enough for robot descriptions.
  add_function(t, "fsum", [](const Arguments& a) {
    double total = 0, lost = 0;
    const ValueList items = items_argument(a, 0, "fsum");
    for (std::size_t i = 0; i < items.size(); ++i) {
      const double x = real_argument(items, i, "fsum"), next = total + x;
      lost += std::abs(total) >= std::abs(x) ? (total - next) + x : (x - next) + total;
      total = next;
    }
    return Value(total + lost);
  });
  add_function(t, "modf", [](const Arguments& a) {
    double whole = 0;
    const double rest = std::modf(real_argument(a, 0, "modf"), &whole);
    return Value::tuple({Value(rest), Value(whole)});
  });
}

}  // namespace

FunctionTable math_functions() {
  FunctionTable t;
  add_real_functions(t);
  add_whole_functions(t);
  add_judging_functions(t);
  add_folding_functions(t);
  t["pi"] = Value(std::numbers::pi);
  t["e"] = Value(std::numbers::e);
  t["tau"] = Value(2 * std::numbers::pi);
  t["inf"] = Value(HUGE_VAL);
  t["nan"] = Value(std::nan(""));
  return t;
}

}  // namespace doppel
