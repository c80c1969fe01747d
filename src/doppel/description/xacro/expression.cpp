#include "doppel/description/xacro/detail/expression.h"

#include <fmt/format.h>

#include <algorithm>
#include <memory>

#include "doppel/base/core/names.h"
#include "doppel/description/xacro/detail/expression_operators.h"
#include "doppel/description/xacro/detail/expression_parser.h"

namespace doppel {

std::string excerpt(std::string_view expression) {
  constexpr std::size_t kMaxLength = 200;
  if (expression.size() <= kMaxLength) return std::string(expression);
  std::size_t end = kMaxLength;
  while (end > 0 && (static_cast<unsigned char>(expression[end]) & 0xC0) == 0x80) --end;  // whole characters
  return std::string(expression.substr(0, end)) + "...";
}

namespace {

using Kind = Expression::Kind;
constexpr std::ptrdiff_t kStack = std::ptrdiff_t{3} << 20;  // of the 8 MB that threads usually have

thread_local const char* stack_begin = nullptr;

bool used_up(const char* begin) {
  const auto used = begin - static_cast<const char*>(__builtin_frame_address(0));
  return used > kStack || used < -kStack;
}

using BoundNames = std::vector<std::pair<std::string_view, Value>>;

// Names of a comprehension or lambda, looked up before the enclosing scope.
class InnerScope : public NameScope {
 public:
  explicit InnerScope(NameScope& outer) : outer_(outer) {}
  const Value* find(std::string_view name) override {
    for (auto at = names_.rbegin(); at != names_.rend(); ++at) {
      if (at->first == name) return &at->second;
    }
    return outer_.find(name);
  }
  [[nodiscard]] std::vector<std::string> names() const override {
    std::vector<std::string> out = outer_.names();
    for (const auto& [name, value] : names_) out.emplace_back(name);
    return out;
  }
  void set(std::string_view name, Value value) {
    for (auto& [known, old] : names_) {
      if (known == name) {
        old = std::move(value);
        return;
      }
    }
    names_.emplace_back(name, std::move(value));
  }
  // For a lambda that outlives this scope: its names, behind those of the enclosing scopes.
  void copy_names(BoundNames& out) const {
    if (const auto* inner = dynamic_cast<const InnerScope*>(&outer_)) inner->copy_names(out);
    out.insert(out.end(), names_.begin(), names_.end());
  }
  [[nodiscard]] NameScope& outermost() {
    auto* inner = dynamic_cast<InnerScope*>(&outer_);
    return inner != nullptr ? inner->outermost() : outer_;
  }

 private:
  NameScope& outer_;
  BoundNames names_;
};

void bind(const ExpressionTarget& target, const Value& value, InnerScope& scope) {
  if (target.parts.empty()) return scope.set(target.name, value);
  const ValueList items = items_of(value);
  const auto star = std::find_if(target.parts.begin(), target.parts.end(),
                                 [](const ExpressionTarget& part) { return part.starred; });
  const bool starred = star != target.parts.end();
  const std::size_t wanted = target.parts.size() - (starred ? 1 : 0);
  if (starred ? items.size() < wanted : items.size() != wanted) {
    throw ExpressionError(fmt::format("{} cannot be unpacked into {} names", value.brief(), wanted));
  }
  std::size_t next = 0;
  for (auto part = target.parts.begin(); part != target.parts.end(); ++part) {
    if (part != star) {
      bind(*part, items[next++], scope);
      continue;
    }
    const auto from = items.begin() + static_cast<std::ptrdiff_t>(next);
    const std::size_t many = items.size() - wanted;
    scope.set(part->name, Value::list(ValueList(from, from + static_cast<std::ptrdiff_t>(many))));
    next += many;
  }
}

class Evaluator {
 public:
  // `tree`: kept alive by lambdas if there is no other owner.
  Evaluator(NameScope& scope, std::int64_t& budget, std::shared_ptr<const ExpressionStore> tree = nullptr)
      : scope_(scope), budget_(budget), tree_(std::move(tree)) {}

  Value value(const Expression& e) {
    switch (e.kind) {
      case Kind::constant:
      case Kind::name:
      case Kind::index:
      case Kind::attribute:
        return Operand(*this, e).take();
      default:
        enter();
        return made(e);
    }
  }

