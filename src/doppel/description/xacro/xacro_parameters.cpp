// The parameters of a macro, as its params attribute lists them: "a b:=1 c:='x y' d:=^
// e:=^|2 *block **blocks".
#include <fmt/format.h>

#include "doppel/description/xacro/detail/xacro.h"

namespace doppel::xacro {
namespace {

bool separates_parameters(char c) {
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
    while (at_ < text_.size() && separates_parameters(text_[at_])) ++at_;
  }
  [[noreturn]] void fail(const std::string& what) const {
    throw InputError("xacro.parameters", locate(where_), what);
  }
  [[nodiscard]] bool ends(std::size_t at) const {
    return at >= text_.size() || separates_parameters(text_[at]);
  }

  Macro::Parameter next() {
    Macro::Parameter out;
    const std::size_t begin = at_;
    while (!ends(at_) && text_[at_] != '=' && text_[at_] != ':') ++at_;
    out.name = text_.substr(begin, at_ - begin);
    const std::size_t after_name = at_;
    skip();
    if (text_.substr(at_, 1) == ":" && text_.substr(at_, 2) != ":=")
      fail(fmt::format("':' of the parameter '{}' is not followed by '='", out.name));
    const std::size_t sign = text_.substr(at_, 2) == ":=" ? 2 : text_.substr(at_, 1) == "=" ? 1 : 0;
    if (out.name.empty()) fail(fmt::format("'{}' is not a list of parameters", text_));
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

  // ${...} and $(...) up to a bracket that a blank follows; else quoted and plain pieces. ros/xacro finds the
  // end by a regular expression that backtracks: a quoted piece ends at the first quote from which the rest
  // can be read to its end, so that 'a'b' is one piece.
  std::size_t default_end(std::string_view name) {
    if (text_.substr(at_, 2) == "${" || text_.substr(at_, 2) == "$(") {
      const char close = text_[at_ + 1] == '{' ? '}' : ')';
      for (std::size_t i = at_ + 2; i < text_.size() && text_[i] != '\n'; ++i) {
        if (text_[i] == close && ends(i + 1)) return i + 1;
      }
    }
    if (ends_.empty()) find_ends();
    if (ends_[at_] == kNone) fail(fmt::format("the default of '{}' has no closing quote", name));
    return ends_[at_];
  }

  // The end of the pieces that begin at each position; from the last to the first, to compute each once.
  void find_ends() {
    ends_.assign(text_.size() + 1, kNone);
    ends_[text_.size()] = text_.size();
    std::size_t single = kNone, twice = kNone;  // the ends that follow from the next closing quote
    for (std::size_t i = text_.size(); i-- > 0;) {
      const char c = text_[i];
      if (c == '\n') single = twice = kNone;
      if (separates_parameters(c)) {
        ends_[i] = i;
      } else if (c != '\'' && c != '"') {
        ends_[i] = ends_[i + 1];
      } else {
        std::size_t& next = c == '\'' ? single : twice;
        ends_[i] = next;
        if (ends_[i + 1] != kNone) next = ends_[i + 1];
      }
    }
  }

  static constexpr std::size_t kNone = std::string_view::npos;
  std::vector<std::size_t> ends_;
  std::string_view text_;
  const TreePlace& where_;
  std::size_t at_ = 0;
};

}  // namespace

std::vector<Macro::Parameter> parse_parameters(std::string_view text, const TreePlace& where) {
  return Parameters(text, where).all();
}

}  // namespace doppel::xacro
