#include "doppel/ros/record/bag_reader.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <filesystem>
#include <sstream>
#include <utility>

#include "doppel/base/core/diagnostic.h"
#include "doppel/base/core/path_below.h"
#include "doppel/ros/record/bag_metadata.h"

namespace doppel {
namespace {

namespace fs = std::filesystem;

// Runs `work`; what it throws names the file.
template <class Work>
auto on_file(const std::string& path, Work work) {
  try {
    return work();
  } catch (const fs::filesystem_error& problem) {
    throw InputError("file.unreadable", make_location(path),
                     fmt::format("it cannot be read: {}", problem.code().message()));
  } catch (const InputError& problem) {
    std::vector<Diagnostic> named = problem.diagnostics();
    for (Diagnostic& one : named) {
      if (!one.where.known()) one.where = make_location(path);
    }
    throw InputError(std::move(named));
  }
}

[[noreturn]] void refuse_folder(const std::string& folder, std::vector<std::string> others) {
  const bool is_sqlite =
      std::ranges::any_of(others, [](const std::string& name) { return name.ends_with(".db3"); });
  throw InputError(
      "bag.no_files", {}, fmt::format("the folder '{}' has no .mcap file", folder),
      is_sqlite ? "it is an SQLite bag of rosbag2; convert it with: ros2 bag convert (to storage_id mcap)"
                : "name an .mcap file, or a folder with some");
}

std::vector<std::string> files_in(const std::string& folder) {
  std::vector<std::string> out, others;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder)) {
    const bool is_mcap = entry.path().extension() == ".mcap";
    (is_mcap ? out : others).push_back(is_mcap ? entry.path().string() : entry.path().filename().string());
  }
  if (out.empty()) refuse_folder(folder, std::move(others));
  std::ranges::sort(out, [](const std::string& a, const std::string& b) {
    return std::pair(a.size(), a) < std::pair(b.size(), b);
  });
  return out;
}

std::string text_of(const std::vector<std::pair<std::string, std::string>>& texts, std::string_view key) {
  const auto found = std::ranges::find_if(texts, [key](const auto& entry) { return entry.first == key; });
  return found == texts.end() ? "" : found->second;
}

// How many last messages those get who come later, by the qualities that publishers offer. rosbag2 has
// written the policies' numbers before Jazzy.
std::size_t latched_of(const std::string& qos) {
  constexpr std::size_t kMaxOfPublisher = 64;
  std::size_t sum = 0, depth = 1;
  std::istringstream lines(qos);
  for (std::string line; std::getline(lines, line);) {
    constexpr std::string_view kDepth = "depth: ";
    if (const std::size_t found = line.find(kDepth); found != std::string::npos)
      std::from_chars(line.data() + found + kDepth.size(), line.data() + line.size(), depth);
    if (line.ends_with("durability: transient_local") || line.ends_with("durability: 1"))
      sum += std::clamp<std::size_t>(depth, 1, kMaxOfPublisher);
  }
  return sum;
}

// Why a file has no index; empty: it has one.
std::string note_about(const std::string& path, const McapContents& contents) {
  const std::string name = fs::path(path).filename().string();
  if (!contents.damage.empty())
    return fmt::format("{}: {}; doppel bag recover writes a copy of what is whole", name, contents.damage);
  if (contents.indexed || contents.has_loose_messages) return "";
  return fmt::format(
      "{}: it was not closed, so that it was read as a whole; doppel bag recover writes a copy with an index",
      name);
}

}  // namespace

namespace {

// The files that the metadata of a bag list.
struct ListedFiles {
  std::vector<std::string> present, missing;
};

ListedFiles listed_files(const fs::path& folder) {
  ListedFiles out;
  for (const std::string& name : files_of_bag_metadata(folder / kBagMetadataFile)) {
    // rosbag2 of Foxy wrote the folder's name as well. A list that leads out of the folder is not rosbag2's.
    const fs::path beside = folder / fs::path(name).filename(),
                   file = path_below(name, folder) ? folder / name : beside;
    if (fs::exists(file) || fs::exists(beside)) {
      out.present.push_back((fs::exists(file) ? file : beside).string());
    } else {
      out.missing.push_back(name);
    }
  }
  return out;
}

// The folder of a bag; empty: it is a file.
fs::path folder_of(const std::string& bag) {
  const fs::path path(bag);
  if (path.filename() == kBagMetadataFile) return path.has_parent_path() ? path.parent_path() : fs::path(".");
  return fs::is_directory(path) ? path : fs::path();
}

}  // namespace