 private:
  // The result of an expression: a reference where the value is stored already, else a value of its own.
  class Operand {
   public:
    Operand(Evaluator& evaluator, const Expression& e) { at_ = evaluator.evaluated(e, &own_); }
    ~Operand() {
      if (own()) own_.~Value();
    }
    Operand(const Operand&) = delete;
    Operand& operator=(const Operand&) = delete;
    const Value& operator*() const { return *at_; }
    const Value* operator->() const { return at_; }
    [[nodiscard]] bool own() const { return at_ == &own_; }
    Value take() { return own() ? std::move(own_) : Value(*at_); }

   private:
    union {
      Value own_;  // constructed in place by evaluated()
    };
    const Value* at_ = nullptr;
  };

  // A stored value that is valid until the evaluation ends, or one that is constructed in `room`.
  const Value* evaluated(const Expression& e, Value* room) {
    enter();
    switch (e.kind) {
      case Kind::constant:
        spend_on(*e.value);
        return e.value;
      case Kind::name:
        return name(e);
      case Kind::index: {
        const Operand object(*this, *e.parts[0]);
        if (object->is<std::string>())
          spend(static_cast<std::int64_t>(object->as<std::string>().size() / 16));
        const Operand key(*this, *e.parts[1]);
        const Value* const found = find_index(*object, *key);
        if (found != nullptr && !object.own()) return found;
        return new (room) Value(found != nullptr ? *found : index_value(*object, *key));
      }
      case Kind::attribute: {
        const Operand object(*this, *e.parts[0]);
        const Value* const found = find_attribute(*object, *e.value);
        if (found != nullptr && !object.own()) return found;
        return new (room) Value(found != nullptr ? *found : get_attribute(*object, e.text));
      }
      default:
        return new (room) Value(made(e));
    }
  }

  // For the kinds that create a value.
  Value made(const Expression& e) {
    switch (e.kind) {
      case Kind::list:
        return charged(Value::list(values(e.parts)));
      case Kind::tuple:
        return charged(Value::tuple(values(e.parts)));
      case Kind::set:
        return charged(Value::set(values(e.parts)));
      case Kind::dict:
        return dict(e);
      case Kind::unary:
        return unary_operation(e.op, *Operand(*this, *e.parts[0]));
      case Kind::binary:
        return binary(e);
      case Kind::compare:
        return comparison(e);
      case Kind::logic_and:
      case Kind::logic_or: {
        Operand left(*this, *e.parts[0]);
        return left->truth() == (e.kind == Kind::logic_and) ? value(*e.parts[1]) : left.take();
      }
      case Kind::logic_not:
        return Value(!Operand(*this, *e.parts[0])->truth());
      case Kind::ternary:
        return value(*e.parts[Operand(*this, *e.parts[0])->truth() ? 1 : 2]);
      case Kind::slice: {
        const Operand object(*this, *e.parts[0]);
        const Operand from(*this, *e.parts[1]), to(*this, *e.parts[2]);
        spend(object->weight() / 4);
        return slice_value(*object, *from, *to, *Operand(*this, *e.parts[3]));
      }
      case Kind::call:
        return call(e);
      case Kind::comprehension:
        return comprehension(e);
      case Kind::lambda:
        return lambda(e);
      case Kind::format:
        return format(e);
      default:
        throw ExpressionError("unexpected '*'");
    }
  }

  void enter() {
    spend(1);
    if (used_up(stack_begin_)) throw ExpressionError("the evaluation is nested too deeply", "xacro.too_deep");
  }
  void spend(std::int64_t steps) {
    if ((budget_ -= steps) < 0)
      throw ExpressionError("the evaluation takes too many steps", "xacro.too_much");
  }
  // Created and traversed values cost steps as well, which bounds time and memory: one for an item, or for as
  // many characters as are copied in the same time.
  void spend_on(const Value& touched) {
    if (touched.number()) return;
    if (touched.is<std::string>())
      spend(static_cast<std::int64_t>(touched.as<std::string>().size() / 64));
    else if (touched.weight() > 1)
      spend(touched.weight() / 4);
  }
  void charge(const Value& made) {
    if (made.is<std::string>())
      spend_on(made);
    else if ((!made.number() || made.is<Value::Big>()) && made.weight() > 1)
      spend(made.weight());
  }
  Value charged(Value made) {
    charge(made);
    return made;
  }

  ValueList values(std::span<const Expression* const> parts) {
    ValueList out;
    out.reserve(parts.size());
    for (const Expression* part : parts) add(*part, out);
    return out;
  }
  void add(const Expression& part, ValueList& out) {
    if (part.kind != Kind::starred) {
      out.push_back(value(part));
      return;
    }
    const ValueList items = items_of(*Operand(*this, *part.parts[0]));
    spend(static_cast<std::int64_t>(items.size()));
    out.insert(out.end(), items.begin(), items.end());
  }

