#include "doppel/scenario/launch/detail/launch_reader.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <signal.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <system_error>

#include "doppel/base/core/diagnostic.h"
#include "doppel/base/core/installation.h"
#include "doppel/base/core/output_file.h"
#include "doppel/base/packages/package_folder.h"
#include "doppel/description/urdf/load.h"
#include "doppel/description/xacro/xacro.h"
#include "doppel/scenario/launch/detail/installed_view.h"
#include "doppel/scenario/launch/detail/launch_json.h"

namespace doppel {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

// Requests and results are lines, which have descriptions of robots.
constexpr std::size_t kMaxLine = std::size_t{256} << 20U, kMaxSurveyedLine = std::size_t{16} << 20U;
constexpr int kMaxRequests = 5000;                            // of launch files that are surveyed
constexpr std::size_t kMaxWritten = std::size_t{256} << 20U;  // bytes of the files that launch files make

[[noreturn]] void refuse_without_python(const std::string& reason) {
  throw InputError("launch.python", {},
                   fmt::format("launch files in Python need python3, which cannot be started: {}", reason),
                   "apt-get install python3 python3-yaml, or start the robot itself: doppel up TARGET");
}

// Without SIGPIPE, which would end this program where the reader has closed its end.
ssize_t write_quietly(int fd, const char* data, std::size_t size) {
  sigset_t pipes, before;
  sigemptyset(&pipes);
  sigaddset(&pipes, SIGPIPE);
  pthread_sigmask(SIG_BLOCK, &pipes, &before);
  const ssize_t written = write(fd, data, size);
  const int error = errno;
  if (written < 0 && error == EPIPE && sigismember(&before, SIGPIPE) == 0) {
    const timespec now{};
    sigtimedwait(&pipes, nullptr, &now);
  }
  pthread_sigmask(SIG_SETMASK, &before, nullptr);
  errno = error;
  return written;
}

// Packages that xacro's own $(find ...) would find in another layout than that of their installation.
void add_views(const fs::path& file, PackageResolver& resolver, const fs::path& folder) {
  const fs::path package = package_around(fs::weakly_canonical(file));
  if (package.empty()) return;
  const std::string name = package_name(package);
  const fs::path view = installed_view(package, name, folder);
  if (!view.empty()) resolver.add_package(name, view);
}

}  // namespace

LaunchReader::LaunchReader(std::vector<std::string> words, PackageResolver& resolver, const fs::path& folder,
                           const ReaderBounds* bounds)
    : resolver_(resolver), folder_(folder) {
  if (bounds != nullptr) bounds_ = *bounds;
  // The system's Python has PyYAML and the packages of ROS; one of an environment in PATH has its own.
  const bool of_system = is_program("/usr/bin/python3");
  const fs::path reader = data_folder() / "python" / "launch_reader" / "read_launch_file.py";
  ChildStart start{.words = {of_system ? "/usr/bin/python3" : "python3", "-B", reader.string()},
                   .environment = {{"DOPPEL_LAUNCH_PIPES", "3,4"}, {"DOPPEL_LAUNCH_FOLDER", folder.string()}},
                   .converses = true,
                   .own_group = bounds != nullptr,
                   .confined = bounds != nullptr};
  start.words.insert(start.words.end(), words.begin(), words.end());
  try {
    python_.emplace(start);
  } catch (const std::system_error& error) {
    refuse_without_python(error.code().message());
  }
  fcntl(python_->answers(), F_SETFL, O_NONBLOCK);
}

bool LaunchReader::wait_for(int fd, short events) {
  while (true) {
    int timeout = -1;
    if (bounds_) {
      const auto left =
          std::chrono::ceil<std::chrono::milliseconds>(bounds_->end - std::chrono::steady_clock::now());
      timeout = static_cast<int>(std::max<std::int64_t>(0, left.count()));
    }
    pollfd one{fd, events, 0};
    const int ready = poll(&one, 1, timeout);
    if (ready > 0) return true;
    if (ready == 0) late_ = true;
    if (ready == 0 || errno != EINTR) return false;
  }
}

