#include "doppel/session/live/recording_view.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cstddef>
#include <cstring>
#include <filesystem>
#include <set>
#include <string_view>
#include <system_error>
#include <utility>

#include "doppel/base/core/diagnostic.h"
#include "doppel/base/core/names.h"
#include "doppel/base/core/read_file.h"
#include "doppel/base/mcap/mcap_reader.h"
#include "doppel/ros/record/bag_metadata.h"
#include "doppel/ros/record/bag_reader.h"

namespace doppel {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kMcap = ".mcap";

// -- which words are recordings

bool is_named_as_recording(const fs::path& path) {
  return path.extension() == kMcap || path.extension() == ".bag" || path.extension() == ".db3";
}

bool is_metadata(const fs::path& file) {
  constexpr std::size_t kEnough = 4096;
  return file.filename() == kBagMetadataFile &&
         beginning_of_file(file, kEnough).find("rosbag2_bagfile_information") != std::string::npos;
}

bool is_folder_of_recording(const fs::path& folder) {
  if (is_metadata(folder / kBagMetadataFile)) return true;
  bool has_recording = false;
  std::error_code none;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder, none)) {
    const fs::path& path = entry.path();
    if (path.filename() == "package.xml" || path.extension() == ".urdf" || path.extension() == ".xacro")
      return false;
    has_recording |= path.extension() == kMcap || path.extension() == ".db3";
  }
  return has_recording;
}

bool path_exists(const fs::path& path) {
  std::error_code none;
  return fs::exists(path, none);
}

// The recordings beside a file that does not exist.
std::vector<std::string> recordings_beside(const fs::path& file) {
  constexpr std::size_t kMaxNames = 1000;
  std::vector<std::string> out;
  std::error_code none;
  const fs::path folder = file.has_parent_path() ? file.parent_path() : fs::path(".");
  for (const fs::directory_entry& entry : fs::directory_iterator(folder, none)) {
    if (out.size() < kMaxNames && is_recording(entry.path().string()))
      out.push_back(entry.path().filename().string());
  }
  std::ranges::sort(out);
  return out;
}

[[noreturn]] void refuse_missing(const std::string& word) {
  const std::string with_extension = word + std::string(kMcap);
  throw InputError(
      "file.unreadable", {},
      fmt::format("there is no file or folder '{}'{}", word,
                  path_exists(with_extension)
                      ? fmt::format("; did you mean '{}'?", with_extension)
                      : did_you_mean(fs::path(word).filename().string(), recordings_beside(word))),
      "name an .mcap file, or the folder of a bag");
}

// -- what is in a file

bool ends_as_mcap(const McapSource& source) {
  std::array<std::byte, kMcapMagicSize> end{};
  if (source.size() < end.size()) return false;
  source.read(source.size() - end.size(), end);
  return std::memcmp(end.data(), kMcapMagic, kMcapMagicSize) == 0;
}

// Without reading a file as a whole that has no index: the page does that, and shows how far it is.
struct QuickLook {
  std::vector<std::string> notes;
  bool is_known = true;  // all files have an index
  bool has_description = false, has_messages = false;

  void add(const std::string& path) {
    const std::string name = fs::path(path).filename().string();
    auto source = open_mcap_source(path);
    if (!ends_as_mcap(*source)) {
      (void)McapScanner(*source);  // refuses other kinds of files
      notes.push_back(
          fmt::format("{}: it was not closed or is cut off, so that the page reads it as a whole; doppel bag "
                      "recover writes a copy with an index",
                      name));
      is_known = false;
      return;
    }
    const McapReader reader(std::move(source));
    const McapContents& contents = reader.contents();
    if (!contents.damage.empty())
      notes.push_back(
          fmt::format("{}: {}; doppel bag recover writes a copy of what is whole", name, contents.damage));
    has_messages |= contents.message_count > 0;
    has_description |= std::ranges::any_of(contents.channels, [](const McapChannelInfo& channel) {
      return channel.topic.ends_with("/robot_description");
    });
  }
};

// Files that the bag's metadata lists and that are not there.
void note_missing(const fs::path& folder, ViewedBag& bag) {
  if (!path_exists(folder / kBagMetadataFile)) return;
  for (const std::string& name : files_of_bag_metadata(folder / kBagMetadataFile)) {
    const fs::path listed = fs::path(name).filename();
    const bool is_shown = std::ranges::any_of(
        bag.files, [&listed](const std::string& file) { return fs::path(file).filename() == listed; });
    if (!is_shown) bag.notes.push_back(fmt::format("{}: metadata.yaml lists it, and it is not there", name));
  }
}

// -- addresses

std::string percent_encoded(std::string_view text) {
  constexpr std::string_view kPlain = "-._~/";
  std::string out;
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if (std::isalnum(byte) != 0 || kPlain.find(c) != std::string_view::npos) {
      out += c;
    } else {
      out += fmt::format("%{:02X}", byte);
    }
  }
  return out;
}