  const Value* name(const Expression& e) {
    if (const Value* known = scope_.find(e.text)) {
      if (known->is<std::string>()) spend_on(*known);
      return known;
    }
    if (e.value != nullptr) return e.value;
    std::vector<std::string> names = scope_.names();
    const auto builtins = builtin_names();
    names.insert(names.end(), builtins.begin(), builtins.end());
    throw ExpressionError(fmt::format("name '{}' is not defined{}", e.text, did_you_mean(e.text, names)),
                          "xacro.undefined_name");
  }

  Value binary(const Expression& e) {
    const Operand left(*this, *e.parts[0]), right(*this, *e.parts[1]);
    Value out = binary_operation(e.op, *left, *right);
    charge(out);
    return out;
  }

  Value dict(const Expression& e) {
    ValueDict out;
    for (std::size_t i = 0; i + 1 < e.parts.size(); i += 2) {
      if (e.parts[i]->kind == Kind::double_starred) {
        const Operand more(*this, *e.parts[i]->parts[0]);
        for (const auto& [key, item] : unpacked(*more)) out.set(key, item);
        continue;
      }
      Value key = value(*e.parts[i]);
      out.set(std::move(key), value(*e.parts[i + 1]));
    }
    return charged(Value::dict(std::move(out)));
  }
  static const ValueDict& unpacked(const Value& more) {
    if (!more.is<Value::Dict>()) throw ExpressionError("'**' needs a dict");
    return more.as<Value::Dict>().entries->dict;
  }

  Value comparison(const Expression& e) {
    const Operand first(*this, *e.parts[0]), second(*this, *e.parts[1]);
    if (!compared(e.rest->operators[0], *first, *second)) return Value(false);
    if (e.parts.size() == 2) return Value(true);
    Value left = *second;
    for (std::size_t i = 1; i < e.rest->operators.size(); ++i) {
      Value right = value(*e.parts[i + 1]);
      if (!compared(e.rest->operators[i], left, right)) return Value(false);
      left = std::move(right);
    }
    return Value(true);
  }
  bool compared(Operator op, const Value& left, const Value& right) {
    spend_on(left);
    spend_on(right);
    return compare_values(op, left, right);
  }

  Value call(const Expression& e) {
    const Expression& callee = *e.parts[0];
    if (callee.kind != Kind::attribute) {
      const Operand function(*this, callee);
      return called(e, *function);
    }
    // A method is called directly, without creating a bound method.
    enter();
    const Operand object(*this, *callee.parts[0]);
    if (const Method method = find_method(*object, callee.text)) {
      ValueList arguments;
      KeywordArguments keywords;
      gather(e, arguments, keywords);
      return charged(method(*object, arguments));
    }
    if (const Value* known = find_attribute(*object, *callee.value)) return called(e, *known);
    return called(e, get_attribute(*object, callee.text));
  }
  Value called(const Expression& e, const Value& function) {
    if (!function.is<Value::Function>())
      throw ExpressionError(fmt::format("{} ({}) cannot be called", function.brief(), function.type_name()));
    ValueList arguments;
    KeywordArguments keywords;
    gather(e, arguments, keywords);
    return charged((*function.as<Value::Function>().call)(arguments, keywords));
  }
  void gather(const Expression& e, ValueList& arguments, KeywordArguments& keywords) {
    arguments.reserve(e.parts.size() - 1);
    const auto names = e.rest->names;
    for (std::size_t i = 0; i + 1 < e.parts.size(); ++i) {
      const Expression& part = *e.parts[i + 1];
      if (part.kind == Kind::double_starred) {
        const Operand more(*this, *part.parts[0]);
        for (const auto& [key, item] : unpacked(*more)) keywords.emplace_back(key.str(), item);
      } else if (!names.empty() && !names[i].empty()) {
        keywords.emplace_back(names[i], value(part));
      } else {
        add(part, arguments);
      }
    }
    for (const Value& argument : arguments) spend_on(argument);
  }

