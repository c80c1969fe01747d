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
    const std::string bytes = read_content(file, kMaxEditedBytes).bytes;
    if (FileVersion::of(file) != version) {
      throw InputError(kEditedMeanwhile, make_location(file.string()),
                       fmt::format("'{}' was saved again while it was read", file.string()));
    }
    doppel_msgs::msg::EditedFile& edited = out.files.emplace_back();
    edited.path = std::filesystem::absolute(file).lexically_normal().string();
    edited.removed = version == FileVersion{};
    edited.data.assign(bytes.begin(), bytes.end());
  }
  return out;
}

}  // namespace doppel
