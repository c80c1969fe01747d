#pragma once
// Values of xacro's expressions: Python's, as far as robot descriptions use them, printed as Python prints
// them. They are immutable, so they contain no cycles; depth and size are checked at construction.

#include <concepts>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <new>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "doppel/description/xacro/detail/whole_number.h"

namespace doppel {

class Value;
using ValueList = std::vector<Value>;
using KeywordArguments = std::vector<std::pair<std::string, Value>>;
using ValueFunction = std::function<Value(ValueList& arguments, KeywordArguments& keywords)>;

// A dict's or set's entries in order of insertion, found by key. Keys are of the types that Python can hash.
class ValueDict {
 public:
  ValueDict();
  ~ValueDict();
  ValueDict(const ValueDict&);
  ValueDict(ValueDict&&) noexcept;
  ValueDict& operator=(const ValueDict&) = delete;

  void set(Value key, Value value);  // throws ExpressionError for a key that cannot be hashed
  void reserve(std::size_t entries);
  [[nodiscard]] const Value* find(const Value& key) const;
  // Finds an entry by a text, without making a value of it.
  template <std::convertible_to<std::string_view> Text>
  [[nodiscard]] const Value* find(const Text& key) const {
    return find_text(key);
  }
  using Entry = std::pair<Value, Value>;
  [[nodiscard]] std::size_t size() const;
  [[nodiscard]] bool empty() const;
  [[nodiscard]] const Entry* begin() const;
  [[nodiscard]] const Entry* end() const;

 private:
  // A place in the index: the upper half of the key's hash, and the entry's position and one; 0 if free.
  using Slot = std::uint64_t;
  [[nodiscard]] const Value* find_text(std::string_view key) const;
  [[nodiscard]] std::size_t position_of_text(std::string_view key) const;
  template <class Same>
  [[nodiscard]] std::size_t indexed(std::size_t hash, Same same) const;
  [[nodiscard]] std::size_t position(const Value& key) const;
  void add_to_index(std::size_t hash, std::size_t position);
  void grow_index();
  std::vector<Entry> entries_;
  std::vector<Slot> index_;  // empty while a search is as quick
};

// An object whose attributes are looked up on access: a module, a namespace of an include.
class ValueObject {
 public:
  virtual ~ValueObject() = default;
  virtual const Value* find(std::string_view name) = 0;
  [[nodiscard]] virtual std::vector<std::string> names() const = 0;
};

class Value {
 public:
  struct None {
    bool operator==(const None&) const = default;
  };
  struct Items {
    ValueList values;
    int depth = 1;            // of containers within each other
    std::int64_t weight = 1;  // of all that is inside
    std::string shown;        // how Python prints a range or view; empty: as a list
  };
  struct Entries {
    ValueDict dict;
    int depth = 1;
    std::int64_t weight = 1;
  };
  struct List {
    std::shared_ptr<const Items> items;
  };
  struct Tuple {
    std::shared_ptr<const Items> items;
  };
  struct Dict {
    std::shared_ptr<const Entries> entries;
    bool dotted = false;  // its entries are attributes too, and those of what is inside
  };
  struct Set {
    std::shared_ptr<const Entries> entries;
  };
  struct Function {
    std::string name;
    std::shared_ptr<ValueFunction> call;
    bool type = false;  // str, int, list: also a type for isinstance() and type()
  };
  struct Object {
    std::string name;
    std::shared_ptr<ValueObject> object;
  };
  // An int of more than 64 bits; one that fits is always an std::int64_t.
  struct Big {
    std::shared_ptr<const WholeNumber> number;
  };
  using Data = std::variant<None, bool, std::int64_t, double, std::string, List, Tuple, Dict, Set, Function,
                            Object, Big>;

  Value() : data() {}
  Value(bool v) : data(v) {}
  Value(std::int64_t v) : data(v) {}
  Value(double v) : data(v) {}
  Value(std::string v) : data(std::move(v)) {}
  Value(const char* v) : data(std::in_place_type<std::string>, v) {}
  explicit Value(std::string_view v) : data(std::in_place_type<std::string>, v) {}
  Value(const Value& v) : data(copied(v.data)) {}
  Value(Value&& v) noexcept : data(moved(v.data)) {}
  Value& operator=(const Value& v) { return *this = Value(v); }
  Value& operator=(Value&& v) noexcept;
  ~Value() { drop(); }

  // Throw ExpressionError where the result would be too deep or too large.
  static Value list(ValueList items, std::string shown = "");
  static Value tuple(ValueList items);
  static Value dict(ValueDict entries, bool dotted = false);
  static Value set(const ValueList& items);
  static Value whole(WholeNumber number);
  static Value function(std::string name, ValueFunction call, bool type = false) {
    return wrap(Function{std::move(name), std::make_shared<ValueFunction>(std::move(call)), type});
  }
  static Value object(std::string name, std::shared_ptr<ValueObject> object) {
    return wrap(Object{std::move(name), std::move(object)});
  }