std::vector<std::string> files_of_bag(const std::string& bag) {
  return on_file(bag, [&]() -> std::vector<std::string> {
    const fs::path folder = folder_of(bag);
    if (folder.empty()) return {bag};
    if (!fs::exists(folder / kBagMetadataFile)) return files_in(folder.string());
    std::vector<std::string> out = listed_files(folder).present;
    return out.empty() ? files_in(folder.string()) : out;
  });
}

struct BagReader::Impl {
  struct File {
    std::string path;
    McapReader reader;
    std::map<std::uint16_t, std::size_t> topics;  // by channel
  };

  void add_file(const std::string& path) {
    files.push_back({path, on_file(path, [&] { return McapReader(open_mcap_source(path)); }), {}});
    const McapContents& in_file = files.back().reader.contents();
    contents.files.push_back(path);
    contents.size += on_file(path, [&] { return fs::file_size(path); });
    if (in_file.message_count > 0) {
      const bool is_first = contents.messages == 0;
      contents.start = is_first ? in_file.start_time : std::min(contents.start, in_file.start_time);
      contents.end = std::max(contents.end, in_file.end_time);
    }
    contents.messages += in_file.message_count;
    contents.profile = in_file.profile;
    contents.library = in_file.library;
    for (const McapChunkInfo& chunk : in_file.chunks) contents.compressions.insert(chunk.compression);
    for (const McapNamedPart& part : in_file.attachments)
      contents.attachments.push_back({files.size() - 1, part});
    for (const McapNamedPart& part : in_file.metadata) contents.metadata.push_back({files.size() - 1, part});
    if (const std::string note = note_about(path, in_file); !note.empty()) contents.notes.push_back(note);
    for (const McapChannelInfo& channel : in_file.channels) add_channel(channel, in_file);
  }

  void add_channel(const McapChannelInfo& channel, const McapContents& in_file) {
    const McapSchemaInfo* const schema = in_file.schema(channel.schema_id);
    const std::string type = schema == nullptr ? "" : schema->name;
    const auto found = std::ranges::find_if(contents.topics, [&](const BagTopic& topic) {
      return topic.name == channel.topic && topic.type == type;
    });
    const bool is_new = found == contents.topics.end();
    BagTopic& topic = is_new ? contents.topics.emplace_back() : *found;
    if (is_new) {
      topic.name = channel.topic;
      topic.type = type;
      topic.encoding = channel.message_encoding;
      topic.type_hash = text_of(channel.metadata, "topic_type_hash");
      if (schema != nullptr) {
        topic.schema.assign(reinterpret_cast<const char*>(schema->data.data()), schema->data.size());
        topic.schema_encoding = schema->encoding;
      }
    }
    // The recorder begins another channel for a topic when a latched publisher joins.
    const std::string qos = text_of(channel.metadata, "offered_qos_profiles");
    const std::size_t latched = latched_of(qos);
    if (is_new || latched > topic.latched) {
      topic.qos = qos;
      topic.latched = latched;
    }
    topic.messages += channel.message_count.value_or(0);
    topic.counted = topic.counted && channel.message_count.has_value();
    channels_.push_back({files.size() - 1, channel.id, channel.topic, type});
  }

  // Topics have their final places only once all files are read.
  void finish() {
    std::ranges::sort(contents.topics, {},
                      [](const BagTopic& topic) { return std::pair(topic.name, topic.type); });
    for (const Channel& channel : channels_) {
      const auto found = std::ranges::find_if(contents.topics, [&](const BagTopic& topic) {
        return topic.name == channel.topic && topic.type == channel.type;
      });
      files[channel.file].topics[channel.id] = static_cast<std::size_t>(found - contents.topics.begin());
    }
    channels_.clear();
    repeats = contents.library.starts_with("doppel");
  }

