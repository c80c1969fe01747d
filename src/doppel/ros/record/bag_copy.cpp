#include "doppel/ros/record/bag_copy.h"

#include <map>
#include <vector>

#include "doppel/ros/record/pending_latched.h"

namespace doppel {
namespace {

// The topics of the copy, made when their first message comes.
class CopiedTopics {
 public:
  CopiedTopics(const BagReader& bag, BagWriter& copy) : bag_(bag), copy_(copy) {}

  std::size_t operator[](std::size_t topic) {
    const auto found = topics_.find(topic);
    if (found != topics_.end()) return found->second;
    return topics_[topic] = copy_.add_topic(recorded_topic(bag_, topic));
  }

 private:
  const BagReader& bag_;
  BagWriter& copy_;
  std::map<std::size_t, std::size_t> topics_;
};

// Each publisher of a topic keeps messages of its own.
PendingLatched latched_before(BagReader& bag, std::uint64_t start, const TopicSelection& topics,
                              CopiedTopics& copied) {
  PendingLatched out;
  if (start <= bag.contents().start) return out;
  TopicSelection latched = topics;
  latched.topics.clear();
  std::vector<std::size_t> counts;  // by topic
  for (const BagTopic& topic : bag.contents().topics) {
    counts.push_back(bag.latched(counts.size()));
    if (counts.back() > 0 && topics.selects(topic.name, topic.type)) latched.topics.push_back(topic.name);
  }
  if (latched.topics.empty()) return out;
  bag.seek(0, start, latched);
  while (const auto message = bag.next()) {
    if (const std::size_t count = counts[message->topic]; count > 0)
      out.keep(copied[message->topic], count, message->sequence, message->publish_time, message->data);
  }
  return out;
}

}  // namespace

RecordedTopic recorded_topic(const BagReader& bag, std::size_t topic) {
  const BagTopic& about = bag.contents().topics[topic];
  return {about.name,      about.type, about.encoding,    about.schema, about.schema_encoding,
          about.type_hash, about.qos,  bag.latched(topic)};
}

bool copy_from(BagReader& bag, std::uint64_t start, std::uint64_t end, const TopicSelection& topics,
               BagWriter& copy, const std::function<bool(double)>& progress) {
  constexpr std::uint64_t kLook = 4096;  // messages between two reports of progress
  CopiedTopics copied(bag, copy);
  latched_before(bag, start, topics, copied).write(copy, start);
  bag.seek(start, end, topics);
  const auto all = static_cast<double>(bag.contents().messages);
  std::uint64_t count = 0;
  while (const auto message = bag.next()) {
    copy.write(copied[message->topic], message->sequence, message->log_time, message->publish_time,
               message->data);
    if (++count % kLook == 0 && progress && !progress(static_cast<double>(count) / all)) return false;
  }
  return true;
}

void copy_parts(BagReader& bag, BagWriter& copy) {
  for (const BagPart& part : bag.contents().attachments)
    copy.attach({part.part.name, "application/octet-stream", bag.attachment(part)}, bag.contents().start);
  for (const BagPart& part : bag.contents().metadata) {
    if (part.part.name != "rosbag2") copy.add_metadata(part.part.name, bag.metadata(part));
  }
}

}  // namespace doppel
