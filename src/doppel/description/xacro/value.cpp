#include "doppel/description/xacro/detail/value.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>

#include "doppel/description/xacro/detail/expression.h"

namespace doppel {
namespace {

constexpr int kMaxContainerDepth = 64;
constexpr std::int64_t kMaxValueSize = 1'000'000;  // characters and items in one value
constexpr std::size_t kIndexFrom = 12;
constexpr std::size_t kFirstContainer = 5;  // in the order of Value::Data: all before contain no other values
static_assert(std::is_same_v<std::variant_alternative_t<kFirstContainer, Value::Data>, Value::List>);

std::string quoted(const std::string& text) {
  const char quote = text.find('\'') != std::string::npos && text.find('"') == std::string::npos ? '"' : '\'';
  std::string out(1, quote);
  for (const char c : text) {
    if (c == quote || c == '\\')
      out += '\\', out += c;
    else if (c == '\n')
      out += "\\n";
    else if (c == '\t')
      out += "\\t";
    else if (c == '\r')
      out += "\\r";
    else if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f)
      out += fmt::format("\\x{:02x}", static_cast<unsigned char>(c));
    else
      out += c;
  }
  return out + quote;
}

std::string joined(const ValueList& items) {
  std::string out;
  for (const Value& item : items) out += (out.empty() ? "" : ", ") + item.repr();
  return out;
}

// Equal values have equal hashes: numbers by their value, independent of the type.
std::size_t hash(const Value& v) {
  if (v.is<Value::Big>()) {
    const double value = v.as<Value::Big>().number->real();  // the hash of the float that equals it
    return std::hash<double>{}(value);
  }
  if (v.number()) return std::hash<double>{}(v.real());
  if (v.is<std::string>()) return std::hash<std::string>{}(v.as<std::string>());
  if (v.is<Value::None>()) return 7;
  if (v.is<Value::Tuple>()) {
    std::size_t out = 11;
    for (const Value& item : v.values()) out = out * 1'000'003 + hash(item);
    return out;
  }
  if (v.is<Value::Function>()) return std::hash<const void*>{}(v.as<Value::Function>().call.get());
  throw ExpressionError(fmt::format("a {} cannot be a key", v.type_name()));
}

template <class T>
void weigh(T& container, const Value& item) {
  if (item.data.index() >= kFirstContainer) {
    container.depth = std::max(container.depth, item.depth() + 1);
    container.weight += item.weight();
  } else {
    const std::string* const text = std::get_if<std::string>(&item.data);
    container.weight += text == nullptr ? 1 : static_cast<std::int64_t>(text->size()) + 1;
  }
}
template <class T>
void check(const T& container) {
  if (container.depth > kMaxContainerDepth) throw ExpressionError("lists and dicts are nested too deeply");
  if (container.weight > kMaxValueSize) throw ExpressionError("the value is too large", "xacro.too_much");
}

std::shared_ptr<const Value::Items> made(ValueList values, std::string shown) {
  auto out = std::make_shared<Value::Items>();
  for (const Value& value : values) weigh(*out, value);
  out->values = std::move(values);
  out->shown = std::move(shown);
  check(*out);
  return out;
}

std::shared_ptr<const Value::Entries> made(ValueDict dict) {
  auto out = std::make_shared<Value::Entries>(Value::Entries{std::move(dict)});
  for (const auto& [key, value] : out->dict) {
    weigh(*out, key);
    weigh(*out, value);
  }
  check(*out);
  return out;
}

bool same_entries(const ValueDict& a, const ValueDict& b) {
  if (a.size() != b.size()) return false;
  return std::all_of(a.begin(), a.end(), [&b](const auto& entry) {
    const Value* other = b.find(entry.first);
    return other != nullptr && equal(entry.second, *other);
  });
}

}  // namespace

ValueDict::ValueDict() = default;
ValueDict::~ValueDict() = default;
ValueDict::ValueDict(const ValueDict&) = default;
ValueDict::ValueDict(ValueDict&&) noexcept = default;

