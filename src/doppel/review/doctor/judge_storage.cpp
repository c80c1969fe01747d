#include <fmt/format.h>

#include "doppel/review/doctor/findings.h"

namespace doppel::doctor {
namespace {

constexpr std::int64_t kLittleRoom = std::int64_t{100} << 20;
constexpr std::int64_t kFewFiles = 100, kFewWatches = 1024, kFewInstances = 16, kFewOpenFiles = 256;

std::string in_units(std::int64_t bytes) {
  if (bytes >= std::int64_t{1} << 30)
    return fmt::format("{:.1f} GiB", static_cast<double>(bytes) / (1 << 30));
  return fmt::format("{} MiB", bytes >> 20);
}

Finding judge_place(const StorageFacts::Place& place) {
  Finding finding{
      Level::note, "storage", "storage." + place.name, fmt::format("{} ({})", place.use, place.path.string()),
      "",          ""};
  if (!place.exists) {
    finding.what += " is missing";
    finding.why = place.path == "/dev/shm"
                      ? "ROS 2 programs exchange data over the network only, which is slower"
                      : "what is written there is lost";
    finding.remedy = place.path == "/dev/shm" ? "mount -t tmpfs tmpfs /dev/shm" : "make the folder";
  } else if (!place.is_writable) {
    finding.what += " is read-only for this user";
    finding.why = "reports, corrections and announcements cannot be written there";
    finding.remedy = "choose another folder, or change its permissions";
  } else if (place.free_bytes >= 0 && place.free_bytes < kLittleRoom) {
    finding.what += fmt::format(" has {} left", in_units(place.free_bytes));
    finding.why = "what is written there may be cut off";
    finding.remedy = "make room on the disk";
  } else if (place.free_files >= 0 && place.free_files < kFewFiles) {
    finding.what += fmt::format(" has room for {} files", place.free_files);
    finding.why = "no further files can be made there (inodes)";
    finding.remedy = "remove files that are not needed";
  } else {
    finding.level = Level::ok;
    if (place.free_bytes >= 0) finding.what += fmt::format(": {} free", in_units(place.free_bytes));
  }
  return finding;
}

Finding judge_watches(const StorageFacts& facts) {
  if (!facts.watch_failure.empty()) {
    return {Level::note,
            "storage",
            "watches",
            "files cannot be watched: " + facts.watch_failure,
            "a running twin does not pick up edits of its description",
            "sysctl fs.inotify.max_user_instances=512 fs.inotify.max_user_watches=65536"};
  }
  const bool few = (facts.file_watches >= 0 && facts.file_watches < kFewWatches) ||
                   (facts.watch_instances >= 0 && facts.watch_instances < kFewInstances);
  const std::string what =
      facts.file_watches < 0
          ? "edits of descriptions are noticed"
          : fmt::format("edits of descriptions are noticed ({} watches)", facts.file_watches);
  if (!few) return {Level::ok, "storage", "watches", what, "", ""};
  return {Level::note,
          "storage",
          "watches",
          what + ", but the limit is low",
          "with editors and other tools open, edits may go unnoticed",
          "sysctl fs.inotify.max_user_instances=512 fs.inotify.max_user_watches=65536"};
}

Finding judge_open_files(const StorageFacts& facts) {
  if (facts.open_files < 0 || facts.open_files >= kFewOpenFiles)
    return {Level::ok, "storage", "open_files", "enough files can be open", "", ""};
  return {Level::note,
          "storage",
          "open_files",
          fmt::format("only {} files can be open", facts.open_files),
          "many clients or meshes at once may fail",
          "ulimit -n 1024"};
}

}  // namespace

std::vector<Finding> judge_storage(const StorageFacts& facts) {
  std::vector<Finding> out;
  for (const StorageFacts::Place& place : facts.places) out.push_back(judge_place(place));
  out.push_back(judge_watches(facts));
  out.push_back(judge_open_files(facts));
  return out;
}

}  // namespace doppel::doctor