  // One loop of a comprehension inside the other.
  template <class Make>
  void loop(const Expression& e, std::size_t which, InnerScope& names, Evaluator& inside, const Make& make) {
    if (which == e.rest->loops.size()) return make();
    const Loop& at = e.rest->loops[which];
    const Value iterable = which == 0 ? value(*at.items) : inside.value(*at.items);
    spend(iterable.weight());
    const ValueList made = iterable.sequence() ? ValueList() : items_of(iterable);
    for (const Value& item : iterable.sequence() ? iterable.values() : made) {
      spend(1);
      bind(at.target, item, names);
      const bool wanted =
          std::all_of(at.conditions.begin(), at.conditions.end(),
                      [&](const Expression* condition) { return Operand(inside, *condition)->truth(); });
      if (wanted) loop(e, which + 1, names, inside, make);
    }
  }

  Value comprehension(const Expression& e) {
    InnerScope names(scope_);
    Evaluator inside(names, budget_, tree_);
    ValueList out;
    ValueDict entries;
    loop(e, 0, names, inside, [&] {
      Value first = inside.value(*e.parts[0]);
      spend_on(first);
      if (e.form == 'd')
        entries.set(std::move(first), inside.value(*e.parts[1]));
      else
        out.push_back(std::move(first));
    });
    if (e.form == 'd') return charged(Value::dict(std::move(entries)));
    return charged(e.form == 's' ? Value::set(out) : Value::list(std::move(out)));
  }

  // A lambda captures the current values of the enclosing loops' names, and the scope outside of them.
  Value lambda(const Expression& e) {
    BoundNames captured;
    NameScope* outer = &scope_;
    if (auto* inner = dynamic_cast<InnerScope*>(&scope_)) {
      inner->copy_names(captured);
      outer = &inner->outermost();
    }
    outer->retain();
    ValueList defaults;
    for (const Expression* part : e.parts.subspan(1)) defaults.push_back(value(*part));
    return Value::function("<lambda>", [&e, outer, captured, defaults, tree = tree_, &budget = budget_](
                                           ValueList& arguments, KeywordArguments& keywords) {
      const StackGuard guard;  // it may be called outside of an evaluation
      InnerScope scope(*outer);
      for (const auto& [name, kept] : captured) scope.set(name, kept);
      bind_arguments(e.rest->names, defaults, arguments, keywords, scope);
      return Evaluator(scope, budget, tree).value(*e.parts[0]);
    });
  }
  static void bind_arguments(std::span<const std::string_view> names, const ValueList& defaults,
                             const ValueList& arguments, const KeywordArguments& keywords,
                             InnerScope& scope) {
    if (arguments.size() > names.size())
      throw ExpressionError(
          fmt::format("the lambda takes {} arguments, not {}", names.size(), arguments.size()));
    for (std::size_t i = 0; i < names.size(); ++i) {
      const auto given =
          std::find_if(keywords.begin(), keywords.end(), [&](const auto& k) { return k.first == names[i]; });
      if (i < arguments.size())
        scope.set(names[i], arguments[i]);
      else if (given != keywords.end())
        scope.set(names[i], given->second);
      else if (i + defaults.size() >= names.size())
        scope.set(names[i], defaults[i + defaults.size() - names.size()]);
      else
        throw ExpressionError(fmt::format("the lambda needs '{}'", names[i]));
    }
  }

  Value format(const Expression& e) {
    if (e.form != 0) {
      const Operand field(*this, *e.parts[0]);
      if (e.form == 'r') return Value(format_value(Value(field->repr()), e.text));
      return Value(format_value(*field, e.text));
    }
    std::string out;
    for (const Expression* part : e.parts) out += Operand(*this, *part)->str();
    return charged(Value(std::move(out)));
  }

  NameScope& scope_;
  std::int64_t& budget_;
  std::shared_ptr<const ExpressionStore> tree_;
  const char* const stack_begin_ = stack_begin;  // one look-up for all nodes
};

}  // namespace

StackGuard::StackGuard() : outermost_(stack_begin == nullptr) {
  if (outermost_) stack_begin = static_cast<const char*>(__builtin_frame_address(0));
}
StackGuard::~StackGuard() {
  if (outermost_) stack_begin = nullptr;
}
bool StackGuard::exhausted() {
  return stack_begin != nullptr && used_up(stack_begin);
}

Value evaluate(const Expression& expression, NameScope& scope, std::int64_t& budget) {
  const StackGuard guard;
  return Evaluator(scope, budget).value(expression);
}

Value evaluate(std::string_view text, NameScope& scope, std::int64_t& budget) {
  const StackGuard guard;
  const auto store = std::make_shared<ExpressionStore>();
  return Evaluator(scope, budget, store).value(*parse_expression(text, *store));
}

}  // namespace doppel
