#include "doppel/ros/record/bag_copy.h"

#include <map>

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

struct Latched {
  std::uint32_t sequence = 0;
  std::uint64_t publish_time = 0;
  std::vector<std::byte> data;
};

std::map<std::size_t, Latched> latched_before(BagReader& bag, std::uint64_t start,
                                              const TopicSelection& topics) {
  std::map<std::size_t, Latched> out;
  if (start <= bag.contents().start) return out;
  TopicSelection latched = topics;
  latched.topics.clear();
  for (std::size_t i = 0; i < bag.contents().topics.size(); ++i) {
    const BagTopic& topic = bag.contents().topics[i];
    if (bag.latched(i) > 0 && topics.selects(topic.name, topic.type)) latched.topics.push_back(topic.name);
  }
  if (latched.topics.empty()) return out;
  bag.seek(0, start, latched);
  while (const auto message = bag.next()) {
    if (bag.latched(message->topic) > 0)
      out[message->topic] = {
          message->sequence, message->publish_time, {message->data.begin(), message->data.end()}};
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
  for (const auto& [topic, message] : latched_before(bag, start, topics))
    copy.write(copied[topic], message.sequence, start, message.publish_time, message.data);
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
