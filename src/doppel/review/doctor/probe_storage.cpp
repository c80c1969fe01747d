#include <sys/inotify.h>
#include <sys/resource.h>
#include <sys/statvfs.h>
#include <unistd.h>

#include <cerrno>
#include <charconv>
#include <cstring>

#include "doppel/base/core/file_descriptor.h"
#include "doppel/review/doctor/detail/probes.h"
#include "doppel/ros/server/announcement.h"

namespace doppel::doctor {
namespace {

namespace fs = std::filesystem;

StorageFacts::Place look_at(const std::string& name, const std::string& use, const fs::path& path) {
  StorageFacts::Place place;
  place.name = name;
  place.use = use;
  place.path = path;
  std::error_code none;
  place.exists = fs::exists(path, none);
  place.is_writable = access(path.c_str(), W_OK) == 0;
  struct statvfs room {};
  if (statvfs(path.c_str(), &room) == 0) {
    place.free_bytes = static_cast<std::int64_t>(room.f_bavail) * static_cast<std::int64_t>(room.f_frsize);
    if (room.f_files > 0) place.free_files = static_cast<std::int64_t>(room.f_favail);
  }
  return place;
}

std::int64_t number_in(const fs::path& file) {
  const std::string text = first_line(file);
  std::int64_t value = -1;
  std::from_chars(text.data(), text.data() + text.size(), value);
  return value;
}

std::string watch_failure() {
  const FileDescriptor watcher(inotify_init1(IN_CLOEXEC));
  if (!watcher.is_open()) return std::strerror(errno);
  return inotify_add_watch(watcher.get(), "/", IN_CLOSE_WRITE) < 0 ? std::strerror(errno) : "";
}

}  // namespace

StorageFacts probe_storage(const ProgramPlace& program) {
  StorageFacts facts;
  std::error_code none;
  facts.places.push_back(look_at("working", "the folder you work in", fs::current_path(none)));
  facts.places.push_back(look_at("temporary", "temporary files", fs::temp_directory_path(none)));
  facts.places.push_back(look_at("shared_memory", "shared memory", "/dev/shm"));
  // Not yet made where no twin has run.
  const fs::path announcements = announcement_folder();
  facts.places.push_back(
      look_at("announcements", "the list of running twins",
              fs::exists(announcements, none) ? announcements : announcements.parent_path()));
  if (fs::exists(program.root / "build", none))
    facts.places.push_back(look_at("build", "the build", program.root / "build"));
  facts.file_watches = number_in("/proc/sys/fs/inotify/max_user_watches");
  facts.watch_instances = number_in("/proc/sys/fs/inotify/max_user_instances");
  facts.watch_failure = watch_failure();
  rlimit files{};
  if (getrlimit(RLIMIT_NOFILE, &files) == 0 && files.rlim_cur != RLIM_INFINITY)
    facts.open_files = static_cast<std::int64_t>(files.rlim_cur);
  return facts;
}

}  // namespace doppel::doctor