  // Positions the reader of the present file.
  bool begin_file() {
    File& file = files[current];
    McapRange range{start, end, {}};
    for (const auto& [channel, topic] : file.topics) {
      if (is_selected[topic]) range.channels.push_back(channel);
    }
    if (range.channels.empty()) return false;  // an empty list would mean all of them
    on_file(file.path, [&] { file.reader.seek(range); });
    return true;
  }

  // A latched message that stands at the start of another file once more.
  bool is_repeated(const McapMessage& message, std::size_t topic) {
    Last& last = last_of[topic];
    if (repeats && message.sequence > 0 && last.file != current && message.sequence <= last.sequence &&
        message.publish_time <= last.publish_time)
      return true;
    if (message.sequence >= last.sequence || last.file != current)
      last = {current, message.sequence, message.publish_time};
    return false;
  }

  struct Channel {
    std::size_t file = 0;
    std::uint16_t id = 0;
    std::string topic, type;
  };
  struct Last {
    std::size_t file = SIZE_MAX;
    std::uint32_t sequence = 0;
    std::uint64_t publish_time = 0;
  };
  std::vector<File> files;
  BagContents contents;
  bool repeats = false;
  std::uint64_t start = 0, end = UINT64_MAX;
  std::vector<bool> is_selected;
  std::vector<Last> last_of;  // by topic
  std::size_t current = 0;
  bool positioned = false;

 private:
  std::vector<Channel> channels_;
};

BagReader::BagReader(const std::string& bag) : impl_(std::make_unique<Impl>()) {
  for (const std::string& file : files_of_bag(bag)) impl_->add_file(file);
  impl_->finish();
  if (const fs::path folder = folder_of(bag); !folder.empty() && fs::exists(folder / kBagMetadataFile))
    impl_->contents.missing = listed_files(folder).missing;
  for (const std::string& file : impl_->contents.missing)
    impl_->contents.notes.push_back(fmt::format("{}: metadata.yaml lists it, and it is not there", file));
  seek(0, UINT64_MAX, {.hidden = true});
}

BagReader::~BagReader() = default;
BagReader::BagReader(BagReader&&) noexcept = default;

const BagContents& BagReader::contents() const {
  return impl_->contents;
}

std::size_t BagReader::latched(std::size_t topic) const {
  return impl_->contents.topics[topic].latched;
}

void BagReader::seek(std::uint64_t start, std::uint64_t end, const TopicSelection& topics) {
  Impl& impl = *impl_;
  impl.start = start;
  impl.end = end;
  impl.is_selected.clear();
  for (const BagTopic& topic : impl.contents.topics)
    impl.is_selected.push_back(topics.selects(topic.name, topic.type));
  impl.last_of.assign(impl.contents.topics.size(), {});
  impl.current = 0;
  impl.positioned = false;
}

std::optional<BagMessage> BagReader::next() {
  Impl& impl = *impl_;
  for (; impl.current < impl.files.size(); ++impl.current, impl.positioned = false) {
    if (!impl.positioned && !impl.begin_file()) continue;
    impl.positioned = true;
    Impl::File& file = impl.files[impl.current];
    while (const auto message = on_file(file.path, [&] { return file.reader.next(); })) {
      const std::size_t topic = file.topics.at(message->channel_id);
      if (impl.is_repeated(*message, topic)) continue;
      return BagMessage{topic, message->sequence, message->log_time, message->publish_time, message->data};
    }
  }
  return std::nullopt;
}

std::vector<std::byte> BagReader::attachment(const BagPart& part) {
  const auto& file = impl_->files[part.file];
  return on_file(file.path, [&] {
    const McapRecord record = impl_->files[part.file].reader.part(part.part);
    const McapBytes data = std::get<McapAttachment>(record).data;
    return std::vector<std::byte>(data.begin(), data.end());
  });
}

std::vector<std::pair<std::string, std::string>> BagReader::metadata(const BagPart& part) {
  const auto& file = impl_->files[part.file];
  return on_file(file.path, [&] {
    const McapRecord record = impl_->files[part.file].reader.part(part.part);
    std::vector<std::pair<std::string, std::string>> out;
    for (const auto& [key, text] : std::get<McapMetadata>(record).texts) out.emplace_back(key, text);
    return out;
  });
}

}  // namespace doppel
