#pragma once
// A source file as text with places: the ends of tags, attribute values and elements; and edits that are
// applied together, so that each refers to places of the text as it was read.

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace doppel::overlay_detail {

class SourceText {
 public:
  explicit SourceText(const std::filesystem::path& file);

  struct Range {
    std::size_t begin = 0, end = 0;
  };
  struct Tag {
    Range range;                     // from '<' to behind '>'
    bool closed = false;             // <.../>
    std::size_t attributes_end = 0;  // behind the last attribute, or the name
  };

  [[nodiscard]] std::optional<std::size_t> offset(int line, int column) const;
  // The tag that begins there, with this name; nothing if there is none.
  [[nodiscard]] std::optional<Tag> tag(std::size_t at, std::string_view name) const;
  // The whole element that begins there, to behind its end tag.
  [[nodiscard]] std::optional<Range> element(std::size_t at, std::string_view name) const;
  // The place of the value, within its quotes, of the attribute whose name stands there.
  [[nodiscard]] std::optional<Range> value(std::size_t at, std::string_view name) const;
  // The place of an attribute's name within a tag.
  [[nodiscard]] std::optional<std::size_t> attribute(const Tag& tag, std::string_view name) const;
  [[nodiscard]] std::string_view text(const Range& range) const {
    return std::string_view(text_).substr(range.begin, range.end - range.begin);
  }
  [[nodiscard]] const std::string& text() const { return text_; }
  [[nodiscard]] std::string indentation(std::size_t at) const;  // of the line
  [[nodiscard]] Range whole_lines(const Range& range) const;    // with its lines, if nothing else is on them

  void replace(const Range& range, std::string with) { edits_.push_back({range, std::move(with)}); }
  [[nodiscard]] std::string edited() const;

 private:
  struct Edit {
    Range range;
    std::string with;
  };
  std::size_t tag_end(std::size_t at) const;

  std::string text_;
  std::vector<std::size_t> lines_;
  std::vector<Edit> edits_;
};

}  // namespace doppel::overlay_detail
