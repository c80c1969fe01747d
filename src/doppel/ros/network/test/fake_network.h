#pragma once
// A network in memory for tests: participants that discover each other immediately, with matching by name,
// type and QoS, one type for each name of a participant, histories by depth, and no loss.

#include <algorithm>
#include <atomic>
#include <deque>
#include <map>
#include <mutex>
#include <ranges>
#include <utility>

#include "doppel/ros/network/environment.h"
#include "doppel/ros/network/participant.h"

namespace doppel::ros2::test {

class FakeReader;
class FakeWriter;

class FakeNetwork {
 public:
  std::unique_ptr<Participant> join(std::function<void()> on_activity);
  std::atomic<bool> acknowledges{true};  // whether readers are synchronised with the writers that they match

 private:
  friend class FakeWriter;
  friend class FakeReader;
  friend class FakeParticipant;

  struct Member {
    Gid gid;
    std::function<void()> on_activity;
    std::uint16_t next_entity = 1;
  };
  struct End {
    EndpointInfo info;
    Member* member = nullptr;
    FakeWriter* writer = nullptr;
    FakeReader* reader = nullptr;
  };

  static bool is_match(const EndpointInfo& writer, const EndpointInfo& reader) {
    return writer.topic == reader.topic && writer.type == reader.type &&
           incompatibility(writer.qos, reader.qos).empty();
  }
  // All functions below require the mutex.
  Gid add(Member& member, const EndpointSpec& spec, FakeWriter* writer, FakeReader* reader);
  void remove(const Gid& gid);
  void notify_all() {
    ++version_;
    for (const auto& member : members_) member->on_activity();
  }
  // Among the endpoints of other members.
  template <class Visit>
  void each_match(const EndpointInfo& of, Visit visit) const {
    for (const End& end : ends_) {
      if (end.info.is_writer == of.is_writer || is_same_participant(end.member->gid, of.gid)) continue;
      if (of.is_writer ? is_match(of, end.info) : is_match(end.info, of)) visit(end);
    }
  }
  [[nodiscard]] const EndpointInfo& info(const Gid& gid) const {
    return std::ranges::find(ends_, gid, [](const End& end) { return end.info.gid; })->info;
  }

  std::recursive_mutex mutex_;
  std::vector<std::unique_ptr<Member>> members_;
  std::deque<End> ends_;
  std::uint64_t version_ = 1;
  std::uint8_t next_member_ = 1;
};

class FakeReader : public Reader {
 public:
  template <class Member>
  FakeReader(FakeNetwork& network, Member& member, const EndpointSpec& spec)
      : network_(network), depth_(spec.qos.history == History::keep_all ? ~std::size_t{0} : spec.qos.depth) {
    gid_ = network_.add(member, spec, nullptr, this);
  }
  ~FakeReader() override { network_.remove(gid_); }
  [[nodiscard]] const Gid& gid() const override { return gid_; }
  [[nodiscard]] bool is_ready() const override {
    const std::lock_guard lock(network_.mutex_);
    return !samples_.empty();
  }
  bool take(Sample& sample) override {
    const std::lock_guard lock(network_.mutex_);
    if (samples_.empty()) return false;
    sample = std::move(samples_.front());
    samples_.pop_front();
    return true;
  }
  [[nodiscard]] std::size_t matched() const override {
    const std::lock_guard lock(network_.mutex_);
    std::size_t count = 0;
    network_.each_match(network_.info(gid_), [&](const auto&) { ++count; });
    return count;
  }
  [[nodiscard]] bool is_matched(const Gid& writer) const override {
    const std::lock_guard lock(network_.mutex_);
    bool found = false;
    network_.each_match(network_.info(gid_), [&](const auto& end) { found |= end.info.gid == writer; });
    return found;
  }
  [[nodiscard]] std::uint64_t lost() const override { return lost_; }

  void give(Sample sample) {
    samples_.push_back(std::move(sample));
    if (samples_.size() <= depth_) return;
    samples_.pop_front();
    ++lost_;
  }

 private:
  FakeNetwork& network_;
  std::size_t depth_;
  Gid gid_;
  std::deque<Sample> samples_;
  std::uint64_t lost_ = 0;
};

class FakeWriter : public Writer {
 public:
  template <class Member>
  FakeWriter(FakeNetwork& network, Member& member, const EndpointSpec& spec)
      : network_(network), qos_(spec.qos) {
    gid_ = network_.add(member, spec, this, nullptr);
  }
  ~FakeWriter() override { network_.remove(gid_); }
  [[nodiscard]] const Gid& gid() const override { return gid_; }
  std::optional<SampleIdentity> write(std::span<const std::byte> cdr,
                                      const SampleIdentity* related) override {
    const std::lock_guard lock(network_.mutex_);
    Sample sample;
    sample.cdr.assign(cdr.begin(), cdr.end());
    sample.identity = {gid_, ++sequence_};
    if (related != nullptr) sample.related = *related;
    network_.each_match(network_.info(gid_), [&](const auto& end) {
      end.reader->give(sample);
      end.member->on_activity();
    });
    if (qos_.durability == Durability::transient_local) {
      history_.push_back(sample);
      if (history_.size() > qos_.depth) history_.pop_front();
    }
    return sample.identity;
  }
  std::size_t forget() override {
    const std::lock_guard lock(network_.mutex_);
    return std::exchange(history_, {}).size();
  }
  [[nodiscard]] std::size_t matched() const override {
    const std::lock_guard lock(network_.mutex_);
    std::size_t count = 0;
    network_.each_match(network_.info(gid_), [&](const auto&) { ++count; });
    return count;
  }
  [[nodiscard]] bool is_matched(const Gid& reader) const override {
    const std::lock_guard lock(network_.mutex_);
    bool found = false;
    network_.each_match(network_.info(gid_), [&](const auto& end) { found |= end.info.gid == reader; });
    return found;
  }
  [[nodiscard]] bool is_in_step(const Gid& reader) const override {
    return network_.acknowledges && is_matched(reader);
  }
  [[nodiscard]] const std::deque<Sample>& history() const { return history_; }

