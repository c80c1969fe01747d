#include <fmt/format.h>

#include <cstdlib>
#include <set>

#include "doppel/base/core/output_file.h"
#include "doppel/base/core/path_below.h"
#include "doppel/session/live/session.h"

namespace doppel {
namespace {

namespace fs = std::filesystem;

// "package://arm/meshes/a.stl" -> "arm/meshes/a.stl"; empty: no place within `folder`.
fs::path place_of(const std::string& uri, const fs::path& folder) {
  return path_below(fs::path(uri.substr(uri.find("://") + 3)).relative_path(), folder).value_or("");
}

bool is_mesh(const std::string& name) {
  return name.find("://") != std::string::npos;
}

fs::path make_folder() {
  std::string name = (fs::temp_directory_path() / "doppel-meshes-XXXXXX").string();
  return mkdtemp(name.data()) == nullptr ? fs::path() : fs::path(name);
}

// Writes the attached meshes as the packages that their URIs name.
RobotFiles write_meshes(BagReader& bag, const fs::path& folder) {
  RobotFiles out;
  out.description = folder / "recording.urdf";
  std::error_code none;
  for (const BagPart& part : bag.contents().attachments) {
    const std::string& uri = part.part.name;
    const fs::path place = is_mesh(uri) ? place_of(uri, folder) : fs::path();
    if (place.empty()) continue;
    const fs::path file = folder / place, package = folder / *place.begin();
    fs::create_directories(file.parent_path(), none);
    const std::vector<std::byte> data = bag.attachment(part);
    try {
      write_whole(file, {reinterpret_cast<const char*>(data.data()), data.size()});
      if (uri.starts_with("package://") && !fs::exists(package / "package.xml"))
        write_whole(package / "package.xml",
                    fmt::format("<package><name>{}</name></package>\n", package.filename().string()));
    } catch (const InputError&) {
      continue;  // "package://a" beside "package://a/b": one of them is no place
    }
    out.meshes.push_back({uri, file});
  }
  return out;
}

Time bag_time(std::uint64_t nanoseconds) {
  return time_from_nanoseconds(static_cast<std::int64_t>(nanoseconds));
}

SessionOptions with_playback(SessionOptions options, const std::shared_ptr<PlaybackControl>& playback) {
  options.server.playback = playback;
  return options;
}

}  // namespace

BagSession::BagSession(Bus& bus, const std::string& name, BagReader& bag, const SessionOptions& options,
                       const Log& log)
    : BagSession(
          std::make_shared<PlaybackControl>(bag_time(bag.contents().start), bag_time(bag.contents().end)),
          bus, name, bag, options, log) {}

BagSession::BagSession(std::shared_ptr<PlaybackControl> playback, Bus& bus, const std::string& name,
                       BagReader& bag, SessionOptions options, const Log& log)
    : Session(bus, name, with_playback(std::move(options), playback), log), playback_(std::move(playback)) {
  const bool any = std::ranges::any_of(bag.contents().attachments,
                                       [](const BagPart& part) { return is_mesh(part.part.name); });
  if (!any) return;
  meshes_ = make_folder();
  // Without its meshes a robot is drawn by what else it has.
  if (meshes_.empty()) {
    log.warning("play", "the recording's meshes cannot be written to a temporary folder");
  } else {
    assets_->offer(write_meshes(bag, meshes_));
  }
}

BagSession::~BagSession() {
  std::error_code none;
  if (!meshes_.empty()) fs::remove_all(meshes_, none);
}

}  // namespace doppel