  template <class T>
  [[nodiscard]] bool is() const {
    return std::holds_alternative<T>(data);
  }
  template <class T>
  [[nodiscard]] const T& as() const {
    return std::get<T>(data);
  }

  [[nodiscard]] bool number() const { return is<std::int64_t>() || is<double>() || is<bool>() || is<Big>(); }
  // A bool or an int of 64 bits, and an int of any size.
  [[nodiscard]] bool integral() const { return is<bool>() || is<std::int64_t>(); }
  [[nodiscard]] bool whole() const { return integral() || is<Big>(); }
  [[nodiscard]] std::int64_t integer() const;      // precondition: integral()
  [[nodiscard]] WholeNumber whole_number() const;  // precondition: whole()
  // Precondition: number(). Throws ExpressionError for an int that is larger than any float.
  [[nodiscard]] double real() const;
  [[nodiscard]] bool truth() const;
  [[nodiscard]] const char* type_name() const;  // "int"
  [[nodiscard]] std::string str() const;        // as Python's str()
  [[nodiscard]] std::string repr() const;
  [[nodiscard]] std::string brief() const;  // repr() for a message, cut where it is long
  [[nodiscard]] bool sequence() const { return is<List>() || is<Tuple>(); }
  [[nodiscard]] const ValueList& values() const;  // precondition: sequence()
  // The items of a list or tuple, the keys of a dict or set, the characters of a string; false: has none.
  bool items(ValueList& out) const;
  [[nodiscard]] std::int64_t weight() const;
  [[nodiscard]] int depth() const;

  union {  // only so that drop() may destroy it
    Data data;
  };

 private:
  struct Wrapped {};
  template <class T>
  Value(Wrapped /*unused*/, T v) : data(std::move(v)) {}
  template <class T>
  static Value wrap(T v) {
    return Value(Wrapped(), std::move(v));
  }
  // Copies or moves as the variant would; numbers and texts, the most frequent types, without a call.
  template <class From>
  static Data transferred(From&& from);
  static Data copied(const Data& from);
  static Data moved(Data& from) noexcept;
  void drop() noexcept {
    if (auto* const text = std::get_if<std::string>(&data))
      text->~basic_string();
    else if (data.index() > 3)
      data.~Data();
  }
};

bool equal(const Value& a, const Value& b);
// -1, 0, 1; 2: one of them is not a number. Precondition: number() of both. Exact, as Python compares.
int compare_numbers(const Value& a, const Value& b);

// Python's repr of a float: the shortest text that reads back the same.
std::string format_real(double value);

// The numbers that Python's int(text, base) and float(text) read: blanks around, a sign, underscores between
// digits, every script's decimal digits. False as well for a whole number of more than 64 bits.
bool parse_integer(std::string_view text, std::int64_t& out, int base = 10);
bool parse_real(std::string_view text, double& out);
// Reads a number as parse_integer does, of up to 4096 bits. Null: no whole number, or a larger one.
std::optional<Value> parse_whole(std::string_view text, int base = 10);

// A number as most are, read in one scan: a sign, up to 18 digits, perhaps a point before, among or behind
// them. Other: something else, which may be a number too.
struct PlainNumber {
  enum class Kind : std::uint8_t { other, whole, real };
  Kind kind = Kind::other;
  std::int64_t whole = 0;
  double real = 0;  // of a whole number too
};
PlainNumber parse_plain(std::string_view text);

// The bytes of the character at the beginning of UTF-8; at least 1.
std::size_t character_length(std::string_view text);
std::size_t count_characters(std::string_view text);

// Defined here, where Value is complete.
template <class From>
Value::Data Value::transferred(From&& from) {
  switch (from.index()) {
    case 0:
      return Data();
    case 1:
      return Data(std::in_place_index<1>, *std::get_if<1>(&from));
    case 2:
      return Data(std::in_place_index<2>, *std::get_if<2>(&from));
    case 3:
      return Data(std::in_place_index<3>, *std::get_if<3>(&from));
    case 4:
      return Data(std::in_place_index<4>, std::get<4>(std::forward<From>(from)));
    default:
      return Data(std::forward<From>(from));
  }
}
inline Value::Data Value::copied(const Data& from) {
  return transferred(from);
}
inline Value::Data Value::moved(Data& from) noexcept {
  return transferred(std::move(from));
}
inline Value& Value::operator=(Value&& v) noexcept {
  if (this != &v) {
    drop();
    ::new (&data) Data(moved(v.data));
  }
  return *this;
}
inline std::size_t ValueDict::size() const {
  return entries_.size();
}
inline bool ValueDict::empty() const {
  return entries_.empty();
}
inline const ValueDict::Entry* ValueDict::begin() const {
  return entries_.data();
}
inline const ValueDict::Entry* ValueDict::end() const {
  return entries_.data() + entries_.size();
}

}  // namespace doppel
