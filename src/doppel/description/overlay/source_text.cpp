#include "doppel/description/overlay/detail/source_text.h"

#include <algorithm>

#include "doppel/base/core/read_file.h"
#include "doppel/description/overlay/detail/overlay.h"

namespace doppel::overlay_detail {
namespace {

constexpr std::size_t kMaxSourceBytes = std::size_t{64} << 20;
constexpr auto npos = std::string::npos;

bool ends_name(char c) {
  return kBlanks.find(c) != npos || c == '=' || c == '>' || c == '/';
}

}  // namespace

SourceText::SourceText(const std::filesystem::path& file) : text_(read_file(file.string(), kMaxSourceBytes)) {
  lines_.push_back(text_.starts_with("\xef\xbb\xbf") ? 3 : 0);
  for (std::size_t at = text_.find('\n'); at != npos; at = text_.find('\n', at + 1)) lines_.push_back(at + 1);
}

std::optional<std::size_t> SourceText::offset(int line, int column) const {
  if (line < 1 || column < 1 || static_cast<std::size_t>(line) > lines_.size()) return {};
  const std::size_t at = lines_[static_cast<std::size_t>(line - 1)] + static_cast<std::size_t>(column - 1);
  if (at >= text_.size()) return {};
  return at;
}

// Behind the '>' of the tag that begins at `at`; a '>' within quotes does not count.
std::size_t SourceText::tag_end(std::size_t at) const {
  while (at < text_.size() && text_[at] != '>') {
    if (text_[at] == '"' || text_[at] == '\'') at = text_.find(text_[at], at + 1);
    if (at == npos) return npos;
    ++at;
  }
  return at < text_.size() ? at + 1 : npos;
}

std::optional<SourceText::Tag> SourceText::tag(std::size_t at, std::string_view name) const {
  if (text_.compare(at, 1, "<") != 0 || text_.compare(at + 1, name.size(), name) != 0) return {};
  const std::size_t behind = at + 1 + name.size();
  if (behind >= text_.size() || !ends_name(text_[behind])) return {};
  const std::size_t end = tag_end(at);
  if (end == npos) return {};
  Tag out;
  out.range = {at, end};
  out.closed = text_[end - 2] == '/';
  const std::size_t last = text_.find_last_not_of(kBlanks, end - (out.closed ? 3 : 2));
  out.attributes_end = last + 1;
  return out;
}

std::optional<SourceText::Range> SourceText::element(std::size_t at, std::string_view name) const {
  const auto first = tag(at, name);
  if (!first) return {};
  if (first->closed) return first->range;
  int depth = 1;
  for (std::size_t next = text_.find('<', first->range.end); next != npos; next = text_.find('<', next)) {
    const std::string_view rest = std::string_view(text_).substr(next);
    std::size_t end = npos;
    if (rest.starts_with("<!--")) {
      end = text_.find("-->", next);
      end = end == npos ? npos : end + 3;
    } else if (rest.starts_with("<![CDATA[")) {
      end = text_.find("]]>", next);
      end = end == npos ? npos : end + 3;
    } else if (rest.starts_with("<?")) {
      end = text_.find("?>", next);
      end = end == npos ? npos : end + 2;
    } else {
      end = tag_end(next);
      if (end == npos) return {};
      if (rest.starts_with("</")) {
        --depth;
      } else if (text_[end - 2] != '/') {
        ++depth;
      }
    }
    if (end == npos) return {};
    if (depth == 0) return Range{at, end};
    next = end;
  }
  return {};
}

std::optional<SourceText::Range> SourceText::value(std::size_t at, std::string_view name) const {
  if (text_.compare(at, name.size(), name) != 0) return {};
  std::size_t next = text_.find_first_not_of(kBlanks, at + name.size());
  if (next == npos || text_[next] != '=') return {};
  next = text_.find_first_not_of(kBlanks, next + 1);
  if (next == npos || (text_[next] != '"' && text_[next] != '\'')) return {};
  const std::size_t end = text_.find(text_[next], next + 1);
  if (end == npos) return {};
  return Range{next + 1, end};
}

std::optional<std::size_t> SourceText::attribute(const Tag& tag, std::string_view name) const {
  for (std::size_t at = tag.range.begin + 1; at < tag.range.end; ++at) {
    if (text_[at] == '"' || text_[at] == '\'') {
      at = text_.find(text_[at], at + 1);
      if (at == npos) return {};
      continue;
    }
    if (kBlanks.find(text_[at - 1]) == npos || text_.compare(at, name.size(), name) != 0) continue;
    const std::size_t behind = at + name.size();
    if (behind < tag.range.end && ends_name(text_[behind])) return at;
  }
  return {};
}

std::string SourceText::indentation(std::size_t at) const {
  const std::size_t begin = text_.rfind('\n', at == 0 ? 0 : at - 1);
  const std::size_t line = begin == npos ? 0 : begin + 1;
  const std::size_t end = std::min(text_.find_first_not_of(" \t", line), text_.size());
  return text_.substr(line, std::min(end, at) - line);
}

SourceText::Range SourceText::whole_lines(const Range& range) const {
  std::size_t begin = range.begin, end = range.end;
  while (begin > 0 && (text_[begin - 1] == ' ' || text_[begin - 1] == '\t')) --begin;
  while (end < text_.size() && (text_[end] == ' ' || text_[end] == '\t' || text_[end] == '\r')) ++end;
  if ((begin != 0 && text_[begin - 1] != '\n') || (end < text_.size() && text_[end] != '\n')) return range;
  return {begin, std::min(end + 1, text_.size())};
}

std::string SourceText::edited() const {
  std::vector<Edit> sorted = edits_;
  std::stable_sort(sorted.begin(), sorted.end(),
                   [](const Edit& a, const Edit& b) { return a.range.begin < b.range.begin; });
  std::string out;
  std::size_t at = 0;
  for (const Edit& edit : sorted) {
    if (edit.range.begin < at) continue;  // within an element that is removed as a whole
    out += text_.substr(at, edit.range.begin - at) + edit.with;
    at = edit.range.end;
  }
  return out + text_.substr(at);
}

}  // namespace doppel::overlay_detail
