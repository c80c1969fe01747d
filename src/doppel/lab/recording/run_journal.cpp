#include "doppel/lab/recording/run_journal.h"

#include <fmt/format.h>

#include <algorithm>

#include "doppel/base/core/diagnostic.h"
#include "doppel/base/mcap/mcap_memory_sink.h"
#include "doppel/base/mcap/mcap_recovery.h"
#include "doppel/ros/messages/codec.h"
#include "doppel/ros/record/bag_reader.h"
#include "doppel/twin/journal/input_journal.h"

namespace doppel {
namespace {

namespace fs = std::filesystem;

BagWriterOptions journal_options(const fs::path& folder, std::string distro) {
  BagWriterOptions out;
  out.folder = folder;
  out.distro = std::move(distro);
  return out;
}

}  // namespace

RunJournal::RunJournal(fs::path folder, std::string distro, std::uint64_t max_size)
    : folder_(std::move(folder)), max_size_(max_size), writer_(journal_options(folder_, std::move(distro))) {}

void RunJournal::write(const BagTopicCount& topic, const Edge::Incoming& message) {
  if (!end_.empty() || (topic.name != kInputsTopic && topic.name != kStateHashTopic)) return;
  const auto stamp = static_cast<std::uint64_t>(std::max<std::int64_t>(0, nanoseconds_of(message.stamp)));
  time_ = std::max(time_, stamp);
  try {
    auto found = topics_.find(topic.name);
    if (found == topics_.end()) {
      RecordedTopic recorded;
      recorded.name = topic.name;
      recorded.type = topic.type;
      recorded.type_hash = topic.type_hash;
      recorded.qos = topic.qos;
      if (const TypeSupport* const type = find_type(topic.type)) recorded.schema = type->schema();
      found = topics_.emplace(topic.name, writer_.add_topic(recorded)).first;
    }
    writer_.write(found->second, message.sequence, time_, stamp, message.cdr);
    has_inputs_ = has_inputs_ || topic.name == kInputsTopic;
  } catch (const InputError& error) {
    return give_up(error.diagnostics().front().message);
  }
  if (writer_.size() > max_size_)
    give_up(fmt::format("the inputs of the run are more than {} MB", max_size_ >> 20U));
}

void RunJournal::look(std::chrono::steady_clock::time_point now) {
  constexpr std::chrono::milliseconds kInputs{500}, kHashes{60'000};
  if (now - flushed_ < (has_inputs_ ? kInputs : kHashes)) return;
  flushed_ = now;
  flush();
}

void RunJournal::flush() {
  if (!end_.empty()) return;
  has_inputs_ = false;
  try {
    writer_.flush();
  } catch (const InputError& error) {
    give_up(error.diagnostics().front().message);
  }
}

void RunJournal::give_up(const std::string& why) {
  end_ = why;
  writer_.discard();
}

// A copy of what is whole, because the file has no end yet.
std::optional<BagAttachment> journal_attachment(const fs::path& folder) {
  std::error_code none;
  if (!fs::is_directory(folder, none)) return std::nullopt;
  McapMemorySink sink;
  const std::vector<std::string> files = files_of_bag(folder.string());
  if (recover_mcap(*open_mcap_source(files.front()), sink, {}).messages == 0) return std::nullopt;
  return BagAttachment{kJournalAttachment, "application/mcap", sink.take()};
}

}  // namespace doppel
