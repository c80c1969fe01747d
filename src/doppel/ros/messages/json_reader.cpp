// From JSON (RFC 8259) to CDR.

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "doppel/ros/messages/detail/text_tree.h"

namespace doppel {
namespace {

using messages_detail::TextKind;
using messages_detail::TextPlace;
using messages_detail::TextTree;

// The library's parser reports values without their places, and numbers without their digits. Between the
// tokens that it reports there are only white space, commas and colons, so each is found in the text again.
class JsonEvents {
 public:
  JsonEvents(std::string_view text, TextTree& tree) : text_(text), tree_(tree) {}

  std::string why;  // of a text that is not JSON

  bool null() {
    find_token();
    tree_.add({.place = place_});
    return true;
  }
  bool boolean(bool) { return literal(); }
  bool number_integer(std::int64_t) { return literal(); }
  bool number_unsigned(std::uint64_t) { return literal(); }
  bool number_float(double, const std::string&) { return literal(); }
  bool string(const std::string& value) {
    find_token();
    tree_.add_scalar(value, true, place_);
    return true;
  }
  bool key(const std::string& name) { return string(name); }
  bool binary(const nlohmann::json::binary_t&) { return false; }  // is in no text
  bool start_object(std::size_t) { return open(TextKind::map); }
  bool end_object() { return close(); }
  bool start_array(std::size_t) { return open(TextKind::list); }
  bool end_array() { return close(); }

  bool parse_error(std::size_t bytes_read, const std::string&, const nlohmann::json::exception& problem) {
    // The text behind "last read" is omitted: it may not be UTF-8, and the answer must be.
    std::string_view reason = problem.what();
    reason = reason.substr(0, reason.find("; last read"));
    for (const std::string_view head : {"] ", " - "}) {
      if (const std::size_t found = reason.find(head); found != std::string_view::npos)
        reason.remove_prefix(found + head.size());
    }
    refuse(bytes_read > 0 ? bytes_read - 1 : 0, reason);
    return false;
  }
  void refuse(std::size_t offset, std::string_view reason) {
    const std::string_view before = text_.substr(0, offset);
    const auto line = 1 + std::ranges::count(before, '\n');
    const std::size_t column = before.size() - (before.rfind('\n') + 1) + 1;
    why = fmt::format("{}:{}: not JSON: {}", line, column, reason);
  }

 private:
  bool literal() {
    const std::string_view token = find_token();
    tree_.add_scalar(token, false, place_);
    return true;
  }
  bool open(TextKind kind) {
    find_token();
    tree_.open(kind, place_);
    return true;
  }
  bool close() {
    find_token();
    tree_.close();
    return true;
  }

  std::string_view find_token() {
    const std::size_t begin = text_.find_first_not_of(" \t\r\n,:\xEF\xBB\xBF", end_);
    for (; end_ < begin; ++end_) {
      if (text_[end_] != '\n') continue;
      ++place_.line;
      line_begin_ = end_ + 1;
    }
    place_.column = begin - line_begin_ + 1;
    ++end_;
    if (text_[begin] == '"') {
      while (text_[end_] != '"') end_ += text_[end_] == '\\' ? 2 : 1;
      ++end_;
    } else if (std::string_view("{}[]").find(text_[begin]) == std::string_view::npos) {
      end_ = std::min(text_.find_first_of(" \t\r\n,]}", end_), text_.size());
    }
    return text_.substr(begin, end_ - begin);
  }

  std::string_view text_;
  TextTree& tree_;
  std::size_t end_ = 0;  // of the last token
  std::size_t line_begin_ = 0;
  TextPlace place_;  // of the last token
};

}  // namespace

Status json_to_cdr(const TypeDescription& type, std::string_view json, Bytes& out) {
  TextTree tree;
  JsonEvents events(json, tree);
  // The library takes it for the end of the text.
  if (const std::size_t zero = json.find('\0'); zero != std::string_view::npos) {
    events.refuse(zero, "a zero byte");
    return Status::refused(events.why);
  }
  if (!nlohmann::json::sax_parse(json, &events)) return Status::refused(events.why);
  return messages_detail::tree_to_cdr(type, tree, out);
}

}  // namespace doppel
