#pragma once
// Values of xacro's expressions: Python's, as far as robot descriptions use them, printed as Python prints
// them.

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <variant>
#include <vector>

namespace doppel {

class Value;
using ValueList = std::vector<Value>;
using ValueDict = std::vector<std::pair<Value, Value>>;  // in order of insertion
using KeywordArguments = std::vector<std::pair<std::string, Value>>;
using ValueFunction = std::function<Value(ValueList& arguments, KeywordArguments& keywords)>;

class Value {
 public:
  struct None {
    bool operator==(const None&) const = default;
  };
  struct List {
    std::shared_ptr<ValueList> items;
  };
  struct Tuple {
    std::shared_ptr<ValueList> items;
  };
  struct Dict {
    std::shared_ptr<ValueDict> items;
  };
  struct Function {
    std::string name;
    std::shared_ptr<ValueFunction> call;
  };
  using Data = std::variant<None, bool, std::int64_t, double, std::string, List, Tuple, Dict, Function>;

  Value() = default;
  Value(bool v) : data(v) {}
  Value(std::int64_t v) : data(v) {}
  Value(double v) : data(v) {}
  Value(std::string v) : data(std::move(v)) {}
  Value(const char* v) : data(std::string(v)) {}

  static Value list(ValueList items) { return wrap(List{std::make_shared<ValueList>(std::move(items))}); }
  static Value tuple(ValueList items) { return wrap(Tuple{std::make_shared<ValueList>(std::move(items))}); }
  static Value dict(ValueDict items) { return wrap(Dict{std::make_shared<ValueDict>(std::move(items))}); }
  static Value function(std::string name, ValueFunction call) {
    return wrap(Function{std::move(name), std::make_shared<ValueFunction>(std::move(call))});
  }

  template <class T>
  [[nodiscard]] bool is() const {
    return std::holds_alternative<T>(data);
  }
  template <class T>
  [[nodiscard]] const T& as() const {
    return std::get<T>(data);
  }

  [[nodiscard]] bool number() const { return is<bool>() || is<std::int64_t>() || is<double>(); }
  [[nodiscard]] bool integral() const { return is<bool>() || is<std::int64_t>(); }
  [[nodiscard]] std::int64_t integer() const;  // precondition: integral()
  [[nodiscard]] double real() const;           // precondition: number()
  [[nodiscard]] bool truth() const;
  [[nodiscard]] const char* type_name() const;  // "int"
  [[nodiscard]] std::string str() const;        // as Python's str()
  [[nodiscard]] std::string repr() const;
  // The items of a list or tuple, the keys of a dict, the characters of a string; nullptr-like empty flag
  // otherwise.
  bool items(ValueList& out) const;
  [[nodiscard]] const Value* get(const Value& key) const;  // of a dict

  Data data;

 private:
  template <class T>
  static Value wrap(T v) {
    Value out;
    out.data = std::move(v);
    return out;
  }
};

bool equal(const Value& a, const Value& b);

// Python's repr of a float: the shortest text that reads back the same.
std::string format_real(double value);

}  // namespace doppel
