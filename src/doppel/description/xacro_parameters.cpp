// The parameters of a macro, as its params attribute lists them: "a b:=1 c:='x y' d:=^ e:=^|2 *block
// **blocks".
#include <fmt/format.h>

#include "doppel/description/xacro_detail.h"

namespace doppel::xacro {
namespace {

bool blank(char c) {
  return c == ' ' || c == '\t' || c == '\n' || c == '\r';
}

class Parameters {
 public:
  Parameters(std::string_view text, const TreePlace& where) : text_(text), where_(where) {}

  std::vector<Macro::Parameter> all() {
    std::vector<Macro::Parameter> out;
    for (skip(); at_ < text_.size(); skip()) out.push_back(next());
    return out;
  }

 private:
  void skip() {
    while (at_ < text_.size() && blank(text_[at_])) ++at_;
  }
  [[noreturn]] void fail(const std::string& what) const {
    throw InputError("xacro.parameters", locate(where_), what);
  }
  [[nodiscard]] bool ends(std::size_t at) const { return at >= text_.size() || blank(text_[at]); }

  Macro::Parameter next() {
    Macro::Parameter out;
    const std::size_t begin = at_;
    while (!ends(at_) && text_[at_] != '=' && text_[at_] != ':') ++at_;
    out.name = text_.substr(begin, at_ - begin);
    const std::size_t after_name = at_;
    skip();
    if (text_.substr(at_, 1) == ":" && text_.substr(at_, 2) != ":=")
      fail(fmt::format("':' of the parameter '{}' is followed by something else than '='", out.name));
    const std::size_t sign = text_.substr(at_, 2) == ":=" ? 2 : text_.substr(at_, 1) == "=" ? 1 : 0;
    if (out.name.empty()) fail(fmt::format("'{}' is no list of parameters", text_));
    if (sign == 0) {
      at_ = after_name;
      return out;
    }
    at_ += sign;
    const std::size_t from = at_;
    skip();
    if (at_ >= text_.size()) at_ = from;
    if (text_.substr(at_, 1) == "^") {
      out.forwards = true;
      at_ += text_.substr(at_, 2) == "^|" ? 2 : 1;
    }
    const std::size_t end = default_end(out.name);
    if (end > at_) out.fallback = text_.substr(at_, end - at_);
    at_ = end;
    return out;
  }

  // ${...} and $(...) up to a bracket that a blank follows; else quoted and plain pieces.
  std::size_t default_end(std::string_view name) {
    if (text_.substr(at_, 2) == "${" || text_.substr(at_, 2) == "$(") {
      const char close = text_[at_ + 1] == '{' ? '}' : ')';
      for (std::size_t i = at_ + 2; i < text_.size() && text_[i] != '\n'; ++i) {
        if (text_[i] == close && ends(i + 1)) return i + 1;
      }
    }
    std::size_t i = at_;
    while (!ends(i)) {
      if (text_[i] != '\'' && text_[i] != '"') {
        ++i;
        continue;
      }
      const std::size_t quote = text_.find(text_[i], i + 1);
      if (quote == std::string_view::npos)
        fail(fmt::format("the default of '{}' has no closing quote", name));
      i = quote + 1;
    }
    return i;
  }

  std::string_view text_;
  const TreePlace& where_;
  std::size_t at_ = 0;
};

}  // namespace

std::vector<Macro::Parameter> parse_parameters(std::string_view text, const TreePlace& where) {
  return Parameters(text, where).all();
}

}  // namespace doppel::xacro
