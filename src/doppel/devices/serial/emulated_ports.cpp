// Emulated ports are no devices of the system: the program behind each of them leaves a file in the run-time
// folder, named by its process, with the path and the product in two lines.
#include <fmt/format.h>
#include <signal.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <fstream>
#include <sstream>
#include <system_error>

#include "doppel/base/core/read_file.h"
#include "doppel/base/core/user_folders.h"
#include "doppel/devices/serial/serial_ports.h"

namespace doppel {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kSuffix = ".port";
constexpr std::size_t kMaxNoteBytes = 8192;  // two lines

bool runs(const fs::path& note) {
  const std::string name = note.filename();
  int pid = 0;
  const auto [end, error] = std::from_chars(name.data(), name.data() + name.size(), pid);
  return error == std::errc() && *end == '-' && pid > 0 && (::kill(pid, 0) == 0 || errno == EPERM);
}

}  // namespace

std::vector<PortInfo> emulated_ports() {
  std::vector<PortInfo> out;
  const fs::path folder = runtime_folder();
  if (!private_folder_problem(folder).empty()) return out;
  std::error_code failed;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder, failed)) {
    if (entry.path().extension() != kSuffix) continue;
    std::istringstream in(read_content(entry.path(), kMaxNoteBytes).bytes);
    PortInfo port;
    std::error_code missing;
    if (runs(entry.path()) && std::getline(in, port.path) && std::getline(in, port.product) &&
        fs::exists(port.path, missing)) {
      out.push_back(std::move(port));
    } else {
      fs::remove(entry.path(), missing);
    }
  }
  std::ranges::sort(out, {}, &PortInfo::path);
  return out;
}

EmulatedPortNote::EmulatedPortNote(const std::string& path, const std::string& product) {
  const fs::path folder = runtime_folder();
  if (!make_private_folder(folder).empty()) return;
  const fs::path file =
      folder / fmt::format("{}-{}{}", ::getpid(), fs::path(path).filename().string(), kSuffix);
  const fs::path draft = file.string() + ".new";  // renamed when complete, so that readers never get a part
  std::ofstream(draft) << path << '\n' << product << '\n';
  std::error_code failed;
  fs::rename(draft, file, failed);
  if (!failed) file_ = file;
}

EmulatedPortNote::~EmulatedPortNote() {
  std::error_code ignored;
  if (!file_.empty()) fs::remove(file_, ignored);
}

}  // namespace doppel