// The files of a bag at addresses below `folder`, and the address that the page opens.
std::string add_bag(const ViewedBag& bag, const std::string& folder, std::vector<RangeFile>& files) {
  const std::string place = folder + "/" + bag.name;
  if (!bag.is_folder) {
    files.push_back({.address = "/" + place, .path = fs::absolute(bag.files.front())});
    return place;
  }
  std::string metadata = "rosbag2_bagfile_information:\n  storage_identifier: mcap\n  relative_file_paths:\n";
  std::set<std::string> names;
  for (const std::string& file : bag.files) {
    std::string name = fs::path(file).filename().string();
    if (!names.insert(name).second) name = fmt::format("{}/{}", names.size(), name);  // of another folder
    names.insert(name);
    metadata += fmt::format("    - {}\n", percent_encoded(name));
    files.push_back({.address = "/" + place + "/" + name, .path = fs::absolute(file)});
  }
  files.push_back({.address = "/" + place + "/" + kBagMetadataFile, .text = std::move(metadata)});
  return place + "/";
}

struct ServedBags {
  std::vector<RangeFile> files;
  std::string query;  // of the page's address
};

ServedBags served_bags(const std::vector<ViewedBag>& bags, std::optional<double> time) {
  ServedBags out;
  for (std::size_t i = 0; i < bags.size(); ++i) {
    const std::string place = add_bag(bags[i], fmt::format("recordings/{}", i + 1), out.files);
    // The page decodes the value, and takes it for an address.
    out.query += fmt::format("{}={}", i == 0 ? "bag" : "&bag2", percent_encoded(percent_encoded(place)));
  }
  if (time) out.query += fmt::format("&t={}", *time);
  return out;
}

ServerOptions with_files(ServerOptions options, std::vector<RangeFile> files) {
  if (!path_exists(options.page_folder / "index.html")) {
    throw InputError("view.no_page", {},
                     fmt::format("recordings are shown by the web page, which is not in '{}'",
                                 options.page_folder.string()),
                     "build it: npm ci && npm run build in the folder web of the checkout");
  }
  options.range_files = std::move(files);
  return options;
}

}  // namespace

bool is_recording(const std::string& word) {
  constexpr std::array<std::string_view, 3> kBeginnings{"\x89MCAP", "#ROSBAG", "SQLite format 3"};
  const fs::path path(word);
  std::error_code none;
  const fs::file_status status = fs::status(path, none);
  if (fs::is_directory(status)) return is_folder_of_recording(path);
  if (is_named_as_recording(path)) return true;
  if (!fs::exists(status)) return !word.empty() && path_exists(word + std::string(kMcap));
  if (!fs::is_regular_file(status)) return false;
  if (is_metadata(path)) return true;
  const std::string begin = beginning_of_file(path, kBeginnings.back().size());
  return std::ranges::any_of(kBeginnings, [&](std::string_view magic) { return begin.starts_with(magic); });
}

ViewedBag open_viewed_bag(const std::string& word) {
  if (!path_exists(word)) refuse_missing(word);
  ViewedBag out;
  out.files = files_of_bag(word);
  fs::path path = fs::absolute(word).lexically_normal();
  out.is_folder = path.filename() == kBagMetadataFile || fs::is_directory(path);
  if (path.filename() == kBagMetadataFile) path = path.parent_path();
  if (path.filename().empty()) path = path.parent_path();  // "run/"
  out.name = path.filename().empty() ? "recording" : path.filename().string();
  QuickLook look;
  for (const std::string& file : out.files) {
    try {
      look.add(file);
    } catch (const InputError& problem) {
      std::vector<Diagnostic> named = problem.diagnostics();
      for (Diagnostic& one : named) {
        if (!one.where.known()) one.where = make_location(file);
      }
      throw InputError(std::move(named));
    }
  }
  out.notes = std::move(look.notes);
  if (out.is_folder) note_missing(path, out);
  if (look.is_known && !look.has_messages) {
    out.notes.push_back(fmt::format("{}: it has no messages", word));
  } else if (look.is_known && !look.has_description) {
    out.notes.push_back(fmt::format(
        "{}: it has no /robot_description, so that the page shows curves, log, topics and pictures "
        "without a robot",
        word));
  }
  return out;
}

RecordingView::RecordingView(const std::vector<ViewedBag>& bags, std::optional<double> time,
                             const ServerEdgeOptions& options, const Log& log)
    : server_(bus_,
              with_files(server_options(bags.front().name, options, nullptr), served_bags(bags, time).files),
              log),
      page_url_(fmt::format("{}{}{}", server_.page_url(), server_.token().empty() ? "/?" : "&",
                            served_bags(bags, time).query)) {}

}  // namespace doppel
