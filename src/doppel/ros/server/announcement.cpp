#include "doppel/ros/server/announcement.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <signal.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>

#include "doppel/base/core/diagnostic.h"
#include "doppel/base/core/folder_lock.h"
#include "doppel/base/core/output_file.h"
#include "doppel/base/core/read_file.h"
#include "doppel/base/core/time.h"
#include "doppel/base/core/user_folders.h"
#include "doppel/ros/server/detail/announcement_file.h"

namespace doppel {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMaxAnnouncementBytes = std::size_t{4} << 20;  // of the nodes of some thousand robots

bool is_alive(int pid) {
  return kill(pid, 0) == 0 || errno == EPERM;
}

// A twin that stands still with a full queue would let the connection wait for minutes, and with it all who
// wait for the folder.
bool connects(const sockaddr* address, socklen_t size) {
  constexpr int kConnectTimeout = 200;  // ms
  const int fd = socket(address->sa_family, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (fd < 0) return false;
  bool connected = connect(fd, address, size) == 0;
  if (!connected && (errno == EINPROGRESS || errno == EAGAIN)) {
    pollfd one{fd, POLLOUT, 0};
    int problem = 0;
    socklen_t length = sizeof problem;
    // A twin that does not answer in this time is there all the same.
    connected = poll(&one, 1, kConnectTimeout) == 0 ||
                (getsockopt(fd, SOL_SOCKET, SO_ERROR, &problem, &length) == 0 && problem == 0);
  }
  close(fd);
  return connected;
}

bool is_listening(const RunningTwin& twin) {
  sockaddr_in v4{};
  v4.sin_family = AF_INET;
  v4.sin_port = htons(twin.port);
  if (inet_pton(AF_INET, twin.address.c_str(), &v4.sin_addr) == 1)
    return connects(reinterpret_cast<const sockaddr*>(&v4), sizeof(v4));
  sockaddr_in6 v6{};
  v6.sin6_family = AF_INET6;
  v6.sin6_port = htons(twin.port);
  return inet_pton(AF_INET6, twin.address.c_str(), &v6.sin6_addr) == 1 &&
         connects(reinterpret_cast<const sockaddr*>(&v6), sizeof(v6));
}

// Readable only by this user, because it may contain the token.
bool write_private(const fs::path& file, const std::string& text) {
  const int fd = open(file.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_NOFOLLOW | O_CLOEXEC, 0600);
  if (fd < 0) return false;
  const bool written = write_all(fd, text);
  return close(fd) == 0 && written;
}

}  // namespace

std::optional<RunningTwin> read_announcement(const fs::path& file) {
  const auto object = nlohmann::json::parse(read_content(file, kMaxAnnouncementBytes).bytes, nullptr, false);
  if (!object.is_object()) return std::nullopt;
  try {
    RunningTwin twin{.pid = object.at("pid").get<int>(),
                     .port = object.at("port").get<std::uint16_t>(),
                     .robot = object.at("robot").get<std::string>(),
                     .started = object.at("started").get<std::int64_t>(),
                     .address = object.value("address", "127.0.0.1"),
                     .token = object.value("token", ""),
                     .emulated = object.value("emulated", false),
                     .nodes = object.value("nodes", std::vector<std::string>{})};
    if (object.contains("domain")) twin.domain = object.at("domain").get<std::uint32_t>();
    if (twin.pid > 0 && twin.port > 0) return twin;
  } catch (const nlohmann::json::exception&) {
    return std::nullopt;
  }
  return std::nullopt;
}

namespace {

std::string to_json(const RunningTwin& twin) {
  nlohmann::json object{{"pid", twin.pid},         {"port", twin.port},        {"robot", twin.robot},
                        {"address", twin.address}, {"token", twin.token},      {"started", twin.started},
                        {"nodes", twin.nodes},     {"emulated", twin.emulated}};
  if (twin.domain) object["domain"] = *twin.domain;
  return object.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
}

}  // namespace

std::string RunningTwin::label() const {
  return fmt::format("{}{} (port {})", robot, emulated ? ", emulated" : "", port);
}

fs::path announcement_folder() {
  return runtime_folder();
}

Announcement::Announcement(std::string robot, std::uint16_t port, const std::string& address,
                           const std::string& token)
    : about_{.pid = getpid(),
             .port = port,
             .robot = std::move(robot),
             .started = nanoseconds_of(system_time()),
             .address = address,
             .token = token} {
  problem_ = make_private_folder(announcement_folder());
  if (problem_.empty()) write();
}

void Announcement::write() {
  const std::string text = to_json(about_);
  // Others would take it for a broken one and remove it: the earlier one stays.
  if (text.size() > kMaxAnnouncementBytes) {
    problem_ = fmt::format("the announcement, with the names of {} nodes, is larger than {} MB",
                           about_.nodes.size(), kMaxAnnouncementBytes >> 20);
    return;
  }
  const fs::path file = announcement_folder() / fmt::format("{}-{}.json", about_.pid, about_.port);
  const fs::path draft = file.string() + ".new";  // renamed when complete, so that readers never get a part
  if (!write_private(draft, text)) {
    problem_ = fmt::format("cannot write {}: {}", draft.string(), std::strerror(errno));
    unlink(draft.c_str());
    return;
  }
  std::error_code failed;
  fs::rename(draft, file, failed);
  if (failed) {
    problem_ = fmt::format("cannot write {}: {}", file.string(), failed.message());
  } else {
    file_ = file;
  }
}

void Announcement::mark_emulated() {
  about_.emulated = true;
  if (!file_.empty()) write();
}

std::optional<RunningTwin> Announcement::enter_domain(std::uint32_t domain, std::vector<std::string> nodes) {
  return enter_domain(domain, std::move(nodes), FolderLock::kLockTimeout);
}

std::optional<RunningTwin> Announcement::enter_domain(std::uint32_t domain, std::vector<std::string> nodes,
                                                      std::chrono::milliseconds lock_timeout) {
  if (file_.empty()) return std::nullopt;
  std::optional<FolderLock> lock;
  try {
    lock.emplace(announcement_folder(), lock_timeout);
  } catch (const InputError& error) {
    // The twin runs all the same, and its names are compared with those of the twins that run already.
    const Diagnostic& why = error.diagnostics().front();
    problem_ = fmt::format("{} ({})", why.message, why.fix);
  }
  for (RunningTwin& twin : find_running()) {
    const bool is_own = twin.pid == about_.pid && twin.port == about_.port;
    if (!is_own && twin.domain == domain && std::ranges::find_first_of(twin.nodes, nodes) != twin.nodes.end())
      return std::move(twin);
  }
  about_.domain = domain;
  about_.nodes = std::move(nodes);
  write();
  return std::nullopt;
}

Announcement::~Announcement() {
  std::error_code ignored;
  if (!file_.empty()) fs::remove(file_, ignored);
}

std::vector<RunningTwin> find_running() {
  std::vector<RunningTwin> twins;
  if (!private_folder_problem(announcement_folder()).empty()) return twins;
  std::error_code failed;
  for (const auto& entry : fs::directory_iterator(announcement_folder(), failed)) {
    if (entry.path().extension() != ".json") continue;
    const auto twin = read_announcement(entry.path());
    if (twin && is_alive(twin->pid) && is_listening(*twin)) {
      twins.push_back(*twin);
    } else {
      std::error_code ignored;
      fs::remove(entry.path(), ignored);
    }
  }
  std::ranges::sort(twins, [](const RunningTwin& a, const RunningTwin& b) { return a.started > b.started; });
  return twins;
}

}  // namespace doppel
