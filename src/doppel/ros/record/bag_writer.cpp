#include "doppel/ros/record/bag_writer.h"

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <system_error>

#include "doppel/base/core/diagnostic.h"
#include "doppel/base/core/output_file.h"

namespace doppel {
namespace {

namespace fs = std::filesystem;

// The record that rosbag2 keeps its own data in.
constexpr const char* kRosbagRecord = "rosbag2";
std::vector<std::byte> bytes_of(std::string_view text) {
  const auto* const data = reinterpret_cast<const std::byte*>(text.data());
  return {data, data + text.size()};
}

void make_folder(const fs::path& folder) {
  std::error_code error;
  if (fs::exists(folder, error)) {
    throw InputError("output.unwritable", {}, fmt::format("'{}' exists already", folder.string()),
                     "name another folder, or remove this one; a bag is never appended to");
  }
  if (!fs::create_directories(folder, error)) {
    throw InputError("output.unwritable", {},
                     fmt::format("the folder '{}' cannot be made: {}", folder.string(), error.message()));
  }
}

}  // namespace

struct BagWriter::Topic {
  struct Latched {
    std::uint32_t sequence = 0;
    std::uint64_t publish_time = 0;
    std::vector<std::byte> data;
  };
  RecordedTopic about;
  std::uint16_t channel = 0;  // in the present file; 0: not yet
  std::vector<Latched> latched;
};

BagWriter::BagWriter(BagWriterOptions options) : options_(std::move(options)) {
  if (options_.sink == nullptr && !options_.is_folder_made) make_folder(options_.folder);
  metadata_.distro = options_.distro;
  metadata_.custom = options_.custom;
  try {
    open_file();
  } catch (...) {
    discard();  // the folder would be in the way of another try
    throw;
  }
}

BagWriter::~BagWriter() {
  try {
    close();
  } catch (const InputError&) {
    // The disk is full: what was written before is readable, and a caller that wants the reason calls
    // close().
  }
}

void BagWriter::open_file() {
  fs::path folder = fs::absolute(options_.folder).lexically_normal();
  if (!folder.has_filename()) folder = folder.parent_path();  // "bags/run/"
  const std::string stem = folder.filename().string();
  std::string name = stem + ".mcap";
  if (options_.sink != nullptr) {
    writer_ = std::make_unique<McapWriter>(*options_.sink, options_.file);
  } else {
    name = fmt::format("{}_{}.mcap", stem.empty() ? "bag" : stem, opened_++);
    sink_ = std::make_unique<McapFileSink>((options_.folder / name).string());
    writer_ = std::make_unique<McapWriter>(*sink_, options_.file);
  }
  metadata_.files.push_back({name});
  for (Topic& topic : topics_) topic.channel = 0;
  last_time_ = 0;
  writer_->add_metadata(kRosbagRecord, {{"ROS_DISTRO", options_.distro}});
}

void BagWriter::close_file() {
  if (writer_ == nullptr) return;
  // rosbag2 reads the metadata of a file that has lost its folder from here.
  const std::string text = bag_metadata_text(metadata_);
  writer_->add_metadata(kRosbagRecord, {{"serialized_metadata", text}});
  writer_->close();
  closed_size_ += writer_->size();
  writer_.reset();
  sink_.reset();
}

std::size_t BagWriter::add_topic(const RecordedTopic& topic) {
  const auto found = std::ranges::find_if(topics_, [&](const Topic& other) {
    return other.about.name == topic.name && other.about.type == topic.type;
  });
  const auto index = static_cast<std::size_t>(found - topics_.begin());
  if (found != topics_.end()) {
    if (topic.latched <= found->about.latched) return index;
    // A latched publisher has joined. Readers count the publishers by the qualities of the channels, which
    // cannot be changed, so that the next message begins another channel.
    found->about.latched = topic.latched;
    found->about.qos = metadata_.topics[index].qos = topic.qos;
    found->channel = 0;
    return index;
  }
  topics_.push_back({topic, 0, {}});
  metadata_.topics.push_back({topic.name, topic.type, topic.encoding, topic.qos, topic.type_hash, 0});
  return index;
}

void BagWriter::put(Topic& topic, std::uint32_t sequence, std::uint64_t log_time, std::uint64_t publish_time,
                    McapBytes data) {
  if (topic.channel == 0) {
    const RecordedTopic& about = topic.about;
    const std::uint16_t schema =
        writer_->add_schema(about.type, about.schema_encoding, bytes_of(about.schema));
    topic.channel =
        writer_->add_channel(schema, about.name, about.encoding,
                             {{"offered_qos_profiles", about.qos}, {"topic_type_hash", about.type_hash}});
  }
  writer_->write({topic.channel, sequence, log_time, publish_time, data});
  BagFileCount& file = metadata_.files.back();
  if (file.messages == 0) file.start = log_time;
  file.duration = std::max(file.duration, log_time - file.start);
  ++file.messages;
  ++metadata_.topics[static_cast<std::size_t>(&topic - topics_.data())].messages;
  if (metadata_.messages == 0) metadata_.start = log_time;
  // Times are set back where a simulation is reset.
  const std::uint64_t end = std::max(metadata_.start + metadata_.duration, log_time);
  metadata_.start = std::min(metadata_.start, log_time);
  metadata_.duration = end - metadata_.start;
  ++metadata_.messages;
  last_time_ = log_time;
}

void BagWriter::repeat_latched(std::uint64_t log_time) {
  for (Topic& topic : topics_) {
    for (const Topic::Latched& message : topic.latched)
      put(topic, message.sequence, log_time, message.publish_time, message.data);
  }
}

// Opens the file of a message at this time: the present one, or the next.
void BagWriter::begin_message(std::uint64_t log_time, std::size_t size) {
  if (options_.sink == nullptr && writer_ != nullptr && metadata_.files.back().messages > 0) {
    const std::uint64_t start = metadata_.files.back().start;
    const bool is_full =
        options_.max_file_size > 0 && writer_->size() + writer_->pending() + size > options_.max_file_size;
    const bool is_long = options_.max_file_time > Duration{} && log_time > start &&
                         log_time - start >= static_cast<std::uint64_t>(options_.max_file_time.count());
    if (is_full || is_long || log_time < last_time_) close_file();
  }
  if (writer_ != nullptr) return;
  open_file();
  repeat_latched(log_time);
}

void BagWriter::write(std::size_t topic, std::uint32_t sequence, std::uint64_t log_time,
                      std::uint64_t publish_time, McapBytes data) {
  begin_message(log_time, data.size());
  Topic& target = topics_[topic];
  put(target, sequence, log_time, publish_time, data);
  if (target.about.latched == 0) return;
  std::erase_if(target.latched,
                [&](const Topic::Latched& other) { return std::ranges::equal(other.data, data); });
  if (target.latched.size() >= target.about.latched) target.latched.erase(target.latched.begin());
  target.latched.push_back({sequence, publish_time, {data.begin(), data.end()}});
}

void BagWriter::attach(const BagAttachment& attachment, std::uint64_t time) {
  if (writer_ == nullptr) open_file();
  writer_->attach({time, time, attachment.name, attachment.media_type, attachment.data, 0});
}

void BagWriter::add_metadata(const std::string& name,
                             const std::vector<std::pair<std::string, std::string>>& texts) {
  if (writer_ == nullptr) open_file();
  writer_->add_metadata(name, {texts.begin(), texts.end()});
}

void BagWriter::flush() {
  if (writer_ != nullptr) writer_->flush();
}

void BagWriter::sync() {
  flush();
  if (sink_ != nullptr) sink_->sync();
}

void BagWriter::start_sync() {
  flush();
  if (sink_ != nullptr) sink_->start_sync();
}

void BagWriter::split() {
  if (options_.sink == nullptr) close_file();
}

void BagWriter::remove_oldest() {
  if (metadata_.files.size() < (writer_ == nullptr ? 1U : 2U)) return;
  std::error_code none;
  const fs::path file = options_.folder / metadata_.files.front().path;
  const std::uintmax_t size = fs::file_size(file, none);
  if (!none) closed_size_ -= std::min<std::uint64_t>(size, closed_size_);
  fs::remove(file, none);
  metadata_.files.erase(metadata_.files.begin());
}

void BagWriter::close() {
  if (std::exchange(closed_, true)) return;
  close_file();
  if (options_.sink == nullptr) write_whole(options_.folder / kBagMetadataFile, bag_metadata_text(metadata_));
}

void BagWriter::discard() {
  closed_ = true;
  writer_.reset();
  sink_.reset();
  std::error_code none;
  if (options_.sink == nullptr) fs::remove_all(options_.folder, none);
}

std::size_t BagWriter::latched(std::size_t topic) const {
  return topics_[topic].about.latched;
}

// Messages that wait are lost with a failure.
std::uint64_t BagWriter::size() const {
  return closed_size_ + (writer_ == nullptr ? 0 : writer_->size() + (closed_ ? 0 : writer_->pending()));
}

std::uint64_t BagWriter::messages_in_files() const {
  if (writer_ == nullptr) return metadata_.messages;
  return metadata_.messages - metadata_.files.back().messages + writer_->messages_out();
}

}  // namespace doppel