 private:
  FakeNetwork& network_;
  QosProfile qos_;
  Gid gid_;
  std::int64_t sequence_ = 0;
  std::deque<Sample> history_;
};

class FakeParticipant : public Participant {
 public:
  FakeParticipant(FakeNetwork& network, std::function<void()> on_activity) : network_(network) {
    const std::lock_guard lock(network_.mutex_);
    auto member = std::make_unique<FakeNetwork::Member>();
    member->gid.bytes[0] = network_.next_member_++;
    member->gid.bytes[14] = 0x01;  // the RTPS entity id of a participant: 00 00 01 c1
    member->gid.bytes[15] = 0xc1;
    member->on_activity = std::move(on_activity);
    member_ = member.get();
    network_.members_.push_back(std::move(member));
    network_.notify_all();
  }
  ~FakeParticipant() override {
    const std::lock_guard lock(network_.mutex_);
    std::erase_if(network_.members_, [this](const auto& member) { return member.get() == member_; });
    network_.notify_all();
  }
  [[nodiscard]] const Gid& gid() const override { return member_->gid; }
  [[nodiscard]] std::unique_ptr<Writer> make_writer(const EndpointSpec& spec) override {
    return std::make_unique<FakeWriter>(network_, *member_, spec);
  }
  [[nodiscard]] std::unique_ptr<Reader> make_reader(const EndpointSpec& spec) override {
    return std::make_unique<FakeReader>(network_, *member_, spec);
  }
  [[nodiscard]] std::uint64_t discovery_version() const override {
    const std::lock_guard lock(network_.mutex_);
    return network_.version_;
  }
  [[nodiscard]] std::vector<EndpointInfo> endpoints() const override {
    const std::lock_guard lock(network_.mutex_);
    std::vector<EndpointInfo> infos;
    for (const auto& end : network_.ends_) {
      infos.push_back(end.info);
      infos.back().is_own = end.member == member_;
    }
    return infos;
  }
  [[nodiscard]] std::vector<ParticipantInfo> participants() const override {
    const std::lock_guard lock(network_.mutex_);
    std::vector<ParticipantInfo> infos;
    for (const auto& member : network_.members_) infos.push_back({member->gid, "/", "/"});
    return infos;
  }
  [[nodiscard]] MiddlewareLog middleware_log() const override { return {}; }
  [[nodiscard]] std::uint64_t refused_datagrams() const override { return 0; }

 private:
  FakeNetwork& network_;
  FakeNetwork::Member* member_;
};

inline std::unique_ptr<Participant> FakeNetwork::join(std::function<void()> on_activity) {
  return std::make_unique<FakeParticipant>(*this, std::move(on_activity));
}

inline Gid FakeNetwork::add(Member& member, const EndpointSpec& spec, FakeWriter* writer,
                            FakeReader* reader) {
  const std::lock_guard lock(mutex_);
  for (const End& other : ends_) {
    if (other.member == &member && other.info.topic == spec.topic && other.info.type != spec.type)
      throw NetworkError(spec.topic + " carries " + other.info.type);
  }
  End end;
  end.info.gid = member.gid;
  end.info.gid.bytes[13] = static_cast<std::uint8_t>(member.next_entity >> 8);
  end.info.gid.bytes[14] = static_cast<std::uint8_t>(member.next_entity++);
  end.info.gid.bytes[15] = writer != nullptr ? 0x03 : 0x04;
  end.info.is_writer = writer != nullptr;
  end.info.topic = spec.topic;
  end.info.type = spec.type;
  end.info.type_hash = spec.type_hash;
  end.info.qos = spec.qos;
  end.member = &member;
  end.writer = writer;
  end.reader = reader;
  if (reader != nullptr && spec.qos.durability == Durability::transient_local) {
    each_match(end.info, [&](const End& other) {
      for (const Sample& sample : other.writer->history()) reader->give(sample);
    });
  }
  ends_.push_back(end);
  notify_all();
  return end.info.gid;
}

inline void FakeNetwork::remove(const Gid& gid) {
  const std::lock_guard lock(mutex_);
  std::erase_if(ends_, [&gid](const End& end) { return end.info.gid == gid; });
  notify_all();
}

}  // namespace doppel::ros2::test
