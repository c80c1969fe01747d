#include "doppel/scenario/resolve/side_files.h"

#include <fmt/format.h>

#include <algorithm>

#include "doppel/base/core/read_file.h"

namespace doppel {

namespace fs = std::filesystem;

SourceLocation SideFile::place(std::size_t at) const {
  const auto next = std::upper_bound(line_starts.begin(), line_starts.end(), at);
  const std::size_t start = next == line_starts.begin() ? 0 : *std::prev(next);
  return make_location(path.string(), static_cast<int>(next - line_starts.begin()),
                       static_cast<int>(at - start) + 1);
}

SideFile read_side_file(const fs::path& file) {
  SideFile out;
  out.path = file;
  try {
    out.text = read_file(file.string(), kMaxSideFileBytes);
  } catch (const InputError& error) {
    throw InputError("audit.skipped", make_location(file.string()), error.diagnostics().front().message,
                     "nothing, if it is not needed; otherwise make it a regular file of usual size");
  }
  out.line_starts.push_back(0);
  for (std::size_t at = out.text.find('\n'); at != std::string::npos; at = out.text.find('\n', at + 1))
    out.line_starts.push_back(at + 1);
  return out;
}

SideFolder list_side_folder(const fs::path& folder) {
  SideFolder out;
  std::error_code failed;
  fs::directory_iterator entry(folder, failed);
  for (const fs::directory_iterator end; !failed && entry != end; entry.increment(failed)) {
    if (out.entries.size() == kMaxSideEntries) {
      out.complete = false;
      break;
    }
    out.entries.push_back(entry->path());
  }
  std::sort(out.entries.begin(), out.entries.end());
  return out;
}

std::vector<fs::path> side_files_of(const fs::path& folder, const std::vector<std::string>& extensions,
                                    Diagnostics& skipped, std::size_t most) {
  SideFolder all = list_side_folder(folder);
  std::erase_if(all.entries, [&](const fs::path& path) {
    return std::find(extensions.begin(), extensions.end(), path.extension().string()) == extensions.end();
  });
  const std::size_t found = all.entries.size();
  if (!all.complete || found > most) {
    all.entries.resize(std::min(found, most));
    skipped.note(
        "audit.skipped", make_location(folder.string()),
        all.complete
            ? fmt::format("the folder has {} files; only the first {} are read", found, all.entries.size())
            : fmt::format("the folder has more than {} entries; only the first ones are read",
                          kMaxSideEntries),
        "nothing, if the others do not concern this robot");
  }
  return std::move(all.entries);
}

}  // namespace doppel
