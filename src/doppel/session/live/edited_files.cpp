#include "doppel/session/live/detail/edited_files.h"

#include <fmt/format.h>

#include "doppel/base/core/diagnostic.h"
#include "doppel/base/core/read_file.h"

namespace doppel {
namespace {

constexpr std::size_t kMaxEditedBytes = std::size_t{1} << 30;  // of a mesh

}  // namespace

doppel_msgs::msg::EditedFiles edited_files(const FileVersions& before, const FileVersions& present) {
  doppel_msgs::msg::EditedFiles out;
  for (const auto& [file, version] : present) {
    if (const auto found = before.find(file); found != before.end() && found->second == version) continue;
    const FileContent content = read_content(file, kMaxEditedBytes);
    if (FileVersion::of(file) != version) {
      throw InputError(kEditedMeanwhile, make_location(file.string()),
                       fmt::format("'{}' was saved again while it was read", file.string()));
    }
    const bool removed = version == FileVersion{};
    // Without its bytes the journal would repeat another edit than this one.
    if (!removed && !content.was_read()) {
      throw InputError("file.unreadable", make_location(file.string()),
                       fmt::format("'{}' cannot be read: {}", file.string(), content.problem));
    }
    doppel_msgs::msg::EditedFile& edited = out.files.emplace_back();
    edited.path = std::filesystem::absolute(file).lexically_normal().string();
    edited.removed = removed;
    edited.data.assign(content.bytes.begin(), content.bytes.end());
  }
  return out;
}

}  // namespace doppel