// One line of requests; empty: their end.
std::string LaunchReader::line() {
  while (true) {
    const std::size_t end = buffer_.find('\n', searched_);
    if (end != std::string::npos) {
      std::string line = buffer_.substr(0, end);
      buffer_.erase(0, end + 1);
      searched_ = 0;
      return line;
    }
    searched_ = buffer_.size();
    if (!wait_for(python_->requests(), POLLIN)) return "";
    std::array<char, 65536> part{};
    const ssize_t size = read(python_->requests(), part.data(), part.size());
    if (size < 0 && errno == EINTR) continue;
    if (size <= 0) return "";
    if (const std::size_t max_line = bounds_ ? kMaxSurveyedLine : kMaxLine; buffer_.size() > max_line) {
      throw InputError("launch.unreadable", {},
                       fmt::format("the records of the launch file are larger than {} MB", max_line >> 20U));
    }
    buffer_.append(part.data(), static_cast<std::size_t>(size));
  }
}

bool LaunchReader::send(const std::string& text) {
  std::size_t written = 0;
  while (written < text.size()) {
    const ssize_t size = write_quietly(python_->answers(), text.data() + written, text.size() - written);
    if (size < 0 && errno == EAGAIN && wait_for(python_->answers(), POLLOUT)) continue;
    if (size < 0 && errno == EINTR) continue;
    if (size <= 0) return false;
    written += static_cast<std::size_t>(size);
  }
  return true;
}

Json LaunchReader::answer_xacro(const Json& request) {
  const fs::path file = request.at("xacro").get<std::string>();
  try {
    XacroArguments arguments;
    for (const Json& pair : request.at("arguments"))
      arguments.emplace_back(pair.at(0).get<std::string>(), pair.at(1).get<std::string>());
    resolver_.add_context(file);
    add_views(file, resolver_, folder_);
    Diagnostics diagnostics;  // printed when the robot is loaded
    const XacroResult result = expand_xacro(file, arguments, resolver_, diagnostics);
    // A file of a view is read from a folder that ends with the launch; its text is kept instead.
    const bool viewed = std::any_of(result.files.begin(), result.files.end(), [&](const fs::path& one) {
      return one.string().starts_with((folder_ / "share").string());
    });
    return {{"text", xacro_text(result.tree, file.string())}, {"source", viewed ? "" : file.string()}};
  } catch (const InputError& error) {
    return {{"error", error.what()}};
  }
}

// The share folder of a package, which is that of its source where the layout is the same.
Json LaunchReader::answer_package(const std::string& name) {
  const fs::path source = resolver_.find_package(name).path;
  const fs::path view = source.empty() ? fs::path() : installed_view(source, name, folder_);
  if (!view.empty()) resolver_.add_package(name, view);
  return {{"folder", (view.empty() ? source : view).string()}};
}

// A file that the launch file makes, such as one with replaced values.
Json LaunchReader::answer_write(const Json& request) {
  const std::string name = fs::path(request.at("write").get<std::string>()).filename().string();
  const std::string text = request.at("text").get<std::string>();
  written_ += text.size();
  if (written_ > kMaxWritten) return {{"error", "it makes too many files"}};
  std::error_code none;
  fs::create_directories(folder_, none);
  fs::path file = folder_ / (name.empty() || name == "." || name == ".." ? "file" : name);
  for (int count = 2; fs::exists(fs::symlink_status(file, none)); ++count)
    file = folder_ / fmt::format("{}_{}", count, name);
  try {
    write_whole(file, text);
  } catch (const InputError& error) {
    return {{"error", error.what()}};
  }
  return {{"file", file.string()}};
}

Json LaunchReader::answer(const Json& request) {
  if (bounds_ && request.contains("xacro")) return {{"error", "xacro is not run"}};
  if (request.contains("package")) return answer_package(request.at("package").get<std::string>());
  if (request.contains("write")) return answer_write(request);
  if (!request.contains("xacro")) return Json::object();
  return answer_xacro(request);
}

Json LaunchReader::next() {
  while (true) {
    Json request = bounded_json(line());
    if (request.is_discarded() || !request.is_object()) return Json(Json::value_t::discarded);
    if (request.contains("result")) return std::move(request.at("result"));
    // A file may ask without an end, and each answer is memory and files of this process.
    if (bounds_ && (++requests_ > kMaxRequests || std::chrono::steady_clock::now() > bounds_->end)) {
      late_ = true;
      return Json(Json::value_t::discarded);
    }
    const std::string text = answer(request).dump(-1, ' ', false, Json::error_handler_t::replace) + "\n";
    if (!send(text)) return Json(Json::value_t::discarded);
  }
}

}  // namespace doppel
