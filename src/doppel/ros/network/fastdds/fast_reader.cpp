#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/DataReaderListener.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>

#include "doppel/ros/network/fastdds/fast_convert.h"
#include "doppel/ros/network/fastdds/fast_endpoint.h"
#include "doppel/ros/network/fastdds/fast_participant.h"

namespace doppel::ros2::fast {
namespace {

class FastReader : public Reader, dds::DataReaderListener {
 public:
  FastReader(FastParticipant& participant, const EndpointSpec& spec)
      : participant_(participant), matches_(participant.gid()), topic_(participant.acquire_topic(spec)) {
    dds::StatusMask mask = dds::StatusMask::data_available();
    mask << dds::StatusMask::subscription_matched() << dds::StatusMask::sample_lost();
    reader_ = participant_.subscriber().create_datareader(topic_, reader_qos(spec), this, mask);
    if (reader_ == nullptr) {
      participant_.release_topic(topic_);
      throw NetworkError("Fast DDS cannot create a reader of '" + spec.topic + "'; check its QoS");
    }
    gid_ = gid_of(reader_->guid());
    participant_.announce(gid_, false, spec);
  }
  ~FastReader() override {
    participant_.withdraw(gid_);
    reader_->set_listener(nullptr);
    participant_.subscriber().delete_datareader(reader_);
    participant_.release_topic(topic_);
  }
  FastReader(const FastReader&) = delete;
  FastReader& operator=(const FastReader&) = delete;

  [[nodiscard]] const Gid& gid() const override { return gid_; }
  [[nodiscard]] bool is_ready() const override { return is_ready_.load(std::memory_order_acquire); }

  bool take(Sample& sample) override {
    if (take_foreign(sample)) return true;
    // Later samples set the flag again; the second check finds earlier ones.
    is_ready_.store(false, std::memory_order_seq_cst);
    if (!take_foreign(sample)) return false;
    is_ready_.store(true, std::memory_order_release);
    return true;
  }

  [[nodiscard]] std::size_t matched() const override { return matches_.count(); }
  [[nodiscard]] bool is_matched(const Gid& writer) const override { return matches_.contains(writer); }
  [[nodiscard]] std::uint64_t lost() const override { return lost_.load(std::memory_order_relaxed); }

 private:
  bool take_foreign(Sample& sample) {
    dds::SampleInfo info;
    while (is_ok(reader_->take_next_sample(&sample.cdr, &info))) {
      sample.identity = identity_of(info.sample_identity);
      if (!info.valid_data || is_same_participant(sample.identity.writer, participant_.gid())) continue;
      sample.related = identity_of(info.related_sample_identity);
      sample.source_timestamp = info.source_timestamp.to_ns();
      sample.reception_timestamp = info.reception_timestamp.to_ns();
      return true;
    }
    return false;
  }

  void on_data_available(dds::DataReader*) override {
    is_ready_.store(true, std::memory_order_seq_cst);
    participant_.on_activity();
  }
  void on_subscription_matched(dds::DataReader*, const dds::SubscriptionMatchedStatus& status) override {
    matches_.update(status.last_publication_handle, status.current_count_change);
    participant_.on_activity();
  }
  void on_sample_lost(dds::DataReader*, const dds::SampleLostStatus& status) override {
    lost_.store(static_cast<std::uint64_t>(status.total_count), std::memory_order_relaxed);
  }

  FastParticipant& participant_;
  Matches matches_;
  dds::Topic* const topic_;
  dds::DataReader* reader_ = nullptr;
  Gid gid_;
  std::atomic<bool> is_ready_{false};
  std::atomic<std::uint64_t> lost_{0};
};

}  // namespace

std::unique_ptr<Reader> make_fast_reader(FastParticipant& participant, const EndpointSpec& spec) {
  return std::make_unique<FastReader>(participant, spec);
}

}  // namespace doppel::ros2::fast