template <class Same>
std::size_t ValueDict::indexed(std::size_t hash, Same same) const {
  const std::size_t mask = index_.size() - 1;
  for (std::size_t at = hash & mask; index_[at] != 0; at = (at + 1) & mask) {
    if (index_[at] >> 32 != hash >> 32) continue;
    const std::size_t position = (index_[at] & 0xFFFF'FFFF) - 1;
    if (same(entries_[position].first)) return position;
  }
  return entries_.size();
}

std::size_t ValueDict::position(const Value& key) const {
  if (const std::string* const text = std::get_if<std::string>(&key.data)) return position_of_text(*text);
  const auto same = [&key](const Value& other) { return equal(other, key); };
  if (!index_.empty()) return indexed(hash(key), same);
  const auto found =
      std::find_if(entries_.begin(), entries_.end(), [&](const Entry& entry) { return same(entry.first); });
  return static_cast<std::size_t>(found - entries_.begin());
}

std::size_t ValueDict::position_of_text(std::string_view key) const {
  const auto same = [key](const Value& other) {
    const std::string* const text = std::get_if<std::string>(&other.data);
    if (text == nullptr || text->size() != key.size()) return false;
    // The first character distinguishes x from y without a call.
    return key.empty() ||
           (text->front() == key.front() && std::memcmp(text->data(), key.data(), key.size()) == 0);
  };
  if (!index_.empty()) return indexed(std::hash<std::string_view>{}(key), same);
  std::size_t at = 0;
  while (at < entries_.size() && !same(entries_[at].first)) ++at;
  return at;
}

const Value* ValueDict::find_text(std::string_view key) const {
  const std::size_t at = position_of_text(key);
  return at < entries_.size() ? &entries_[at].second : nullptr;
}

void ValueDict::add_to_index(std::size_t hash, std::size_t position) {
  const std::size_t mask = index_.size() - 1;
  std::size_t at = hash & mask;
  while (index_[at] != 0) at = (at + 1) & mask;
  index_[at] = (static_cast<Slot>(hash) >> 32 << 32) | (position + 1);
}

// At most half of the places are taken.
void ValueDict::grow_index() {
  const std::size_t places = std::max<std::size_t>(4 * kIndexFrom, std::bit_ceil(4 * entries_.size()));
  index_.assign(std::bit_ceil(places), 0);
  for (std::size_t i = 0; i < entries_.size(); ++i) add_to_index(hash(entries_[i].first), i);
}

void ValueDict::set(Value key, Value value) {
  if (!key.is<std::string>()) static_cast<void>(hash(key));  // throws for an invalid key
  const std::size_t at = position(key);
  if (at < entries_.size()) {
    entries_[at].second = std::move(value);
    return;
  }
  // Most are small, and some contain the values of a joint or link.
  if (entries_.size() == entries_.capacity() && entries_.size() < 12)
    entries_.reserve(entries_.empty() ? 4 : 12);
  entries_.emplace_back(std::move(key), std::move(value));
  if (2 * entries_.size() > index_.size() && entries_.size() >= kIndexFrom)
    grow_index();
  else if (!index_.empty())
    add_to_index(hash(entries_.back().first), entries_.size() - 1);
}

void ValueDict::reserve(std::size_t entries) {
  entries_.reserve(entries);
}

const Value* ValueDict::find(const Value& key) const {
  const std::size_t at = position(key);
  return at < entries_.size() ? &entries_[at].second : nullptr;
}

Value Value::list(ValueList items, std::string shown) {
  return wrap(List{made(std::move(items), std::move(shown))});
}
Value Value::tuple(ValueList items) {
  return wrap(Tuple{made(std::move(items), "")});
}
Value Value::dict(ValueDict entries, bool dotted) {
  return wrap(Dict{made(std::move(entries)), dotted});
}
Value Value::set(const ValueList& items) {
  ValueDict entries;
  for (const Value& item : items) entries.set(item, Value());
  return wrap(Set{made(std::move(entries))});
}

Value Value::whole(WholeNumber number) {
  if (const auto small = number.small()) return {*small};
  if (number.bits() > WholeNumber::kMaxBits)
    throw ExpressionError(fmt::format("the integer needs more than {} bits", WholeNumber::kMaxBits),
                          "xacro.overflow");
  return wrap(Big{std::make_shared<const WholeNumber>(std::move(number))});
}

WholeNumber Value::whole_number() const {
  return is<Big>() ? *as<Big>().number : WholeNumber(integer());
}

std::int64_t Value::integer() const {
  return is<bool>() ? (as<bool>() ? 1 : 0) : as<std::int64_t>();
}

double Value::real() const {
  if (is<double>()) return as<double>();
  if (!is<Big>()) return static_cast<double>(integer());
  const double out = as<Big>().number->real();
  if (std::isinf(out))
    throw ExpressionError(fmt::format("{} is too large for a float", brief()), "xacro.overflow");
  return out;
}

bool Value::truth() const {
  if (is<Big>()) return true;
  if (number()) return real() != 0.0;
  if (is<std::string>()) return !as<std::string>().empty();
  if (sequence()) return !values().empty();
  if (is<Dict>()) return !as<Dict>().entries->dict.empty();
  if (is<Set>()) return !as<Set>().entries->dict.empty();
  return !is<None>();
}

const char* Value::type_name() const {
  static constexpr const char* kNames[] = {"NoneType", "bool", "int", "float",    "str",       "list",
                                           "tuple",    "dict", "set", "function", "namespace", "int"};
  if (is<Function>() && as<Function>().type) return "type";
  return kNames[data.index()];
}

std::string Value::str() const {
  return is<std::string>() ? as<std::string>() : repr();
}

std::string Value::repr() const {
  if (is<None>()) return "None";
  if (is<bool>()) return as<bool>() ? "True" : "False";
  if (is<std::int64_t>()) return std::to_string(as<std::int64_t>());
  if (is<double>()) return format_real(as<double>());
  if (is<Big>()) return as<Big>().number->text();
  if (is<std::string>()) return quoted(as<std::string>());
  if (is<List>()) {
    const Items& items = *as<List>().items;
    return items.shown.empty() ? "[" + joined(items.values) + "]" : items.shown;
  }
  if (is<Tuple>()) return "(" + joined(values()) + (values().size() == 1 ? ",)" : ")");
  if (is<Dict>()) {
    std::string out;
    for (const auto& [key, value] : as<Dict>().entries->dict)
      out += (out.empty() ? "" : ", ") + key.repr() + ": " + value.repr();
    return "{" + out + "}";
  }
  if (is<Set>()) {
    ValueList keys;
    items(keys);
    return keys.empty() ? "set()" : "{" + joined(keys) + "}";
  }
  if (is<Object>()) return "<namespace " + as<Object>().name + ">";
  return as<Function>().type ? "<class '" + as<Function>().name + "'>"
                             : "<function " + as<Function>().name + ">";
}

std::string Value::brief() const {
  std::string out = repr();
  if (out.size() <= 80) return out;
  std::size_t end = 77;
  while (end > 0 && (static_cast<unsigned char>(out[end]) & 0xC0) == 0x80) --end;
  return out.substr(0, end) + "...";
}

const ValueList& Value::values() const {
  return is<List>() ? as<List>().items->values : as<Tuple>().items->values;
}

bool Value::items(ValueList& out) const {
  if (sequence()) return out = values(), true;
  out.clear();
  if (is<Dict>() || is<Set>()) {
    for (const auto& [key, value] : is<Dict>() ? as<Dict>().entries->dict : as<Set>().entries->dict)
      out.push_back(key);
    return true;
  }
  if (!is<std::string>()) return false;
  std::string_view rest = as<std::string>();
  while (!rest.empty()) {
    const std::size_t length = character_length(rest);
    out.emplace_back(std::string(rest.substr(0, length)));
    rest.remove_prefix(length);
  }
  return true;
}

std::int64_t Value::weight() const {
  if (is<std::string>()) return static_cast<std::int64_t>(as<std::string>().size()) + 1;
  if (data.index() < kFirstContainer) return 1;
  if (is<Big>()) {
    const auto limbs = static_cast<std::int64_t>(as<Big>().number->bits() / 32 + 1);
    return limbs * limbs;  // the cost of a product or quotient
  }
  if (is<List>()) return as<List>().items->weight;
  if (is<Tuple>()) return as<Tuple>().items->weight;
  if (is<Dict>()) return as<Dict>().entries->weight;
  return is<Set>() ? as<Set>().entries->weight : 1;
}

int Value::depth() const {
  if (data.index() < kFirstContainer) return 0;
  if (is<List>()) return as<List>().items->depth;
  if (is<Tuple>()) return as<Tuple>().items->depth;
  if (is<Dict>()) return as<Dict>().entries->depth;
  return is<Set>() ? as<Set>().entries->depth : 0;
}

int compare_numbers(const Value& a, const Value& b) {
  if (a.integral() && b.integral()) return a.integer() < b.integer() ? -1 : a.integer() > b.integer();
  if (a.whole() && b.whole()) return WholeNumber::compare(a.whole_number(), b.whole_number());
  if (a.is<Value::Big>() || b.is<Value::Big>()) {
    // A float of that size is a whole number; for a smaller one the size decides.
    const double real = a.is<double>() ? a.as<double>() : b.as<double>();
    const int sign = a.is<double>() ? 1 : -1;
    if (std::isnan(real)) return 2;
    if (std::isinf(real)) return real > 0 ? sign : -sign;
    return sign * WholeNumber::compare(WholeNumber(real), (a.is<double>() ? b : a).whole_number());
  }
  const double x = a.real(), y = b.real();
  return x < y ? -1 : x > y ? 1 : x == y ? 0 : 2;
}

bool equal(const Value& a, const Value& b) {
  if (const std::string* const text = std::get_if<std::string>(&a.data)) {
    const std::string* const other = std::get_if<std::string>(&b.data);
    return other != nullptr && *text == *other;
  }
  if (a.number() && b.number()) {
    if (a.integral() && b.integral()) return a.integer() == b.integer();
    return a.is<Value::Big>() || b.is<Value::Big>() ? compare_numbers(a, b) == 0 : a.real() == b.real();
  }
  if (a.data.index() != b.data.index()) return false;
  if (a.is<Value::None>()) return true;
  if (a.is<Value::Function>()) return a.as<Value::Function>().call == b.as<Value::Function>().call;
  if (a.is<Value::Object>()) return a.as<Value::Object>().object == b.as<Value::Object>().object;
  if (a.is<Value::Dict>())
    return same_entries(a.as<Value::Dict>().entries->dict, b.as<Value::Dict>().entries->dict);
  if (a.is<Value::Set>())
    return same_entries(a.as<Value::Set>().entries->dict, b.as<Value::Set>().entries->dict);
  return std::equal(a.values().begin(), a.values().end(), b.values().begin(), b.values().end(), equal);
}

}  // namespace doppel
